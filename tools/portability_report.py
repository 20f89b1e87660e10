#!/usr/bin/env python3
"""Fills the table of docs/portability.md, between `<!-- measured -->` and `<!-- end -->`, with what is measured now.

Bytes are those of the libraries (tools/size_report.py), instructions those of the replayed demo
(tests/target/drive). The builds must be there: tools/portability_report makes them first.
"""
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from size_report import ROOT, collect

PAGE = ROOT / "docs/portability.md"
PMSIM = ROOT / "out/build/host-release/tools/pmsim/pmsim"
PRESETS = {"cortex-m0plus": "Cortex-M0+", "stm32g431": "Cortex-M4", "cortex-m33": "Cortex-M33", "rv32imac": "RV32IMAC"}
APPLICATION = ("pm_params", "pm_app")
MODES = {"step_flux": "high speed, active flux", "step_injection": "low speed, injection", "step_start": "start"}


def count(build, record):
    """Mode -> {mean, max} of the instructions of one control period; fails if a bit differs from the host's."""
    elf = build / "tests/target/drive/drive_replay.elf"
    command = [sys.executable, ROOT / "tests/target/count.py", elf, "--function", "step_*", "--json", "-", "--", record]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["functions"]


def measure(preset, record):
    build = ROOT / "out/build" / preset
    modules = collect(build)
    control = [m["total"] for name, m in modules.items() if name not in APPLICATION]
    application = [m["total"] for name, m in modules.items() if name in APPLICATION]
    drive_state, app_state = modules["pm_drive"]["structs"]["drive_t"], modules["pm_app"]["structs"]["app_t"]
    counts = count(build, record)
    return {
        "code of the drive, bytes": sum(t["code"] for t in control),
        "its tables, bytes": sum(t["rodata"] for t in control),
        "its state (`drive_t`), bytes": drive_state,
        "application and parameter store: code, bytes": sum(t["code"] for t in application),
        "... tables, bytes": sum(t["rodata"] for t in application),
        "... state, bytes": app_state - drive_state + sum(t["data"] + t["bss"] for t in application),
        **{f"instructions per period, {text}: mean (most)":
           f"{counts[mode]['mean']:.0f} ({counts[mode]['max']})" for mode, text in MODES.items()},
    }


def main():
    with tempfile.TemporaryDirectory(prefix="pm_portability") as folder:
        record = Path(folder) / "demo.rec"
        subprocess.run([PMSIM, "record", ROOT / "tests/scenario/demo.yaml", "--out", record], check=True, cwd=ROOT,
                       stdout=subprocess.DEVNULL)
        columns = [measure(preset, record) for preset in PRESETS]
    lines = ["| | " + " | ".join(PRESETS.values()) + " |", "|---|" + "---:|" * len(PRESETS)]
    lines += [f"| {row} | " + " | ".join(str(column[row]) for column in columns) + " |" for row in columns[0]]
    table = "\n".join(lines)
    text, found = re.subn(r"(?s)(<!-- measured -->\n).*?(<!-- end -->)", lambda m: f"{m[1]}\n{table}\n\n{m[2]}",
                          PAGE.read_text())
    if found != 1:
        sys.exit(f"portability_report.py: {PAGE} has no table to fill")
    PAGE.write_text(text)
    print(table)


if __name__ == "__main__":
    main()
