#!/usr/bin/env python3
"""Writes docs/results/bldc.md: block commutation by every pattern and by what shows its crossings, over speed and load, beside field
orientation of the same machine; and the currents up to which the crossings are seen, predicted and in closed loop (METHODS.md
10.5.2, row 117), a plot beside it.

usage: bldc_report.py [--out DIR] | --check
--check writes nothing: it measures a few cells of the page again, and fails when they are not what stands there.
"""
import argparse
import csv
import json
import math
import re
import subprocess
import tempfile
from pathlib import Path

import yaml

from observer_report import PMSIM, ROOT, cells, fail, plt, table

PATTERNS = ("H_PWM-L_PWM", "H_PWM-L_ON", "H_ON-L_PWM", "PWM-ON", "ON-PWM", "H_PWM-L_PWM in turn")
SECTIONS = "sensor: {v_zero_full_scale_V: 5, v_zero_filter_s: 159.0e-6, v_zero_noise_lsb: 0.5, v_zero_offset_V: 0.02}"
METRICS = ("fault", "angle_error_rms_deg", "torque_ripple_rel", "torque_per_ampere_Nm_A", "loss_W", "efficiency")
FAN, HS = "bldc_fan", "bldc_hs"
SPEEDS = {FAN: (0.3, 0.6), HS: (0.3, 0.6)}
LOADS = (0.1, 0.4)  # of rated torque, beside fan or impeller and friction
TIMES = {FAN: (1.5, 2.0, 2.4), HS: (0.8, 1.2, 1.4)}  # of the load, of the window
WITHIN = 0.1  # of the current: METHODS.md 10.5.2
AREA_SPEEDS = (0.37, 0.47, 0.58)
AREA_SHARES = (0.7, 0.85, 1.0, 1.15)


def drives(machine):
    """Name -> parameters."""
    found = {name: {"pattern": n} for n, name in enumerate(PATTERNS)}
    found["H_PWM-L_ON, diodes"] = {"pattern": 1, "freewheeling": 0}
    if machine == FAN:
        found["H_PWM-L_ON, mean of the terminals"] = {"pattern": 1, "zero_reference": 1}
        found["H_PWM-L_ON, third harmonic"] = {"pattern": 1, "zero_reference": 2}
        found["field orientation"] = {"commutation": 0}
    return found


def run(text):
    """Rows of the runs of a scenario, each metric by its name."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "s.yaml"
        path.write_text(text, encoding="utf-8")
        done = subprocess.run([PMSIM, "run", path, "--quiet", "--out", folder], capture_output=True, text=True, check=False)
        if done.returncode > 1:
            fail(done.stderr)
        path = Path(folder) / "runs.csv"
        if not path.exists():  # a single run
            items = json.loads((Path(folder) / "result.json").read_text(encoding="utf-8"))["expectations"]
            return [{item["metric"]: item["value"] for item in items}]
        head, *rows = csv.reader(path.open(encoding="utf-8"))
    return [dict(zip((name.split("[")[0] for name in head), row)) for row in rows]


def measured(machine, chosen, points):
    """Drive -> point (speed, load) -> metrics, or None where it was lost."""
    found = {}
    load_s, from_s, end_s = TIMES[machine]
    for name in chosen:
        drive = ", ".join(f"{key}: {value}" for key, value in drives(machine)[name].items())
        cases = "\n".join(f"  - {{name: {n}, speed: {speed}, load: {load}}}" for n, (speed, load) in enumerate(points))
        expect = "\n".join(f"  - {{metric: {m}, window_s: [{from_s}, {end_s}], max: 1.0e9, book: \"10.3.1\"}}" for m in METRICS[1:])
        rows = run(f"""title: comparison
machine: {ROOT}/sim_plant/machines/{machine}.yaml
{SECTIONS if machine == FAN else ""}
drive: {{{drive}}}
start: {{theta_e_deg: 60}}
duration_s: {end_s}
cases:
{cases}
profile:
  - {{t_s: 0.0, mode: speed, speed_rel: $speed, enable: true}}
  - {{t_s: {load_s}, load_rel: $load, ramp_s: 0.1}}
