"""From a motor that nobody knows to one that runs: scan, name plate, identify, tune, save, restart, start, stop, on live
nodes with the whole plant; then the steady state of what was found, against the plant's truth.

usage: identify_test.py PMSIM [--image ELF] [MACHINE...]

The drive is `pmsim node`, with --image the flashed image on the emulated board, live; then without the steady state.
"""
import argparse
import contextlib
import io
import json
import re
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "support"), str(ROOT / "tools" / "pmdrive")]
import pmdrive  # noqa: E402
from node_bus import Node  # noqa: E402
from pmdrive import cli, names  # noqa: E402

# The bounds
R_REL, L_REL, PSI_REL = 0.05, 0.07, 0.03
J_REL = 0.15
SPEED_REL = 0.03  # of the speed that is asked for, while it runs
# Name plate: A peak, pole pairs, rad/s, V. Truth: R with a switch, L_d, L_q at zero current, psi, J. The carrier can lead
# at standstill where there is saliency; without, the flux observer takes over above 8 % of the speed.
MACHINES = {
    "ipm_1000": dict(plate=(4.0, 3, 150, 300), truth=(6.0, 43.0e-3, 75.0e-3, 0.236, 0.01), salient=True),
    "gmcc_ksk89d53u": dict(plate=(6.0, 3, 480, 310), truth=(1.175, 7.6e-3, 10.9e-3, 86.19e-3, 1.8e-4), salient=True),
    "tmotor_u8ii_kv100": dict(plate=(16.0, 21, 190, 24), truth=(0.0682, 12e-6, 12e-6, 2.382e-3, 1.9e-4), salient=False),
    "grin_all_axle": dict(plate=(30.0, 23, 50, 52), truth=(0.053, 0.13e-3, 0.13e-3, 19.83e-3, 0.08), salient=False),
}
# Speeds and loads of the steady state. What no method can show of a round machine at low speed is left out: docs/identify.md.
SALIENT = (([0, 0.02, 0.05, 0.1, 0.3, 1], [0, 0.5, 1]),)
ROUND = (([0.08, 0.1, 0.3, 1], [0, 0.5, 1]), ([0.05], [0, 0.5]), ([0], [0]))
# What the drive was used for before: another motor, on the same board.
OTHER = {"pole_pairs": 5, "mtpa": 1, "dead_time_comp": 1, "t_align": 0.1, "flux_bandwidth": 20, "flux_gain": 0.3,
         "speed_bandwidth": 3, "injection_bandwidth": 25, "current_bandwidth": 300}
WRONG = (  # times the truth
    {"R_s": 3.0, "L_d": 0.3, "L_q": 0.35, "psi_m": 0.4, "J": 3.0, "L_q_rated": 0.33, "L_dh_rated": 0.29, "L_qh_rated": 0.3},
    {"R_s": 0.4, "L_d": 2.5, "L_q": 3.0, "psi_m": 2.0, "J": 0.3, "L_q_rated": 2.9, "L_dh_rated": 2.5, "L_qh_rated": 2.8},
)

NODE = """\
title: A motor that nobody knows
machine: {machine}
start: {{theta_e_deg: random}}
seed: {seed}
duration_s: 0.1
sensor: {{offset_A: [{offset}, 0, -{offset}], gain_error: [0.005, -0.005, 0]}}
drive: {drive}
profile:
  - {{t_s: 0, load_rel: 0}}
expect:
  - {{metric: fault, equals: NONE, book: "5.9"}}
"""
GRID = """\
title: Steady state of an identified machine
machine: {machine}
start: {{theta_e_deg: 0}}
duration_s: 4.5
drive: {drive}
sweep: {{speed: {speeds}, load: {loads}}}
profile:
  - {{t_s: 0, mode: speed, speed_rel: $speed, enable: true}}
  - {{t_s: 2.5, load_rel: $load, ramp_s: 0.2}}
expect:
  - {{metric: fault, equals: NONE, book: "5.9"}}
  - {{metric: angle_error_mean_deg, window_s: [4.0, 4.5], max_abs: 2, book: "5.2.2.2"}}
  - {{metric: angle_error_max_deg, window_s: [4.0, 4.5], max: 6, book: "5.2.2.2"}}
  - {{metric: speed_error_max_rel, window_s: [4.0, 4.5], max: 0.03, book: "1.3.2.2"}}
"""


def free_port():
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return probe.getsockname()[1]


def yaml_map(values):
    return "{" + ", ".join(f"{name}: {value!r}" for name, value in values.items()) + "}"


class Bench:
    """A live node and the command line on its bus."""

    def __init__(self, pmsim, image, scenario):
        self.spec = f"socketcand:localhost:{free_port()}"
        self.node = Node(pmsim, self.spec, scenario=scenario, image=image)

    def command(self, *words, code=0):
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            got = cli.main(["--can", self.spec, *words])
        assert got == code, f"{words}: {got}\n{out.getvalue()}{err.getvalue()}\n{self.node.text()}"
        return out.getvalue()

    def answers(self, *words):
        return [json.loads(line) for line in self.command("--json", *words).splitlines()]

    def answer(self, *words):
        return self.answers(*words)[-1]

    def parameters(self):
        with pmdrive.connect(self.spec) as drive:
            return {e.name: float(e.physical(raw)) for e, raw in drive.dump(
                [e for e in names.stored() if e.record in names.DRIVE_RECORDS]).items()}


