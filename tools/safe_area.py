#!/usr/bin/env python3
"""Writes docs/results/safe_area.md: where injection holds, predicted from machine, carrier and bandwidths (tools/pmdrive/pmdrive/
carrier.py; METHODS.md 5.8.2, row 66), and the runs of the campaign tests/campaign/safe_area.yaml drawn on it.

usage: safe_area.py [RESULTS] [--out DIR] [--check]
RESULTS: folder of the campaign, out/campaign/safe_area. --check writes nothing; with and without it the exit code is 1 when a run
inside the predicted current less 15 % is lost, or none beyond it and 15 % is.
"""
import argparse
import math
import sys
from collections import defaultdict
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import pyarrow.parquet as pq  # noqa: E402
import yaml  # noqa: E402

import tune  # noqa: E402

carrier = tune.carrier
ROOT = Path(__file__).resolve().parent.parent
WITHIN = 0.15  # of the current: METHODS.md 5.8.2
LIGHT = 0.15   # of rated current: what the speed control asks for either way on its way to the load
SPEED = 0.05   # of rated, that of the campaign's scenario
LOOPS_HZ = (6, 7, 8.5, 10, 12, 14, 17, 20, 25, 28, 32, 40)


def drive_of(machine):
    """Parameters of the drive in SI, with those that follow from inverter and sensor."""
    d = {name: float(value) for name, value in machine["drive"].items()}
    d["injection"] = int(d["injection"])
    d.update(tune.from_board(machine, machine["drive"], {}))
    d.setdefault("leg_capacitance", 0.0)
    return d


class Everywhere:
    """An answer of two or three periods has no window, and no second loop."""

    def run(self, i_q):
        return True, 0.0, 0.0

    def boundary(self, most, way=1):
        return most


def holds(machine, changes, gain=1.0):
    """carrier.Holds for a machine file of the energy form, by the direction. With the inverter for a carrier that stands, whose axis may
    be one of little current."""
    d = {**drive_of(machine), **changes}
    if d["injection"] not in carrier.NAMES:
        return lambda way: Everywhere()
    omega = SPEED * float(machine["rated"]["speed_rated_rad_s"]) * d["pole_pairs"]
    return lambda way: carrier.Holds(d, lambda a, b: tune.current(machine, a, b)[0], lambda a, b: tune.flux(machine, a, b)[0],
                                     float(machine["electrical"]["R_s_ohm"]), way * omega, gain, d["injection"] == carrier.STATIONARY)


def current_of(machine, torque):
    """i_q of a torque at most torque per ampere."""
    e, low, high = machine["electrical"], 0.0, 4 * float(machine["rated"]["i_rated_A"])
    d = machine["drive"]
    for _ in range(40):
        i_q = 0.5 * (low + high)
        i_d = tune.i_d_for(float(d["psi_m"]), float(d["L_d"]), float(d["L_q"]), i_q)
        psi_d, psi_q = tune.flux(machine, i_d, i_q)[0]
        low, high = (i_q, high) if 1.5 * e["pole_pairs"] * (psi_d * i_q - psi_q * i_d) < torque else (low, i_q)
    return low


def judge(rows):
    """Of each run [(loop, current, way, held, predicted: in, out or near)], by group."""
    found = defaultdict(list)
    for row in rows:
        machine = yaml.safe_load(row["machine"])
        mechanics, rated = machine["mechanics"], machine["rated"]
        friction = float(mechanics.get("T_coulomb_Nm", 0)) + float(mechanics.get("B_Nms", 0)) * SPEED * float(rated["speed_rated_rad_s"])
        i_q = current_of(machine, row["drawn.load"] * float(rated["torque_rated_Nm"]) + friction)
        way = int(row["drawn.direction"])
        run = holds(machine, {})(way)
        either = all(holds(machine, {})(sign).run(sign * LIGHT * float(rated["i_rated_A"]))[0] for sign in (1, -1))
        inside = either and run.run(way * i_q)[0] and run.run(way * i_q * (1 + WITHIN))[0]
        outside = not run.run(way * i_q)[0] and not run.run(way * i_q * (1 - WITHIN))[0]
        place = "in" if inside else "out" if outside else "near"
        found[row["group"]].append((row["drawn.loop_Hz"], i_q, way, row["class"] == "ok", place, machine))
    return found


def lines(runs, most):
    """Predicted boundary over the bandwidth of the loop: {(way, gain): [(Hz, A)]}."""
    machine = runs[0][-1]
    low, high = min(r[0] for r in runs), max(r[0] for r in runs)
    loops = [f for f in LOOPS_HZ if low * 0.9 <= f <= high * 1.1]
    return {(way, gain): [(f, holds(machine, {"injection_bandwidth": f}, gain)(way).boundary(most, way)) for f in loops]
            for way in (1, -1) for gain in (1.0, 2.0)}