expect:
  - {{metric: fault, equals: NONE, book: "10.3.1"}}
{expect}
""")
        found[name] = {}
        for point, row in zip(points, rows):
            values = {m: float(row[m]) for m in METRICS[1:]}
            lost = row["fault"] != "NONE" or not values["angle_error_rms_deg"] < 30
            found[name][point] = None if lost else values
    return found


def cell(values):
    if values is None:
        return "lost"
    return (f"{values['angle_error_rms_deg']:.2f}, {100 * values['torque_ripple_rel']:.0f} %, {1000 * values['torque_per_ampere_Nm_A']:.3g}, "
            f"{values['loss_W']:.2f}, {100 * values['efficiency']:.1f} %")


def points(machine):
    return [(speed, load) for speed in SPEEDS[machine] for load in LOADS]


def title(point):
    return f"{100 * point[0]:.0f} % speed, load {100 * point[1]:.0f} %"


class Area:
    """BLDC-HS, PWM-ON, at an imposed speed: current of the prediction (bldc/freewheeling.h) and runs of the drive."""

    def __init__(self):
        self.machine = yaml.safe_load((ROOT / f"sim_plant/machines/{HS}.yaml").read_text(encoding="utf-8"))
        electrical, inverter = self.machine["electrical"], self.machine["inverter"]
        self.R, self.L, self.psi = (float(electrical[k]) for k in ("R_s_ohm", "L_d0_H", "psi_m_Wb"))
        self.T, self.v_dc = 1 / float(inverter["f_pwm_Hz"]), float(self.machine["rated"]["v_dc_V"])
        self.blank = float(self.machine["drive"]["t_blank"])
        self.rated = float(self.machine["rated"]["speed_rated_rad_s"])

    def current(self, speed):
        """i at which theta_f + w (t_blank + T / 2) is 30 degrees, u that of this current."""
        omega = speed * self.rated
        left, i = math.radians(30) - omega * (self.blank + self.T / 2), 0.0
        for _ in range(60):
            u = (1.654 * self.psi * omega + 2 * self.R * i) / self.v_dc
            x = u * self.v_dc + 1.5 * self.psi * omega
            i = 0.5 * (i + x / (3 * self.R) * math.expm1(left * self.R / (omega * self.L)))
        return i

    def text(self, limit):
        cases = "\n".join(f"  - {{name: {100 * s:.0f} % {share}, speed: {s}, torque: {share * self.current(s) / 15 * 1.1027:.4f}}}"
                          for s in AREA_SPEEDS for share in AREA_SHARES)
        return f"""title: safe area
machine: {ROOT}/sim_plant/machines/{HS}.yaml
sensor: {{i_full_scale_A: 100}}
dclink: {{r_source_ohm: 0.002, c_F: 4.7e-3}}
drive: {{pattern: 3, freewheeling_limit: {limit}, i_max: 80, i_trip: 95, offset_max: 3, resync_tries: 0}}
start: {{theta_e_deg: 60}}
duration_s: 1.7
cases:
{cases}
profile:
  - {{t_s: 0.0, mode: torque, torque_rel: 0.25, enable: true}}
  - {{t_s: 0.9, imposed_speed_rel: $speed, ramp_s: 0.3}}
  - {{t_s: 1.3, torque_rel: $torque, ramp_s: 0.1}}
expect:
  - {{metric: fault, equals: NONE, book: "10.5.2"}}
  - {{metric: current_peak_A, window_s: [1.5, 1.7], max: 1.0e9, book: "10.5.2"}}
  - {{metric: angle_error_max_deg, window_s: [1.5, 1.7], max: 1.0e9, book: "10.5.2"}}
  - {{metric: torque_mean_rel, window_s: [1.5, 1.7], max: 1.0e9, book: "10.5.2"}}
