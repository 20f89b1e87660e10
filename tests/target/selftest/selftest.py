"""The counter on functions of known length: known_cost.c says beside each function what it must cost."""
import json
import subprocess
import sys
from pathlib import Path

EXPECTED = {
    "known_leaf": [3] * 35,
    "known_loop": [1 + 2 * n for n in range(1, 11)],
    "known_nested": [12] * 10,
    "known_skipped_call": [8, 5] * 5,
    "known_tail": [5] * 10,
}


def count(elf, *more):
    command = [sys.executable, Path(__file__).parents[1] / "count.py", elf, "--function", "known_*", *more]
    return subprocess.run(command, capture_output=True, text=True)


def main():
    elf = sys.argv[1]
    result = json.loads(count(elf, "--json", "-").stdout)["functions"]
    wrong = {name: (result.get(name, {}).get("each"), want) for name, want in EXPECTED.items()
             if result.get(name, {}).get("each") != want}
    for name, (got, want) in wrong.items():
        print(f"{name}: counted {got}, is {want}")
    if count(elf, "--limit", "known_nested=12").returncode != 0:
        wrong["limit held"] = None
        print("a limit that holds was refused")
    for mean, status in (("known_loop=12", 0), ("known_loop=11.9", 1)):
        if count(elf, "--mean", mean).returncode != status:
            wrong["mean"] = None
            print(f"--mean {mean} did not end with status {status}")
    if count(elf, "--limit", "known_nested=11").returncode != 1:
        wrong["limit exceeded"] = None
        print("a limit that is exceeded was accepted")
    if count(elf, "--", "fail").returncode == 0:
        wrong["exit status"] = None
        print("a program that fails was accepted")
    if "status 99" not in count(elf, "--", "fault").stderr:
        wrong["fault"] = None
        print("a processor fault did not end the program")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
