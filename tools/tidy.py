#!/usr/bin/env python3
"""Runs clang-tidy on every source of ours that a build knows, several at once, and prints what it finds.

A source that was clean is not looked at again until it, a header of ours it includes, its compile command or the
configuration changes. The build's dependency log says what it includes; what was never built is always looked at.
"""
import argparse
import concurrent.futures
import hashlib
import json
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def ours(file):
    return file.is_relative_to(ROOT) and not file.is_relative_to(ROOT / "out")


def read_commands(build):
    """source -> (object, compile command)"""
    entries = json.loads((build / "compile_commands.json").read_text())
    commands = {}
    for entry in entries:
        file = Path(entry["directory"], entry["file"]).resolve()
        if ours(file):
            commands[file] = (entry["command"].split(" -o ")[1].split()[0], entry["command"])
    return commands


def read_dependencies(build):
    """object -> our files it was made from"""
    listing = subprocess.run(["ninja", "-C", str(build), "-t", "deps"], capture_output=True, text=True).stdout
    found, current = {}, None
    for line in listing.splitlines():
        if line.startswith(" "):
            file = Path(line.strip())
            if ours(file):
                current.append(file)
        elif line:
            current = found.setdefault(line.split(":")[0], []) if line.endswith("(VALID)") else []
    return found


def fingerprint(common, command, dependencies):
    digest = hashlib.sha256(common)
    digest.update(command.encode())
    for file in sorted(dependencies):
        digest.update(str(file).encode() + b"\0" + (file.read_bytes() if file.exists() else b"") + b"\0")
    return digest.hexdigest()


def tidy(options, file):
    began = time.monotonic()
    analyser = [f"--extra-arg={word}" for word in ("-Xclang", "-analyzer-config", "-Xclang", f"max-nodes={options.nodes}")]
    result = subprocess.run([options.tool, "--quiet", *analyser, "-p", str(options.build), str(file)], cwd=ROOT,
                            capture_output=True, text=True)
    # stderr counts the suppressed warnings; it matters only when there is no other output.
    text = result.stdout or (result.stderr if result.returncode else "")
    return file, result.returncode, text.replace(f"{ROOT}/", ""), time.monotonic() - began


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tool", default="clang-tidy")
    parser.add_argument("--build", type=Path, default=ROOT / "out/build/host-clang")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--nodes", type=int, default=5000,
                        help="states of a function that the static analyser follows (default: %(default)s; its own, 225000, "
                             "takes six times as long)")
    parser.add_argument("--times", action="store_true", help="print how long each file took")
    parser.add_argument("--all", action="store_true", help="also the files that were clean and have not changed")
    parser.add_argument("--tests", action="store_true",
                        help="also tests/, which take most of the time and are read by two compilers")
    parser.add_argument("--tools", action="store_true",
                        help="also the C++ of the host tools, which take two thirds of the time of the others")
    parser.add_argument("files", nargs="*", type=Path, help="only these (default: all that is flashed, and the plant)")
    options = parser.parse_args()

    commands = read_commands(options.build)
    dependencies = read_dependencies(options.build)
    configuration = b"".join(file.read_bytes() for file in sorted(ROOT.glob("**/.clang-tidy")) if ours(file))
    version = subprocess.run([options.tool, "--version"], capture_output=True, check=True).stdout
    memory = options.build / "tidy_clean.json"
    clean = set(json.loads(memory.read_text())) if memory.exists() else set()

    left_out = [ROOT / folder for folder in ("tests", "tools") if not getattr(options, folder)]
    sources = sorted(file for file in commands if not any(file.is_relative_to(folder) for folder in left_out))
    files = [file.resolve() for file in options.files] or sources
    common = version + configuration + str(options.nodes).encode()
    prints = {file: fingerprint(common, command, [*dependencies[obj], file])
              for file, (obj, command) in commands.items() if obj in dependencies}
    todo = [file for file in files if options.all or prints.get(file) not in clean]
    failed = 0
    printed = set()
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for file, status, text, seconds in pool.map(lambda f: tidy(options, f), todo):
            if status:
                failed += 1
            elif file in prints:
                clean.add(prints[file])
            if options.times:
                print(f"{seconds:6.1f} s {file.relative_to(ROOT)}")
            if text and text not in printed:  # a header's finding comes once per source that includes it
                printed.add(text)
                print(text, end="", flush=True)
    memory.write_text(json.dumps(sorted(clean & set(prints.values()))))
    print(f"{len(files)} files, {len(files) - len(todo)} unchanged since clean, {failed} with findings")
    sys.exit(1 if failed or not files else 0)


if __name__ == "__main__":
    main()
