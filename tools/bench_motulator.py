#!/usr/bin/env python3
"""Speed of the plant beside motulator: simulated seconds per wall second of a switched drive.

usage: tools/bench_motulator.py [--pmsim FILE] [--seconds S] [--carrier-hz F] [--environment FOLDER]

Both simulate IPM-1000 with saturation under sensorless speed control with PWM on: to half of rated speed, half of
rated load, reversal. Optional: motulator is installed from the Python registry into FOLDER (default: in the
build folder, as the test does); exit code 77 if that is not possible.

Comparable: machine, its flux map, switching instants per second (six edges a carrier period), what is run (control
and plant, and the plant alone on the recorded duties), the machine, one core.
Not comparable:
- Language: C against Python with SciPy. The ratio says how long one waits, not whose algorithm is better.
- In motulator's favour: its legs are ideal, its link is stiff and its sensors exact, while here dead time, drops, link,
  converters with noise and energy integrals are on; its steps have SciPy's default tolerance of 1e-3, those here 1e-6;
  its control has no start-up; its post-processing is not counted.
- In pmsim's favour: motulator's control runs twice a carrier period, pmsim's once; motulator keeps all states of all
  steps.
"""
import argparse
import re
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import python_environment  # noqa: E402


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pmsim", type=Path, default=ROOT / "out/build/host-release/tools/pmsim/pmsim")
    parser.add_argument("--seconds", type=float, default=0.5, help="simulated by motulator (default 0.5)")
    parser.add_argument("--carrier-hz", type=float, default=20000.0, help="PWM frequency (default 20000)")
    parser.add_argument("--environment", type=Path, default=ROOT / "out/build/host-release/motulator")
    return parser.parse_args()


if __name__ == "__main__":
    OPTIONS = arguments()
    if not OPTIONS.pmsim.is_file():
        sys.exit(f"{OPTIONS.pmsim}: not built; cmake --preset host-release && cmake --build --preset host-release")
    python_environment.enter("motulator", OPTIONS.environment)

import motulator.drive.control.sm as control  # noqa: E402
import numpy as np  # noqa: E402
from motulator.drive import model  # noqa: E402
from motulator.drive.utils import SynchronousMachinePars  # noqa: E402

# IPM-1000, METHODS.md section 14
POLE_PAIRS, R_S, L_D0, L_Q0, C, PSI_M = 3, 6.0, 46.3e-3, 76.9e-3, 105.0, 0.236
I_F = PSI_M * (1 / L_D0 + C * PSI_M**4)
RATED_RAD_S, RATED_NM, V_DC, J, B = 104.72, 4.0, 300.0, 0.01, 1e-3


def current(psi):
    saturation = C * abs(psi) ** 4
    return psi.real * (1 / L_D0 + saturation) - I_F + 1j * psi.imag * (1 / L_Q0 + saturation)


class Replay:
    """A recorded control in place of the control: what is left is the time of the plant."""

    def __init__(self, recorded):
        self.recorded = iter(recorded)

    def __call__(self, _):
        return next(self.recorded)


class Recorder:
    def __init__(self, ctrl):
        self.ctrl, self.recorded = ctrl, []

    def __call__(self, mdl):
        self.recorded.append(self.ctrl(mdl))
        return self.recorded[-1]


def drive(seconds):
    estimate = SynchronousMachinePars(n_p=POLE_PAIRS, R_s=R_S, L_d=43e-3, L_q=75e-3, psi_f=PSI_M)
    machine = model.SynchronousMachine(estimate, i_s=current, psi_s0=PSI_M)
    load = lambda t: (t > 0.4 * seconds) * 0.5 * RATED_NM  # noqa: E731
    plant = model.Drive(model.VoltageSourceConverter(u_dc=V_DC), machine,
                        model.StiffMechanicalSystem(J=J, B_L=B, tau_L=load))
    plant.pwm = model.CarrierComparison()
    return plant, estimate


def controller(estimate, seconds, period_s):
    limits = control.CurrentReferenceCfg(estimate, nom_w_m=POLE_PAIRS * RATED_RAD_S, max_i_s=5.0)
    ctrl = control.CurrentVectorControl(estimate, limits, J=J, T_s=period_s, sensorless=True)
    half = 0.5 * POLE_PAIRS * RATED_RAD_S
    ctrl.ref.w_m = lambda t: half if t < 0.6 * seconds else -half
    return ctrl


def wall_s(plant, ctrl, seconds):
    simulation = model.Simulation(plant, ctrl)
    begin = time.perf_counter()
    with np.errstate(invalid="raise"):
        simulation._simulation_loop(seconds, np.inf)  # pylint: disable=protected-access
    return time.perf_counter() - begin


def run_motulator(seconds, carrier_Hz):
    period_s = 0.5 / carrier_Hz  # motulator controls at both ends of the carrier
    plant, estimate = drive(seconds)
    recorder = Recorder(controller(estimate, seconds, period_s))
    whole = wall_s(plant, recorder, seconds)
    speed = abs(plant.mechanics.state.w_M)
    assert 0.0 < speed < 2.0 * RATED_RAD_S, f"motulator's drive is lost, at {speed:.0f} rad/s"
    alone = wall_s(drive(seconds)[0], Replay(recorder.recorded), seconds)
    return seconds / whole, seconds / alone


def run_pmsim(pmsim, carrier_Hz):
    counts = round(85e6 / carrier_Hz)  # of a 170 MHz timer
    result = subprocess.run(
        [pmsim, "bench", ROOT / "tests/scenario/bench.yaml", "--set", f"inverter.f_pwm_Hz={carrier_Hz:g}",
         "--set", f"inverter.timer_counts={counts}"], capture_output=True, text=True, check=False)
    if result.returncode != 0:
        sys.exit(f"pmsim bench failed:\n{result.stderr}")

    def rate(what):
        found = re.search(rf"^{what} +([0-9.]+) simulated", result.stdout, re.MULTILINE)
        if not found:
            sys.exit(f"pmsim bench prints no line '{what}':\n{result.stdout}")
        return float(found.group(1))

    return rate("drive and plant"), rate("plant alone")


def main(options):
    ours = run_pmsim(options.pmsim, options.carrier_hz)
    theirs = run_motulator(options.seconds, options.carrier_hz)
    print(f"IPM-1000, switched at {options.carrier_hz:g} Hz, simulated s per wall s on one core")
    print(f"{'':24s}{'pmsim':>10s}{'motulator':>12s}{'ratio':>10s}")
    for name, our, their in zip(("control and plant", "plant alone"), ours, theirs):
        print(f"{name:24s}{our:10.1f}{their:12.4f}{our / their:10.0f}")
    print("What can be compared and what not: the head of this file.")


if __name__ == "__main__":
    main(OPTIONS)
