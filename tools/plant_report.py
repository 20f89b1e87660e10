#!/usr/bin/env python3
"""Fills the tables of docs/plant.md, between `<!-- name -->` and `<!-- end -->`, with what is measured now.

The tests write their figures to the file that PMDRIVE_MEASURED names (tests/reference/measured.h), as lines
id,value,bound,unit,section. Figures that belong together are one row with the worst of them.
"""
import csv
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "out/build/host-release"
PMSIM = BUILD / "tools/pmsim/pmsim"
PAGE = ROOT / "docs/plant.md"
TESTS = "^(sim_plant|pmsim)"  # whose figures are wanted

# What a row says, and the ids that it sums up. An id that none takes is a row of its own.
ROWS = [
    ("ODE at 1e-10: linear machine, 1 s", r"ode_linear_"),
    ("... with winding harmonics, asymmetry, cogging", r"ode_effects_"),
    ("... energy form", r"ode_energy_form_(imposed|free)_"),
    ("... energy form with harmonics, asymmetry, cogging", r"ode_energy_form_effects_"),
    ("... energy form with eddy circuits", r"ode_eddy_"),
    ("... table, against its own interpolation", r"ode_table_(imposed|free)_"),
    ("... table sampled from a closed form", r"ode_table_closed_form_"),
    ("... closed form", r"ode_closed_form_"),
    ("... two sets, mutual inductance 0, 0.3, 0.7 L", r"ode_two_sets_M"),
    ("... two sets with harmonics and asymmetry", r"ode_two_sets_effects_"),
    ("... two saturating sets", r"ode_two_sets_saturating_"),
    ("... two sets with everything at once", r"ode_two_sets_everything_"),
    ("... open winding", r"ode_open_(imposed|free)_"),
    ("... open winding with harmonics and asymmetry", r"ode_open_effects_"),
    ("abc and dq references against each other", r"abc_dq_references"),
    ("abc formulation against dq", r"abc_dq_plant"),
    ("locked rotor", r"locked_rotor"),
    ("three-phase short circuit", r"short_circuit_"),
    ("no-load EMF with harmonics 3, 5, 7", r"no_load_emf"),
    ("temperature: R and psi_m", r"temperature_"),
    ("negative sequence of unlike phases", r"asymmetry_"),
    ("torque of a table against virtual work", r"torque_table_"),
    ("HF admittance against the tangent of the map", r"hf_admittance"),
    ("saliency of orders -4, 8, -10, 14: error of the axis found", r"saliency_order_"),
    ("impedance with eddy circuits, 30 to 1000 Hz", r"hf_eddy_"),
    ("pulse response at rated peak", r"pulse_(ipm|spm)_(max|rms)"),
    ("pulse response, second order alone", r"pulse_ipm_second_order"),
    ("zero-sequence voltage, rotating injection", r"zsv_rotating"),
    ("third harmonic in the star point", r"zsv_third_harmonic"),
    ("current of the zero-sequence loop, open winding", r"open_winding_i0_"),
    ("harmonics of two sets by subspace", r"vsd_mapping"),
    ("dead-time voltage error", r"dead_time_"),
    ("output capacitance: slope near zero current", r"capacitance_slope"),
    ("output capacitance: whole curve", r"capacitance_curve"),
    ("freewheeling angle", r"freewheel"),
    ("energy balance", r"energy_"),
    ("DC link: ripple", r"link_ripple"),
    ("DC link: lost supply", r"lost_supply_voltage"),
    ("DC link: energy", r"(lost_supply_energy|link_energy|chopper_rise_energy)"),
    ("DC link: chopper", r"chopper_fall"),
    ("halving the tolerance moves a figure by", r"tolerance_"),
    ("motulator: linear machine", r"motulator_linear_"),
    ("motulator: energy form", r"motulator_energy_form_"),
    ("motulator: table", r"motulator_table_"),
    ("motulator: closed form of its examples", r"motulator_closed_form_"),
]


def what(name):
    for text, pattern in ROWS:
        if re.match(pattern, name):
            return text
    return f"`{name}`"


def order(text):
    texts = [row[0] for row in ROWS]
    return texts.index(text) if text in texts else len(texts)


class Row:
    def __init__(self):
        self.ids, self.sections, self.worst = set(), set(), None

    def add(self, name, value, section):
        self.ids.add(name)
        self.sections.add(section)
        if self.worst is None or not value <= self.worst:  # also takes a value that is not a number
            self.worst = value


def measured_table(path):
    rows = {}
    with open(path, encoding="utf-8") as file:
        for name, value, bound, unit, section in csv.reader(file):
            rows.setdefault((what(name), bound, unit), Row()).add(name, float(value), section)
    if not rows:
        sys.exit("no test has written a figure")
    lines = ["| Check | Worst | Bound | Unit | Figures | Effect or section |", "|---|---|---|---|---|---|"]
    for (text, bound, unit), row in sorted(rows.items(), key=lambda item: (order(item[0][0]), item[0])):
        verdict = "" if row.worst <= float(bound) else " **FAIL**"
        sections = ", ".join(sorted(row.sections))
        lines.append(
            f"| {text} | {row.worst:.1e}{verdict} | {float(bound):g} | {unit.replace('_', ' ')} | {len(row.ids)} "
            f"| {sections} |"
        )
    return "\n".join(lines)