def board_ratios(name):
    """Voltages and currents of the emulated board over those of a machine's sensors: sim_plant/board/board.h."""
    text = (ROOT / f"sim_plant/machines/{name}.yaml").read_text(encoding="utf-8")
    v, i = (float(re.search(rf"{key}: ([0-9.]+)", text)[1]) for key in ("v_full_scale_V", "i_full_scale_A"))
    return 3.3 * 187 / 18 / v, 1.65 / (3e-3 * 64 / 7) / i


def within(name, found, truth, bound):
    error = found / truth - 1
    assert abs(error) <= bound, f"{name}: {found:g}, {100 * error:+.1f} % off"
    return f"{name} {100 * error:+.2f} %"


def check_results(values, truth):
    R, L_d, L_q, psi, J = truth
    told = [within("R", values["R_s"], R, R_REL), within("L_d", values["L_d"], L_d, L_REL),
            within("L_q", values["L_q"], L_q, L_REL), within("psi", values["psi_m"], psi, PSI_REL),
            within("J", values["J"], J, J_REL)]
    print("      " + ", ".join(told), flush=True)


def run_live(pmsim, image, name, folder):
    """Its parameters after identification and tuning."""
    machine = MACHINES[name]
    current, pole_pairs, speed, dc_link = machine["plate"]
    offset = 0.005 * current
    R, L_d, L_q, psi, J = machine["truth"]
    true = {"R_s": R, "L_d": L_d, "L_q": L_q, "psi_m": psi, "J": J, "L_q_rated": L_q, "L_dh_rated": L_d,
            "L_qh_rated": L_q}
    factors = WRONG[0 if machine["salient"] else 1]
    wrong = {**OTHER, **{key: factor * true[key] for key, factor in factors.items()}, "L_dqh_rated": 0, "cross_half": 0}
    path = Path(folder) / f"{name}.yaml"
    path.write_text(NODE.format(machine=ROOT / f"sim_plant/machines/{name}.yaml", seed=len(name),
                                offset=offset, drive=yaml_map(wrong)), encoding="utf-8")
    truth = machine["truth"]
    if image:  # `pmsim board --similar` winds the machine for the board
        v, i = board_ratios(name)
        current, dc_link = current * i, dc_link * v
        truth = (R * v / i, L_d * v / i, L_q * v / i, psi * v, J * v * i)
    bench = Bench(pmsim, image, path)
    try:
        assert bench.answer("scan") == {"nodes": [1]}
        bench.command("identify", "--yes", "--rated-current", f"{current}A", "--pole-pairs", str(pole_pairs),
                      "--max-speed", f"{speed}rad/s", "--dc-link", f"{dc_link}V")
        check_results(bench.parameters(), truth)
        bench.command("tune", "--yes")
        found = bench.parameters()
        bench.command("save")
        bench.command("reset")
        assert bench.parameters() == found, "what was saved is not what is there after the restart"
        check_start(bench, 0.3 * speed)
    finally:
        code = bench.node.stop()
    assert code == 0, f"exit code {code}\n{bench.node.text()}"
    return found


def check_start(bench, speed):
    """To that speed without a sensor, and off again; no fault."""
    seen = bench.answers("run", "speed", f"{speed}rad/s", "--for", "4")
    reached = seen[-1]["velocity_actual"]["value"]
    within("speed", reached, speed, SPEED_REL)
    assert bench.answer("stop")["state"] == "switch on disabled"
    faults = bench.answer("faults")
    assert faults["fault"] is None and not faults["history"], faults


def check_steady(pmsim, name, found, folder):
    board = ("f_pwm", "timer_counts")
    drive = {key: value for key, value in found.items() if key not in board}
    path = Path(folder) / f"{name}_grid.yaml"
    for speeds, loads in SALIENT if MACHINES[name]["salient"] else ROUND:
        path.write_text(GRID.format(machine=ROOT / f"sim_plant/machines/{name}.yaml", drive=yaml_map(drive),
                                    speeds=speeds, loads=loads), encoding="utf-8")
        result = subprocess.run([pmsim, "run", str(path), "--out", str(Path(folder) / name)], capture_output=True,
                                text=True, check=False, timeout=300)
        told = [f"      {line}" for line in result.stdout.splitlines() if line[:4] in ("PASS", "FAIL")]
        print(f"      speeds {speeds}, loads {loads}", *told, sep="\n", flush=True)
        assert result.returncode == 0, result.stdout + result.stderr


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pmsim")
    parser.add_argument("machines", nargs="*", default=list(MACHINES))
    parser.add_argument("--image", help="pmdrive.elf of the cross build")
    arguments = parser.parse_intermixed_args()
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.machines:
            began = time.monotonic()
            print(f"      {name}", flush=True)
            found = run_live(arguments.pmsim, arguments.image, name, folder)
            if arguments.image is None:  # what has been found is the same
                check_steady(arguments.pmsim, name, found, folder)
            print(f"PASS  {name}, {time.monotonic() - began:.1f} s", flush=True)


main()
