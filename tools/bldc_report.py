#!/usr/bin/env python3
"""Writes docs/results/bldc.md: block commutation by every pattern and by what shows its crossings, over speed and load, beside field
orientation of the same machine; and the currents up to which the crossings are seen, predicted and in closed loop (METHODS.md
10.5.2, row 117), a plot beside it.

usage: bldc_report.py [--out DIR] | --check
--check writes nothing: it measures a few cells of the page again, and fails when they are not what stands there.
"""
import argparse
import csv
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
SPEEDS = {FAN: (0.3, 0.6), HS: (0.3, 0.5, 0.7)}
LOADS = (0.1, 0.4)  # of rated torque, beside fan or impeller and friction
START_S, LOAD_S, FROM_S, END_S = 0.0, 1.5, 2.0, 2.4
WITHIN = 0.1  # of the current: METHODS.md 10.5.2
AREA_SPEEDS = (0.37, 0.52, 0.63)
AREA_SHARES = (0.5, 0.7, 0.9, 1.1, 1.3, 1.6)


def drives(machine):
    """Name -> parameters."""
    found = {name: {"pattern": n} for n, name in enumerate(PATTERNS)}
    if machine == FAN:
        found["H_PWM-L_ON, mean of the terminals"] = {"pattern": 1, "zero_reference": 1}
        found["H_PWM-L_ON, third harmonic"] = {"pattern": 1, "zero_reference": 2}
        found["H_PWM-L_ON, diodes"] = {"pattern": 1, "freewheeling": 0}
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
        head, *rows = csv.reader((Path(folder) / "runs.csv").open(encoding="utf-8"))
    return [dict(zip((name.split("[")[0] for name in head), row)) for row in rows]


def measured(machine, chosen, points):
    """Drive -> point (speed, load) -> metrics, or None where it was lost."""
    found = {}
    for name in chosen:
        drive = ", ".join(f"{key}: {value}" for key, value in drives(machine)[name].items())
        cases = "\n".join(f"  - {{name: {n}, speed: {speed}, load: {load}}}" for n, (speed, load) in enumerate(points))
        expect = "\n".join(f"  - {{metric: {m}, window_s: [{FROM_S}, {END_S}], max: 1.0e9, book: \"10.3.1\"}}" for m in METRICS[1:])
        rows = run(f"""title: comparison
machine: {ROOT}/sim_plant/machines/{machine}.yaml
{SECTIONS if machine == FAN else ""}
drive: {{{drive}}}
start: {{theta_e_deg: 60}}
duration_s: {END_S}
cases:
{cases}
profile:
  - {{t_s: {START_S}, mode: speed, speed_rel: $speed, enable: true}}
  - {{t_s: {LOAD_S}, load_rel: $load, ramp_s: 0.1}}
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
duration_s: 1.4
cases:
{cases}
profile:
  - {{t_s: 0.0, mode: torque, torque_rel: 0.25, enable: true}}
  - {{t_s: 0.0, when: running, imposed_speed_rel: $speed, ramp_s: 0.6}}
  - {{t_s: 1.0, torque_rel: $torque, ramp_s: 0.1}}
expect:
  - {{metric: fault, equals: NONE, book: "10.5.2"}}
  - {{metric: current_peak_A, window_s: [1.2, 1.4], max: 1.0e9, book: "10.5.2"}}
  - {{metric: angle_error_max_deg, window_s: [1.2, 1.4], max: 1.0e9, book: "10.5.2"}}
  - {{metric: torque_mean_rel, window_s: [1.2, 1.4], max: 1.0e9, book: "10.5.2"}}
"""


if __name__ == "__main__":
    import sys
    area = Area()
    for limit in (0, 1):
        for row in run(area.text(limit)):
            print(limit, {k: row[k] for k in ("case", "fault", "current_peak_A", "angle_error_max_deg", "torque_mean_rel")})
    for s in AREA_SPEEDS:
        print(s, area.current(s))