"""


    def runs(self):
        """(speed, asked A, mean A by the torque, largest error or None where it was lost)."""
        found = []
        for (speed, share), row in zip([(s, share) for s in AREA_SPEEDS for share in AREA_SHARES], run(self.text(0))):
            error = float(row["angle_error_max_deg"])
            held = row["fault"] == "NONE" and error < 10
            found.append((speed, share * self.current(speed), error if held else None))
        return found


def plot(area, runs, path):
    figure, axis = plt.subplots(figsize=(7, 4.2))
    speeds = [0.25 + 0.01 * k for k in range(60)]
    line = [area.current(s) for s in speeds]
    axis.plot([100 * s for s in speeds], line, "k-", label="predicted")
    axis.fill_between([100 * s for s in speeds], [(1 - WITHIN) * i for i in line], [(1 + WITHIN) * i for i in line], color="k", alpha=0.12)
    for held, colour, word in ((True, "#4c9f70", "held"), (False, "#c8553d", "lost, or 10 degrees off")):
        part = [r for r in runs if (r[2] is not None) == held]
        axis.plot([100 * r[0] for r in part], [r[1] for r in part], "o", color=colour, label=word)
    axis.set(xlabel="speed, % of rated", ylabel="current of the two legs, A", ylim=(0, None), title="BLDC-HS, PWM-ON")
    axis.grid(True, alpha=0.3)
    axis.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(figure)


HEAD = """# Block commutation

Each pattern of pulses and each way to see the crossings, over speed and load, beside field orientation of the same machine: the whole
drive on the switching plant, from rest, with the dead time, leg capacitance, converter and noise of the machine's file. Made by
`tools/bldc_report`. Sections 10.3 to 10.6 of the book; what is asked of each row: [results](../results.md).
"""

WHICH = """## Which to take

- **`pattern` 1 or 2, one leg chopped**: the default. Least loss of the blocks, one sample a period in the on time.
- **`pattern` 0, H_PWM-L_PWM**: where the crossings are hard to see (short on times at low speed, terminals that ring): on times of half a
  period and more at any speed. It costs ripple: 1.6 times the current's of the others, {both} W for {one} W on BLDC-HS at {p}.