def plot(found, drawn, most, path):
    figure, axes = plt.subplots(3, 3, figsize=(15, 11), sharey=True)
    for axis, (group, runs) in zip(axes.flat, found.items()):
        for held, colour, word in ((True, "#4c9f70", "held"), (False, "#c8553d", "lost")):
            for way, mark in ((1, "o"), (-1, "s")):
                part = [r for r in runs if r[3] == held and r[2] == way]
                axis.plot([r[0] for r in part], [r[1] for r in part], mark, color=colour, ms=4, mfc=colour if way > 0 else "none",
                          label=f"{word}, {'forwards' if way > 0 else 'backwards'}")
        for (way, gain), line in drawn[group].items():
            axis.plot(*zip(*line), "k-" if way > 0 else "k--", lw=2 if gain == 1.0 else 0.8,
                      label=f"predicted, {'forwards' if way > 0 else 'backwards'}" + (", 6 dB" if gain > 1 else ""))
        axis.set(title=group, xscale="log", xlabel="bandwidth of the position loop, Hz", ylim=(0, most * 1.02))
        axis.set_xticks([7, 10, 14, 20, 30], ["7", "10", "14", "20", "30"])
        axis.minorticks_off()
        axis.grid(True, alpha=0.3)
    for axis in axes[:, 0]:
        axis.set_ylabel("i_q at most torque per ampere, A")
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="lower center", ncol=8, fontsize=8)
    figure.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(figure)


HEAD = f"""# Safe operation area of injection

Where a low-speed source holds its load (book 5.8.2 and 5.8.4): IPM-1000 at 5 % of speed, free rotor under speed control of
2 Hz, switching plant with dead time, leg capacitance and converter. Made by `tools/safe_area` from the runs of
`tools/campaign run tests/campaign/safe_area.yaml`; lines are predicted by `tools/pmdrive/pmdrive/carrier.py` from machine, carrier and
bandwidths.

![runs on the predicted boundary](safe_area.png)

What ends operation here is not the converter. Noise and quantisation move the position by 0.1 to 0.6 degrees rms, at any load. It is a
second loop: when the frame oscillates at half of f_h, the fundamental current in it does too, the window over a whole period of the carrier
passes 2 / pi of that as an answer, and the position loop turns the frame by it. Its gain goes with i_f / I_n and with the bandwidth over
f_h. A low-pass in the error signal leaves a quarter of it (injection/sine.h); further remedies are a slower loop, more voltage, or a
higher carrier, in this order of their price. A rotating carrier and one that stands see all of the current, a pulsating one only i_d and lambda i_q. Sources that
answer within two or three periods, square waves, INFORM and PWM excitation, have no window: they are predicted to hold everywhere.
"""


def table(head, body):
    out = ["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1)]
    return "\n".join(out + ["| " + " | ".join(map(str, row)) + " |" for row in body]) + "\n"


def page(found, drawn, most):
    text = [HEAD, "## Runs against the prediction\n\n"
            f"Inside: predicted to hold with {100 * WITHIN:.0f} % more current, and {100 * LIGHT:.0f} % of rated current either way, which the speed "
            f"control asks for at the start; outside: predicted to be lost with {100 * WITHIN:.0f} % less.\n"]
    body = []
    for group, runs in found.items():
        part = {place: [r[3] for r in runs if r[4] == place] for place in ("in", "near", "out")}
        body.append([group, *(f"{sum(part[p])} of {len(part[p])}" for p in ("in", "near", "out"))])
    text.append(table(["source", "held inside", "held near the boundary", "held outside"], body))
    text.append("## Predicted largest current\n\ni_q in A, forwards and backwards; in brackets with a margin of 6 dB of the loop's gain.\n")
    loops = [7, 10, 14, 20, 25]
    body = []
    for group, lines_of in drawn.items():
        at = {key: dict(line) for key, line in lines_of.items()}
        cells = []
        for f in loops:
            if f not in at[1, 1.0]:
                cells.append("-")
                continue
            one = [at[way, gain][f] for gain in (1.0, 2.0) for way in (1, -1)]
            word = [f"> {most:.1f}" if x >= most else f"{x:.1f}" for x in one]
            cells.append(f"{word[0]}, {word[1]} ({word[2]}, {word[3]})")
        body.append([group, *cells])
    text.append(table(["source", *(f"{f} Hz" for f in loops)], body))
    return "\n".join(text)


def verdict(found):
    """Lines that say what is not as predicted."""
    wrong = []
    for group, runs in found.items():
        lost = [r for r in runs if r[4] == "in" and not r[3]]
        wrong += [f"{group}: lost inside, {r[0]:.1f} Hz, {r[1]:.2f} A, {'forwards' if r[2] > 0 else 'backwards'}" for r in lost]
        outside = [r[3] for r in runs if r[4] == "out"]
        if outside and all(outside):
            wrong.append(f"{group}: none of {len(outside)} runs outside is lost")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("results", nargs="?", type=Path, default=ROOT / "out/campaign/safe_area")
    parser.add_argument("--out", type=Path, default=ROOT / "docs/results")
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    path = arguments.results / "runs.parquet"
    if not path.is_file():
        parser.error(f"there is no {path}; first: tools/campaign run tests/campaign/safe_area.yaml")
    rows = pq.read_table(path).to_pylist()
    found = judge(sorted((row for row in rows if row["class"] != "refused"), key=lambda row: row["run"]))
    most = 1.25 * max(r[1] for runs in found.values() for r in runs)
    wrong = verdict(found)
    if not arguments.check:
        drawn = {group: lines(runs, most) for group, runs in found.items()}
        plot(found, drawn, most, arguments.out / "safe_area.png")
        (arguments.out / "safe_area.md").write_text(page(found, drawn, most), encoding="utf-8")
    for group, runs in found.items():
        for place in ("in", "near", "out"):
            held = [r[3] for r in runs if r[4] == place]
            print(f"{group}: {place}, {sum(held)} of {len(held)} held")
    print("\n".join(wrong) or "as predicted")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
