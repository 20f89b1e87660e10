#!/usr/bin/env python3
"""The emulated processor against QEMU: the same program on both must say the same.

  compare.py output EMULATE PROGRAM                what it prints is equal, line by line
  compare.py instructions EMULATE PROGRAM REFERENCE   the hashes of instructions.c, on QEMU, emulator and host
  compare.py counts EMULATE PROGRAM FUNCTION... [-- ARGUMENT...]
                                                   instructions of every call, as tests/target/count.py counts
"""
import json
import subprocess
import sys
from pathlib import Path

COUNT = Path(__file__).resolve().parents[1] / "count.py"

# unicorn 2.0.1 sets Q where the two products of a dual multiply-accumulate wrap and the sum does not; the result
# is right. The firmware does not read Q.
KNOWN_FLAGS = {"smlad", "smladx"}


def run(command):
    result = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=250)
    if result.returncode != 0:
        sys.exit(f"compare.py: {Path(command[0]).name} ended with {result.returncode}\n{result.stdout[-2000:]}"
                 f"{result.stderr[-2000:]}")
    return result.stdout.splitlines()


def on_qemu(program):
    return run(["qemu-system-arm", "-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "none",
                "-semihosting-config", "enable=on,target=native", "-kernel", program])


def compare_output(emulate, program):
    ours, theirs = run([emulate, program]), on_qemu(program)
    for number, (a, b) in enumerate(zip(ours, theirs), start=1):
        if a != b:
            sys.exit(f"line {number}: {a}, under QEMU {b}; before that: {' '.join(ours[max(0, number - 12):number - 1])}")
    if len(ours) != len(theirs) or len(ours) < 100:
        sys.exit(f"{len(ours)} lines, under QEMU {len(theirs)}")
    print(f"{len(ours)} lines are equal")


def compare_instructions(emulate, program, reference):
    tables = {name: {line.split()[0]: line.split()[1:] for line in lines} for name, lines in
              (("host", run([reference])), ("QEMU", on_qemu(program)), ("emulator", run([emulate, program])))}
    wrong = []
    for name, expected in tables["host"].items():
        if tables["QEMU"].get(name) != expected:
            wrong.append(f"{name}: QEMU differs from the manual")
        found = tables["emulator"].get(name, ["", ""])
        if found[0] != expected[0] or (found[1] != expected[1] and name not in KNOWN_FLAGS):
            wrong.append(f"{name}: the emulator differs from the manual")
    if wrong or len(tables["host"]) < 200:
        sys.exit("\n".join(wrong) or "too few instructions")
    print(f"{len(tables['host'])} instructions agree")


def compare_counts(emulate, program, functions, arguments):
    options = [word for name in functions for word in ("--function", name)]
    text = subprocess.run([sys.executable, COUNT, program, *options, "--json", "-", "--", *arguments], check=True,
                          capture_output=True, text=True, timeout=250).stdout
    theirs = {name: row["each"] for name, row in json.loads(text[text.index("{"):])["functions"].items()}
    ours = {}
    for line in run([emulate, *[word for name in functions for word in ("--count", name)], program, *arguments]):
        parts = line.split()
        if len(parts) == 3 and parts[0] == "call":
            ours.setdefault(parts[1], []).append(int(parts[2]))
    for name in functions:
        if not ours.get(name) or ours[name] != theirs.get(name):
            sys.exit(f"{name}: {len(ours.get(name, []))} calls, {len(theirs.get(name, []))} under QEMU, or other counts")
        print(f"{name}: {len(ours[name])} calls of {min(ours[name])} to {max(ours[name])} instructions, equal")


def main():
    words = sys.argv[1:]
    arguments = []
    if "--" in words:
        arguments = words[words.index("--") + 1:]
        words = words[:words.index("--")]
    if len(words) == 3 and words[0] == "output":
        compare_output(*words[1:])
    elif len(words) == 4 and words[0] == "instructions":
        compare_instructions(*words[1:])
    elif len(words) > 3 and words[0] == "counts":
        compare_counts(words[1], words[2], words[3:], arguments)
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