def run_measured(command, folder, name):
    path = folder / name
    path.touch()
    environment = {**os.environ, "PMDRIVE_MEASURED": str(path)}
    result = subprocess.run([str(x) for x in command], cwd=ROOT, env=environment, capture_output=True, text=True,
                            check=False)
    if result.returncode != 0:
        print("\n".join((result.stdout + result.stderr).splitlines()[-40:]), file=sys.stderr)
    return path, result.returncode


def validation(folder):
    command = ["ctest", "--test-dir", BUILD, "-R", TESTS, "-L", "unit", "--output-on-failure", "-j", os.cpu_count()]
    path, code = run_measured(command, folder, "measured.csv")
    if code != 0:
        print("some test fails; the table says which figure if it has one", file=sys.stderr)
    return measured_table(path), code


def processor():
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return "unknown processor"


def speed():
    lines = [f"One core of: {processor()}.", "", "| Workload | What runs | Simulated s per wall s |", "|---|---|---|"]
    others = [[path] for path in sorted((ROOT / "tests/scenario").glob("bench_*.yaml"))]
    for scenario in [[], *others]:  # without one: bench.yaml and the machines with six legs
        result = subprocess.run([PMSIM, "bench", *scenario], cwd=ROOT, capture_output=True, text=True, check=False)
        if result.returncode != 0:
            sys.exit(f"pmsim bench {scenario}:\n{result.stderr}")
        for line in result.stdout.splitlines():
            heading = re.match(r"(.+): .* best of", line)
            title = heading.group(1) if heading else title
            rate = re.match(r"(.+?) +([0-9.]+) simulated s per wall s", line)
            if rate:
                lines.append(f"| {title} | {rate.group(1)} | {float(rate.group(2)):.3g} |")
    return "\n".join(lines)


def figures(table):
    """What a table says: check, bound and unit -> worst value."""
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines() if line.startswith("| ")]
    return {(row[0], row[2], row[3]): float(row[1].replace("**FAIL**", "")) for row in rows[1:] if len(row) == 6}


def check(measured):
    """Is the page's table what tests have written? A figure may move by half, or by a twentieth of its bound."""
    page = PAGE.read_text(encoding="utf-8")
    shown = figures(re.search(r"<!-- measured -->\n(.*?)<!-- end -->", page, re.DOTALL)[1])
    now = figures(measured_table(measured))
    stale = [f"{what}, bound {bound} {unit}: {'there' if key in now else 'no test measures it'}, "
             f"{'' if key in shown else 'not in the page'}"
             for key in sorted(shown.keys() ^ now.keys()) for what, bound, unit in [key]]
    for key in sorted(shown.keys() & now.keys()):
        if abs(now[key] - shown[key]) > max(0.5 * shown[key], 0.05 * float(key[1])):
            stale.append(f"{key[0]}: {now[key]:.1e}, in the page {shown[key]:.1e}")
    if stale:
        sys.exit("\n".join(["docs/plant.md is not up to date:", *stale, "tools/plant_report"]))


def motulator(folder):
    script = [sys.executable, ROOT / "tests/optional/motulator_test.py", PMSIM, BUILD / "motulator"]
    path, code = run_measured(script, folder, "motulator.csv")
    if code not in (0, 1):
        sys.exit("the comparison with motulator did not run")
    bench = subprocess.run([sys.executable, ROOT / "tools/bench_motulator.py"], stdout=subprocess.PIPE, text=True,
                           check=True)
    rates = re.findall(r"^(.+?) +([0-9.]+) +([0-9.]+) +[0-9]+$", bench.stdout, re.MULTILINE)
    lines = ["", "| IPM-1000 switched at 20 kHz | pmsim | motulator |", "|---|---|---|"]
    for name, ours, theirs in rates:
        lines.append(f"| {name}, simulated s per wall s | {float(ours):.3g} | {float(theirs):.2g} |")
    return measured_table(path) + "\n" + "\n".join(lines), code


def fill(page, name, text):
    pattern = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end -->)", re.DOTALL)
    page, count = pattern.subn(lambda found: f"{found.group(1)}{text}\n{found.group(2)}", page)
    if count != 1:
        sys.exit(f"{PAGE.name} must have one place for '{name}'")
    return page


def main():
    if sys.argv[1:2] == ["--check"]:
        check(sys.argv[2])
        return
    page = PAGE.read_text(encoding="utf-8")
    page = fill(page, "speed", speed())  # first, while the machine is quiet
    with tempfile.TemporaryDirectory() as name:
        text, code = validation(Path(name))
        page = fill(page, "measured", text)
        if "--motulator" in sys.argv[1:]:
            text, worse = motulator(Path(name))
            page = fill(page, "motulator", text)
            code = code or worse
    PAGE.write_text(page, encoding="utf-8")
    sys.exit(1 if code != 0 else 0)


if __name__ == "__main__":
    main()
