#!/usr/bin/env python3
"""Writes docs/results.md: every expectation of every scenario with the value measured on the worst run."""
import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PMSIM = ROOT / "out/build/host-release/tools/pmsim/pmsim"
HEAD = """# Results

What the closed loop does, measured on the switching-level plant by the scenarios of `tests/scenario`. Made by
`tools/results`; a bound that does not hold fails `tools/check`. Values are those of the worst run of a sweep; position
errors are electrical degrees, truth minus estimate.
"""


def measure(path):
    run = subprocess.run([PMSIM, "run", path, "--json"], capture_output=True, text=True, check=False)
    if run.returncode > 1:
        sys.exit(run.stderr)
    return json.loads(run.stdout)


def value(item):
    number = item["value"]
    return f"{number:.3g}" if isinstance(number, (int, float)) else str(number)


def table(result):
    lines = ["| what | value | bound | unit | section | runs | worst run |", "|---|---|---|---|---|---|---|"]
    for item in result["expectations"]:
        verdict = "" if item["pass"] else " **FAIL**"
        lines.append(
            f"| `{item['name']}` | {value(item)}{verdict} | {item['bound']} | {item['unit']} | {item['book']} "
            f"| {item['passed']}/{item['of']} | {item['worst_run']} |"
        )
    return "\n".join(lines)


def main():
    parts = [HEAD]
    for path in sorted((ROOT / "tests/scenario").glob("*.yaml")):
        print(path.name, flush=True)
        result = measure(path)
        parts.append(f"## {result['title']}\n\n`{path.name}`, {result['simulated_s']:.1f} s simulated\n\n{table(result)}\n")
    (ROOT / "docs/results.md").write_text("\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
