#!/usr/bin/env python3
"""Count executed instructions per call of a function, under QEMU: Cortex-M4, and what else machine.py knows.

The counts are exact and the same on every run: a call costs what its executed instructions are, from the
first of the function to its return, with everything it calls. See README.md in this folder.
"""
import argparse
import fnmatch
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from machine import machine_of, run

HERE = Path(__file__).resolve().parent
INSTRUCTION = re.compile(r"\s*([0-9a-f]+):\t((?:[0-9a-f]{4,8} ?)+)\s*\t(.+)")


def functions_of(elf, machine):
    """Address -> name of every function; of aliases the first by name."""
    found = {}
    for line in sorted(run(machine.prefix + "nm", elf).splitlines(), key=lambda text: text.split()[-1]):
        parts = line.split()
        if len(parts) == 3 and parts[1] in "TtWw" and not parts[2].startswith(("$", ".")):
            found.setdefault(int(parts[0], 16) & ~1, parts[2])
    return found


def return_addresses(elf, machine):
    """The instruction after every call instruction."""
    found = []
    for line in run(machine.prefix + "objdump", "-d", elf).splitlines():
        match = INSTRUCTION.match(line)
        if match and machine.call.match(match.group(3)):
            size = len(match.group(2).replace(" ", "")) // 2
            found.append(int(match.group(1), 16) + size)
    return sorted(set(found))


def plugin_api(qemu):
    """QEMU refuses plugins of another API generation; which one a version wants is fixed."""
    version = re.search(r"version (\d+)\.(\d+)", run(qemu, "--version"))
    return 2 if int(version.group(1)) >= 9 else 1


def build_plugin(folder, qemu):
    api = plugin_api(qemu)
    source = HERE / "plugin_calls.c"
    plugin = folder / f"plugin_calls_v{api}.so"
    if not plugin.exists() or plugin.stat().st_mtime < source.stat().st_mtime:
        # Tests run in parallel: build aside, then move into place in one step.
        aside = folder / f"{plugin.name}.{os.getpid()}"
        subprocess.run(["cc", "-std=c11", "-O2", "-Wall", "-Wextra", "-fPIC", "-shared", "-fvisibility=hidden",
                        f"-DPM_PLUGIN_API={api}", "-o", aside, source], check=True)
        os.replace(aside, plugin)
    return plugin


def select(functions, patterns):
    chosen = {}
    for pattern in patterns:
        # gcc names a specialised copy of f f.constprop.0 and the like; it is f all the same.
        hits = {a: n for a, n in functions.items() if fnmatch.fnmatchcase(n.split(".")[0], pattern)}
        if not hits:
            sys.exit(f"count.py: no function {pattern} in the program (inlined? unused and dropped by the linker?)")
        chosen.update(hits)
    return chosen


def execute(elf, machine, chosen, functions, arguments, timeout, echo):
    with tempfile.TemporaryDirectory(prefix="pm_count") as temporary:
        map_file = Path(temporary) / "map"
        out_file = Path(temporary) / "out"
        lines = [f"f {a:x} {functions[a][:95]}" for a in sorted(functions)]
        lines += [f"m {a:x}" for a in chosen]
        lines += [f"r {a:x}" for a in return_addresses(elf, machine)]
        map_file.write_text("\n".join(lines) + "\n")
        semihosting = "enable=on,target=native" + "".join(
            ",arg=" + word.replace(",", ",,") for word in [Path(elf).name, *arguments])
        plugin = build_plugin(Path(elf).resolve().parent, machine.qemu[0])
        command = [*machine.qemu, "-display", "none", "-monitor", "none", "-serial", "none",
                   "-semihosting-config", semihosting, "-kernel", str(elf),
                   "-plugin", f"{plugin},map={map_file},out={out_file}"]
        result = subprocess.run(command, stdin=subprocess.DEVNULL, timeout=timeout,
                                stdout=None if echo else subprocess.DEVNULL)
        if result.returncode != 0:
            sys.exit(f"count.py: {Path(elf).name} ended with status {result.returncode}")
        return out_file.read_text().splitlines()