- **PWM-ON and ON-PWM**: both switches of a leg share the losses. ON-PWM freewheels for the shortest angle, PWM-ON for the longest: rank
  by current, from the [safe area](#safe-area).
- **both in turn**: half of the ripple, at twice the frequency; on times are half as long. Not where crossings must be seen at low speed,
  nor where they must be exact: the capacitance of the legs rings with the winding behind each edge, and there are twice as many.
- **third harmonic**: where the star point is led out: no blanking, also through the freewheeling and without pulses.
- **field orientation**: where torque must be smooth or losses low: {more:.0f} % more torque of an ampere of BLDC-FAN and {less:.0f} % of the
  torque ripple at {p}. It needs three currents and an open-loop start that BLDC-HS does not make, but no sample within the
  period: its whole control interrupt takes {vector} instructions on average where that of the blocks takes {block}.
"""


def instructions():
    """Mean of the whole interrupt with field orientation and with blocks, both in `bldc`: docs/performance.md."""
    page = (ROOT / "docs/performance.md").read_text(encoding="utf-8").split("whole control interrupt of `bldc`")[1]
    return [re.search(rf"{what} \| (\d+) ", page)[1] for what in ("active flux, high speed", "H_PWM-L_ON, BLDC-FAN")]


def results_table(machine, results):
    place = points(machine)
    rows = [[name, *(cell(found[p]) for p in place)] for name, found in results.items()]
    return table(["drive", *(title(p) for p in place)], rows)


def page(results, area, runs):
    vector, block = instructions()
    at = (0.6, 0.4)
    fan = results[FAN]
    more = fan["field orientation"][at]["torque_per_ampere_Nm_A"] / fan[PATTERNS[1]][at]["torque_per_ampere_Nm_A"] - 1
    less = fan["field orientation"][at]["torque_ripple_rel"] / fan[PATTERNS[1]][at]["torque_ripple_rel"]
    hs = results[HS]
    text = [HEAD, WHICH.format(both=f"{hs[PATTERNS[0]][at]['loss_W']:.2f}", one=f"{hs[PATTERNS[1]][at]['loss_W']:.2f}", p=title(at),
                               more=100 * more, less=100 * less, vector=vector, block=block)]
    text.append("## Measured\n\nrms of the position error in electrical degrees; rms of the torque's ripple; torque of an ampere of rms phase current, "
                "mNm/A; loss of windings and inverter, W; efficiency. Load in % of rated torque, beside the fan's or impeller's own.\n")
    for machine, name in ((FAN, "BLDC-FAN"), (HS, "BLDC-HS")):
        text += [f"### {name}\n", results_table(machine, results[machine])]
    text.append("""## Safe area

Current of the two legs up to which half of the crossings have a sample ahead of them (book 10.5.2),
theta_f + w (t_blank + T / 2) = 30 degrees, and runs of the drive at an imposed speed without `freewheeling_limit`:

![predicted currents and runs](bldc.png)
""")
    rows = []
    for speed in AREA_SPEEDS:
        part = {i: error for s, i, error in runs if s == speed}
        held = [i for i, error in part.items() if error is not None]
        gone = [i for i, error in part.items() if error is None]
        rows.append([f"{100 * speed:.0f} %", f"{area.current(speed):.1f}", f"{max(held, default=0):.1f}", f"{min(gone):.1f}" if gone else "-"])
    text.append(table(["speed", "predicted, A", "largest that held", "smallest that was lost"], rows))
    text.append("""
Design of the machine (10.6, row 121): the area grows with v_dc and E over L and the speed in electrical radians, and the deviation of a crossing
by an error of the dividers falls with K_w = 1.5 E. Of four designs of BLDC-HS `bldc/safe_area_test.cpp` measures as the formulas say: 33.7 A as it
is, 24.8 with 0.7 of the flux, 21.0 with 1.5 of the inductance, 14.9 with two pole pairs of half the flux; 1.05, 1.52, 1.05 and 1.05 degrees for dividers
1 % off.
""")
    return "\n".join(text)


def differs(shown, now):
    if "lost" in shown or now is None:
        return ("lost" in shown) != (now is None)
    was = [float(word.replace("%", "")) for word in shown.split(",")]
    new = [float(word.replace("%", "")) for word in cell(now).split(",")]
    room = [0.1 + 0.25 * was[0], 2 + 0.15 * was[1], 0.02 * was[2], 0.05 + 0.05 * was[3], 1.0]
    return any(abs(a - b) > x for a, b, x in zip(was, new, room))


def check(path):
    stale = []
    for machine, name, point in ((FAN, PATTERNS[0], (0.6, 0.4)), (FAN, PATTERNS[3], (0.3, 0.1)), (FAN, "field orientation", (0.6, 0.4)),
                                 (HS, PATTERNS[0], (0.6, 0.4))):
        now = measured(machine, [name], [point])[name][point]
        shown = cells(path, "### " + {FAN: "BLDC-FAN", HS: "BLDC-HS"}[machine], title(point)).get(name, "")
        if not shown or differs(shown, now):
            stale.append(f"{path.relative_to(ROOT)}: {name}, {title(point)}: {shown}; now {cell(now)}")
    if stale:
        fail("\n".join(["not up to date:", *stale]))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs/results")
    parser.add_argument("--check", action="store_true", help="write nothing; fail when the page is not up to date")
    options = parser.parse_args()
    if options.check:
        check(options.out / "bldc.md")
        return
    area = Area()
    results = {machine: measured(machine, list(drives(machine)), points(machine)) for machine in (FAN, HS)}
    runs = area.runs()
    plot(area, runs, options.out / "bldc.png")
    (options.out / "bldc.md").write_text(page(results, area, runs), encoding="utf-8")


if __name__ == "__main__":
    main()
