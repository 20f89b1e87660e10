#!/usr/bin/env python3
"""Runs clang-tidy on every source of ours that a build knows, several at once, and prints what it finds."""
import argparse
import concurrent.futures
import json
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def sources(build):
    commands = json.loads((build / "compile_commands.json").read_text())
    files = {Path(entry["directory"], entry["file"]).resolve() for entry in commands}
    # Generated files in the build folder are not ours to tidy.
    return sorted(file for file in files if file.is_relative_to(ROOT) and not file.is_relative_to(ROOT / "out"))


def tidy(tool, build, file):
    began = time.monotonic()
    result = subprocess.run([tool, "--quiet", "-p", str(build), str(file)], cwd=ROOT, capture_output=True, text=True)
    # stderr has the count of suppressed warnings, and real errors only when there is no other output.
    text = result.stdout or (result.stderr if result.returncode else "")
    return file, result.returncode, text.replace(f"{ROOT}/", ""), time.monotonic() - began


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tool", default="clang-tidy")
    parser.add_argument("--build", type=Path, default=ROOT / "out/build/host-clang")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--times", action="store_true", help="print how long each file took")
    parser.add_argument("files", nargs="*", type=Path, help="only these (default: all)")
    options = parser.parse_args()
    files = [file.resolve() for file in options.files] or sources(options.build)
    failed = 0
    printed = set()
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for file, status, text, seconds in pool.map(lambda f: tidy(options.tool, options.build, f), files):
            failed += status != 0
            if options.times:
                print(f"{seconds:6.1f} s {file.relative_to(ROOT)}")
            if text and text not in printed:  # a header's finding comes once per source that includes it
                printed.add(text)
                print(text, end="", flush=True)
    print(f"{len(files)} files, {failed} with findings")
    sys.exit(1 if failed or not files else 0)


if __name__ == "__main__":
    main()