def evaluate(lines, skip):
    calls, profile = {}, {}
    for line in lines:
        parts = line.split()
        if parts[0] == "call":
            calls.setdefault(parts[1], []).append(int(parts[2]))
        elif parts[0] == "prof":
            profile[parts[1]] = {"calls": int(parts[2]), "instructions": int(parts[3])}
    table = {}
    for name, counts in calls.items():
        kept = counts[skip:]
        if kept:
            table[name] = {"calls": len(kept), "min": min(kept), "mean": sum(kept) / len(kept), "max": max(kept),
                           "each": kept}
    return table, profile


def print_tables(table, profile, measured_calls):
    width = max(len(name) for name in table)
    print(f"{'function':<{width}}  {'calls':>8} {'min':>8} {'mean':>10} {'max':>8}")
    for name, row in sorted(table.items()):
        print(f"{name:<{width}}  {row['calls']:>8} {row['min']:>8} {row['mean']:>10.2f} {row['max']:>8}")
    if profile:
        width = max(len(name) for name in profile)
        total = sum(row["instructions"] for row in profile.values())
        print(f"\n{'own instructions of':<{width}}  {'calls':>8} {'per measured call':>18} {'share':>7}")
        for name, row in sorted(profile.items(), key=lambda item: -item[1]["instructions"]):
            print(f"{name:<{width}}  {row['calls']:>8} {row['instructions'] / measured_calls:>18.2f} "
                  f"{100 * row['instructions'] / total:>6.1f}%")


def check_limits(table, limits, what):
    good = True
    for text in limits:
        name, _, bound = text.partition("=")
        got = table[name][what] if name in table else None
        held = got is not None and got <= float(bound)
        print(f"{'PASS' if held else 'FAIL'} {name} {what} {got if got is None else round(got, 2)} {bound} instructions")
        good = good and held
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0],
                                     epilog="Words after -- are the arguments of the program's main(). "
                                            "Exit status 1: a --limit or --mean is exceeded.")
    parser.add_argument("elf", help="program made with pm_target_program()")
    parser.add_argument("--function", action="append", required=True, metavar="NAME",
                        help="function to measure, may be a pattern like 'pm_*'; may be repeated")
    parser.add_argument("--profile", action="store_true", help="also show where the instructions went, by function")
    parser.add_argument("--limit", action="append", default=[], metavar="NAME=N", help="fail if a call takes more")
    parser.add_argument("--mean", action="append", default=[], metavar="NAME=N", help="fail if calls take more on average")
    parser.add_argument("--skip", type=int, default=0, metavar="N", help="leave out the first N calls")
    parser.add_argument("--json", metavar="FILE", help="write the result, with every call's count; - is stdout")
    parser.add_argument("--timeout", type=float, default=300.0, metavar="S", help="give up after S seconds (300)")
    own, arguments = sys.argv[1:], []
    if "--" in own:
        arguments = own[own.index("--") + 1:]
        own = own[:own.index("--")]
    options = parser.parse_args(own)

    machine = machine_of(options.elf)
    functions = functions_of(options.elf, machine)
    chosen = select(functions, options.function)
    lines = execute(options.elf, machine, chosen, functions, arguments, options.timeout, options.json != "-")
    table, profile = evaluate(lines, options.skip)
    if not table:
        sys.exit("count.py: none of the functions was called and returned")
    if options.json:
        text = json.dumps({"functions": table, "profile": profile if options.profile else {}}, indent=1) + "\n"
        if options.json == "-":
            sys.stdout.write(text)
        else:
            Path(options.json).write_text(text)
    if options.json != "-":
        calls = sum(row["calls"] for row in table.values()) + options.skip
        print_tables(table, profile if options.profile else {}, calls)
    held = [check_limits(table, options.limit, "max"), check_limits(table, options.mean, "mean")]
    if not all(held):
        sys.exit(1)


if __name__ == "__main__":
    main()
