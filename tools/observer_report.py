#!/usr/bin/env python3
"""Writes docs/results/observers.md: one set of scenarios over all observers of observers/observers.def, 100 machines
each, what they cost and what they need to know; plots beside it.

usage: observer_report.py [--machines N] [--only NAME...] [--out DIR] [--scheduler ADDRESS] | --check
--check writes nothing: it measures a few cells of the page again, and fails when they are not what stands there.
"""
import argparse
import csv
import json
import math
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

import python_environment  # noqa: E402
from campaigns import worker  # noqa: E402
from campaigns.draw import factors  # noqa: E402
from campaigns.pool import Pool  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
PMSIM = ROOT / "out/build/host-release/tools/pmsim/pmsim"
COST = ROOT / "out/build/stm32g431/tests/target/observers/observers_cost.elf"
# SPM-400 is parametrised as round, whatever its inductances; its open-loop start is against rated load
START = {"IPM-1000": "", "SPM-400": ", start_method: 2, i_open_loop: 4.5"}
MACHINES = {"IPM-1000": "ipm_1000.yaml", "SPM-400": "spm_400.yaml"}
FILES = {**MACHINES, "GMCC KSK89D53U": "gmcc_ksk89d53u.yaml"}  # of studies on others
SPEEDS = [0.05, 0.1, 0.2, 0.5, 1.0]
LOADS = [0, 0.5, 1]
USABLE_DEG = 10  # an observer is usable where its largest error at three loads stays below

TOGETHER = 16  # cases that are run one after the other
SEEN = "fault", "open_loop_s", "angle_error_mean_deg", "angle_error_rms_deg", "angle_error_max_deg"


def fail(reason):
    sys.exit(f"{Path(sys.argv[0]).stem}: {reason}")


def fact(file, key):
    """What the file of a method says of it: keys in the head of firmware/params/parameters.yaml."""
    match = re.search(rf'^{key}: "(.*)"$', (ROOT / file).read_text(), re.MULTILINE)
    return match[1] if match else fail(f"{file} does not say `{key}`")


def knows(name):
    """What must be known of the machine beside its speed range."""
    return fact(f"observers/{name}.yaml", "knows")


def methods(file):
    """Rows (name, help, traits, needs) of a list of methods."""
    return re.findall(r'^PM_METHOD\((\w+), "(.*?)", (.*?), (.*?)\)$', (ROOT / file).read_text(), re.MULTILINE)


def observers():
    return [row[:2] for row in methods("observers/observers.def")]


class Result(NamedTuple):
    """Errors in electrical degrees. lost: a word where the method did not lead the motor, else empty."""

    lost: str
    mean: float
    rms: float
    largest: float

    def __str__(self):
        return self.lost or ", ".join(map(degrees, self[1:]))

    def one(self, figure):
        return self.lost or degrees(getattr(self, figure))


def count_lost(results):
    return sum(r.lost != "" for r in results)


def worst_of(results):
    """The one with the largest error; a lost one before all."""
    return max(results, key=lambda r: (r.lost != "", r.largest))


class Study:
    """Cases that differ in numbers, over one profile; measured from `start_s` to the end. `parameter` chooses the
    method."""

    parameter = "observer"
    theta_e_deg = "40"

    def __init__(self, machine, profile, cases, start_s, end_s, drive="", sections=""):
        self.names = [name for name, _ in cases]
        self.window_s = end_s - start_s
        self.head = [f"title: comparison\nmachine: {ROOT}/sim_plant/machines/{FILES[machine]}"]
        self.head += [sections] if sections else []
        self.head += [f"drive: {{{self.parameter}: 0, {drive}{START.get(machine, '')}}}", f"duration_s: {end_s}",
                      f"start: {{theta_e_deg: {self.theta_e_deg}}}", "cases:"]
        self.tail = ["profile:", profile, "expect:", "  - {metric: fault, equals: NONE, book: \"2.3.3\"}"]
        for metric in SEEN[1:]:
            self.tail.append(f"  - {{metric: {metric}, window_s: [{start_s}, {end_s}], max: 1000, book: \"2.3.3\"}}")
        used = set(re.findall(r"\$(\w+)", "\n".join(self.head + self.tail)))
        self.cases = [f"  - {{name: {json.dumps(name)}, " + ", ".join(f"{k}: {x:.7g}" for k, x in values.items() if k in used) + "}"
                      for name, values in cases]

    def text(self, cases=None):
        return "\n".join([*self.head, *(cases or self.cases), *self.tail]) + "\n"

    def settings(self, method, others):
        return [f"{self.parameter}={method}", *others]

    def submit(self, pool, method, settings=(), only=None):
        """Begins to run it, or those of its cases that are named. settings: name=value."""
        cases = self.cases if only is None else [self.cases[self.names.index(name)] for name in only]
        return [pool.submit(worker.run_file, str(PMSIM), worker.digest(PMSIM), self.text(cases[k:k + TOGETHER]),
                            self.settings(method, settings)) for k in range(0, len(cases), TOGETHER)]

    def result(self, jobs):
        """Of what was begun, a Result per case, or None where the drive refuses the method."""
        found = []
        for done in [job.result() for job in jobs]:
            if f"refuses parameter {self.parameter}" in done["errors"]:
                return None
            if done["code"] > 1:
                fail(done["errors"])
            head, *rows = done["rows"]
            columns = [next(k for k, name in enumerate(head) if name.startswith(metric)) for metric in SEEN]
            for row in rows:
                imposed, *errors = (float(row[k]) for k in columns[1:])
                if row[columns[0]] == "NONE" and imposed > self.window_s / 2:
                    lost = "open loop"
                else:
                    lost = "lost" if row[columns[0]] != "NONE" or not errors[-1] < 60 else ""
                found.append(Result(lost, *errors))
        return found


def cells(path, heading, column):
    """First cell of a row -> its cell in the named column, of the first table of a page behind a line. heading: what is in that line;
    "A / B": the first line with B behind one with A."""
    text = path.read_text(encoding="utf-8")
    for part in heading.split(" / "):
        text = text.split(part, 1)[-1]
    lines = text.splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    start = next(k for k, line in enumerate(lines) if line.startswith("|"))
    place = rows[start].index(column)
    end = next((k for k in range(start, len(lines)) if not lines[k].startswith("|")), len(lines))
    return {row[0]: row[place] for row in rows[start + 2:end]}


class Probe(NamedTuple):
    """A cell of a page, and what is measured for it: the worst of the named cases. figure: of a Result, where the cell shows one
    alone."""

    heading: str
    column: str
    row: str
    study: Study
    method: int
    cases: tuple
    settings: tuple = ()
    figure: str = ""

    def differs(self, shown, result):
        """Is what a page shows another than what is measured now, beyond what a seed of noise makes?"""
        if result.lost or not shown[-1].isdigit():
            return shown != result.lost
        recorded = [float(word) for word in shown.split(",")]
        now = [getattr(result, self.figure)] if self.figure else result[1:]
        room = 0.1 + 0.25 * abs(recorded[-1])
        return len(recorded) != len(now) or any(abs(was - x) > room for was, x in zip(recorded, now))


def check(path, probes):
    """Fails with all cells that are not what is measured now."""
    with Pool() as pool:
        jobs = [(probe, probe.study.submit(pool, probe.method, probe.settings, probe.cases)) for probe in probes]
        found = [(probe, probe.study.result(job)) for probe, job in jobs]
    stale = []
    for probe, results in found:
        if results is None:
            stale.append(f"{path.relative_to(ROOT)}: {probe.row}: the drive refuses it")
            continue
        result = worst_of(results)
        shown = cells(path, probe.heading, probe.column).get(probe.row, "nothing")
        if shown == "nothing" or probe.differs(shown, result):
            now = result.one(probe.figure) if probe.figure else result
            stale.append(f"{path.relative_to(ROOT)}: {probe.row}, {probe.column}: {shown}; now {now}")
    if stale:
        fail("\n".join(["not up to date:", *stale]))


def speed_limits(machine, speed):
    """speed_low, speed_high and loop bandwidths with which an observer leads at this speed: the same for all."""
    rated, low, high, slow = {"IPM-1000": (104.72, 21, 40, (10, 3)), "SPM-400": (41.89, 4.2, 8.4, (15, 4))}[machine]
    loop, control = slow if speed < 0.3 else (25, 5)
    return {"low": min(low, 0.62 * speed * rated), "high": min(high, 0.85 * speed * rated), "loop": loop,
            "control": control}


LIMITS = ("speed_low: $low, speed_high: $high, flux_bandwidth: $loop, speed_bandwidth: $control")


def steady(machine):
    first = "max" if machine == "IPM-1000" else None
    cases = []
    for speed in SPEEDS:
        for load in LOADS:
            start = speed if first else max(speed, 0.25)
            cases.append((f"{speed} {load}", dict(speed=speed, load=load, first=start, **speed_limits(machine, speed))))
    profile = """  - {t_s: 0.0, mode: speed, speed_rel: $first, enable: true}
  - {t_s: 1.4, load_rel: $load, ramp_s: 0.4}
  - {t_s: 2.2, speed_rel: $speed}"""
    drive = LIMITS + (", acceleration: 50" if first else "")
    return Study(machine, profile, cases, 3.5, 4.0, drive)


def half(machine):
    return speed_limits(machine, 0.5)


def both_ways(machine):
    return [(str(turn), {**half(machine), "turn": turn}) for turn in (1, -1)]


def dynamics(machine, kind):
    start = "  - {t_s: 0.0, mode: speed, speed_rel: 0.5*$turn, enable: true}\n"
    profile = {
        "load": start + "  - {t_s: 1.5, load_rel: $turn}\n  - {t_s: 2.2, load_rel: 0}",
        "reversal": start + "  - {t_s: 1.5, speed_rel: -0.5*$turn}",
    }[kind]
    # Without injection the rotor passes zero on an imposed vector, whose angle is no observer's: measured before the hand-over on.
    imposed = kind == "reversal" and machine == "SPM-400"
    return Study(machine, profile, both_ways(machine), 2.2 if imposed else 1.4, 3.5, LIMITS)


def sections(machine):
    dead = {"IPM-1000": 2e-6, "SPM-400": 1e-6}[machine]
    return f"inverter: {{dead_time_s: {dead}*$dead}}\nsensor: {{noise_lsb: $noise}}"


def told(machine):
    """The parameters of the machine, each told wrong by a factor of the case."""
    R, L_d, L_q, L_q_rated, psi = {
        "IPM-1000": (6.0, 43e-3, 75e-3, 70.835e-3, 0.236),
        "SPM-400": (0.383, 3.0e-3, 3.3e-3, 3.2966e-3, 0.0776),
    }[machine]
    return (f"R_s: {R}*$set_R, L_q: {L_q}*$set_L_q, L_q_rated: {L_q_rated}*$set_L_q, L_d: {L_d}*$set_L_d, "
            f"psi_m: {psi}*$set_psi")


def misestimated(machine):
    return f"{LIMITS}, {told(machine)}, dead_time: { {'IPM-1000': 2e-6, 'SPM-400': 1e-6}[machine]}"


def other_machine(machine, change):
    """Parameters of the drive that are wrong by the given factors."""
    values = {**half(machine), "R": 1, "L_d": 1, "L_q": 1, "psi": 1, "dead": 1, "noise": 0.5, **change}
    return {**values, **{f"set_{key}": 1 / values.pop(key) for key in ("R", "L_d", "L_q", "psi")}}


def errors(machine):
    """Half speed, half load, one parameter misestimated at a time."""
    wrong = [("exact", {}), ("R +20 %", {"R": 1.2}), ("R -20 %", {"R": 0.8}), ("L +20 %", {"L_d": 1.2, "L_q": 1.2}),
             ("L -20 %", {"L_d": 0.8, "L_q": 0.8}), ("psi +20 %", {"psi": 1.2}), ("psi -20 %", {"psi": 0.8}),
             ("dead time +20 %", {"dead": 1.2}), ("noise x 2", {"noise": 1})]
    cases = [(name, other_machine(machine, change)) for name, change in wrong]
    profile = """  - {t_s: 0.0, mode: speed, speed_rel: 0.5, enable: true}
  - {t_s: 1.4, load_rel: 0.5, ramp_s: 0.3}"""
    return Study(machine, profile, cases, 2.5, 3.0, misestimated(machine), sections(machine))


def harmonics(machine):
    psi = {"IPM-1000": 0.236, "SPM-400": 0.0776}[machine]
    emf = (f"winding: {{emf: [{{order: 5, psi_Wb: {0.04 / 5 * psi:.6g}, phase_deg: 180}}, "
           f"{{order: 7, psi_Wb: {0.01 / 7 * psi:.6g}}}]}}")
    profile = """  - {t_s: 0.0, mode: speed, speed_rel: 0.5*$turn, enable: true}
  - {t_s: 1.4, load_rel: 0.5*$turn, ramp_s: 0.3}"""
    return Study(machine, profile, both_ways(machine), 2.5, 3.0, LIMITS, emf)


def monte_carlo(machine, count, control, alike=False):
    """Start, half load, run, other direction, stop: R, L_d, L_q, psi and dead time 20 % either way, gain 1 % and
    offset 20 mA of each current channel. The drive refuses L_q below L_d: such pairs are drawn again. alike: one error
    for both inductances."""
    draw = random.Random(7)
    cases = []
    L_d, L_q = {"IPM-1000": (43e-3, 70.835e-3), "SPM-400": (3.0e-3, 3.2966e-3)}[machine]
    for n in range(count):
        any20 = factors(draw, ("R", "L_d", "L_q", "psi", "dead"), 0.2)
        while L_q / any20["L_q"] < L_d / any20["L_d"]:
            any20 |= factors(draw, ("L_d", "L_q"), 0.2)
        if alike:
            any20["L_d"] = any20["L_q"]
        channel = {f"g{x}": draw.uniform(-0.01, 0.01) for x in "abc"} | {f"o{x}": draw.uniform(-0.02, 0.02) for x in "abc"}
        cases.append((f"machine {n}", {**other_machine(machine, {**any20, **channel}), "control": control}))
    profile = """  - {t_s: 0.0, mode: speed, speed_rel: 0.6, enable: true}
  - {t_s: 1.2, load_rel: 0.5, ramp_s: 0.2}
  - {t_s: 1.8, load_rel: 0, ramp_s: 0.2}
  - {t_s: 2.0, speed_rel: -0.6}
  - {t_s: 3.2, enable: false}"""
    extra = sections(machine).replace("noise_lsb: $noise", "noise_lsb: $noise, gain_error: [$ga, $gb, $gc], "
                                      "offset_A: [$oa, $ob, $oc]")
    return Study(machine, profile, cases, 1.0, 2.0, misestimated(machine), extra)


def cost():
    """Name -> (instructions with the loop, bytes of state, of configuration) from the count under QEMU."""
    if not COST.exists():
        fail(f"{COST.relative_to(ROOT)} is missing: build the preset stm32g431")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "count.json"
        run = subprocess.run([sys.executable, ROOT / "tests/target/count.py", COST, "--function", "period_*",
                              "--json", path], capture_output=True, text=True, check=True)
        counted = {name: f["max"] for name, f in json.loads(path.read_text())["functions"].items()}
    sizes = {name: (int(state), int(config))
             for name, state, config in re.findall(r"^(\w+) [0-9a-f ]+ state (\d+) config (\d+)", run.stdout, re.M)}
    return counted, sizes


def degrees(x):
    return "lost" if math.isnan(x) else f"{x:.1f}" if abs(x) >= 0.95 else f"{x:.2f}"


def worst(results):
    result = worst_of(results)
    return math.nan if result.lost else result.largest


def lowest_usable(steady_results):
    usable = None
    for k in reversed(range(len(SPEEDS))):
        part = steady_results[k * len(LOADS):(k + 1) * len(LOADS)]
        if not worst(part) < USABLE_DEG:
            break
        usable = SPEEDS[k]
    return "none" if usable is None else f"{100 * usable:.0f} %"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def plot(machine, results, path):
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.2))
    names = [name for name, _ in observers()]
    for name, r in results.items():
        n = names.index(name)  # the same line in every figure
        style = {"color": f"C{n % 6}", "linestyle": "-" if n < 6 else "--"}
        per_speed = [[r["steady"][k * len(LOADS) + n] for n in range(len(LOADS))] for k in range(len(SPEEDS))]
        axes[0].plot([100 * s for s in SPEEDS], [worst(part) for part in per_speed], marker="o", label=name, ms=4,
                     **style)
        spread = sorted(m.largest for m in r["machines"] if not m.lost)
        axes[1].plot(spread, [(k + 1) / len(r["machines"]) for k in range(len(spread))], label=name, **style)
    axes[0].set(xscale="log", yscale="log", xlabel="speed, % of rated", ylabel="largest error, deg",
                title=f"{machine}: worst of three loads")
    axes[1].set(xscale="log", xlabel="largest error, deg", ylabel="share of the machines", ylim=(0, 1.02),
                title=f"{machine}: {len(next(iter(results.values()))['machines'])} machines")
    for axis in axes:
        axis.grid(True, which="both", alpha=0.3)
    axes[0].set_xticks([100 * s for s in SPEEDS], [f"{100 * s:g}" for s in SPEEDS])
    axes[0].legend(fontsize=7, handlelength=4)
    figure.tight_layout()
    figure.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(figure)


def measure(pool, machine, chosen, ids, count):
    studies = {"steady": steady(machine), "load": dynamics(machine, "load"),
               "reversal": dynamics(machine, "reversal"), "errors": errors(machine),
               "harmonics": harmonics(machine)}
    results, jobs = {}, {}
    one_inductance = [name for name, words in observers() if "(round machines)" in words]
    for name in chosen:
        own = studies | {"machines": monte_carlo(machine, count, 4, name in one_inductance),
                         "quick": monte_carlo(machine, count, 5, name in one_inductance)}
        jobs[name] = [(key, study, study.submit(pool, ids[name])) for key, study in own.items()]
    for name in chosen:
        got = {key: study.result(job) for key, study, job in jobs[name]}
        if None not in got.values():  # the drive accepts it for this machine
            results[name] = got
            print(f"{machine}: {name}", flush=True)
    return results, studies["errors"].names


HEAD = """# Comparison of the observers

One set of scenarios over every observer of `observers/observers.def`, on the switching plant with dead time, converter and its
noise, and the period of delay. Made by `tools/observer_report`; the same loops and limits for all: 25 Hz position loop and 5 Hz
speed control, below 30 % speed 10 and 3 Hz (SPM-400: 15 and 4); the observer alone leads at the speed that is measured. Errors are
electrical degrees.

**The drive's default is `active_flux`.** It runs salient and round machines alike, down to the lowest speed. Its model contains no
speed, which the position loop would feed back, and only `mras_simple` costs less. R is learnt while injection leads, where its drop
outweighs the EMF; an amplitude feedback that follows the load keeps it where R or L_q is told a fifth too high
(docs/decisions/004-resistance.md). An EMF observer has a smaller error in a load step; use it where
the speed stays above 20 %. The Kalman filter of full order is better at low speed and in a load step, at six times the
instructions, but a wrong psi_m moves its angle; the reduced one may slip in an open-loop start if R is underestimated.
"""


def page(all_results, names, plots, counted, sizes, help_of, count):
    text = [HEAD]
    instructions = {name: counted.get(f"period_{name}") for name in help_of}
    rows = []
    for name, words in help_of.items():
        lowest, lost = [], []
        for machine, results in all_results.items():
            r = results.get(name)
            lowest.append("-" if r is None else lowest_usable(r["steady"]))
            lost.append("-" if r is None else f"{count_lost(r['machines'])} ({count_lost(r['quick'])})")
        state, config = sizes.get(name, (0, 0))
        rows.append([f"`{name}`: {words}", str(instructions[name]), f"{state} + {config}", *lowest, *lost, knows(name)])
    text.append(table(["observer", "instructions with the loop", "bytes of state + configuration",
                       *[f"lowest speed, {m}" for m in all_results], *[f"lost of {count}, {m}" for m in all_results],
                       "needs to know"], rows))
    text.append(f"Lowest speed: down to it every load of 0, 50, 100 % stays below {USABLE_DEG} degrees. A dash: not for "
                "this machine.\n")
    for machine, results in all_results.items():
        text.append(f"## {machine}\n\n![{machine}]({plots[machine]})\n")
        text.append("Mean, rms and largest error at rated load:\n")
        at_load = [k * len(LOADS) + len(LOADS) - 1 for k in range(len(SPEEDS))]
        rows = []
        for name, r in results.items():
            rows.append([f"`{name}`", *(str(r["steady"][k]) for k in at_load)])
        text.append(table(["observer", *[f"{100 * s:.0f} %" for s in SPEEDS]], rows))
        text.append("At half speed: largest error of a load step 0 to 100 %, of a reversal, with 4 % of 5th and 1 % of 7th EMF "
                    "harmonic; mean error at half load when the machine differs from the drive's parameters"
                    + ("" if machine == "IPM-1000" else ". The reversal passes zero on the vector of the open loop and is "
                       "measured from 0.15 s before the observer takes over again") + ":\n")
        rows = []
        for name, r in results.items():
            means = [result.one("mean") for result in r["errors"]]
            rows.append([f"`{name}`", degrees(worst(r["load"])), degrees(worst(r["reversal"])),
                         degrees(worst(r["harmonics"])), *means])
        text.append(table(["observer", "load step", "reversal", "harmonics", *names], rows))
    text.append(f"The {count} machines differ from the drive's parameters by up to 20 % in R, L_d, L_q, psi and dead "
                "time, each for itself (L_d and L_q alike for observers that know one L_s), 1 % in the gain and 20 mA in the "
                "offset of each current channel; each starts, runs at 60 % speed with half load, reverses and stops. Lost: a "
                "fault, 60 degrees of error, or open loop for more than half of the time between 1 and 2 s; with the drive's "
                "default of the speed control, 4 Hz, in brackets "
                "with 5 Hz: if L_q is overestimated by 20 %, angle and speed control excite each other.\n")
    return "\n".join(text)


def probe_page(ids, path):
    """Every observer that has a row: rated load at half speed, and half load with inductances told wrong."""
    probes = []
    for machine in MACHINES:
        heading = f"## {machine}"
        for row in cells(path, heading, "50 %"):
            number = ids.get(row.strip("`"), 0)
            probes += [Probe(heading, "50 %", row, steady(machine), number, ("0.5 1",)),
                       Probe(heading + " / At half speed", "L +20 %", row, errors(machine), number, ("L +20 %",), figure="mean")]
    check(path, probes)


def with_scheduler(parser):
    """The options, with that of a cluster, which asks for an environment with Dask."""
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster; default: all cores of this machine")
    options = parser.parse_args()
    if options.scheduler:
        python_environment.enter("campaign", ROOT / "out/python-campaign")
    return options


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--machines", type=int, default=100)
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--out", type=Path, default=ROOT / "docs/results")
    parser.add_argument("--check", action="store_true", help="write nothing; fail when the page is not up to date")
    options = with_scheduler(parser)
    found = observers()
    ids = {name: n for n, (name, _) in enumerate(found)}
    if options.check:
        probe_page(ids, options.out / "observers.md")
        return
    chosen = [name for name, _ in found if not options.only or name in options.only]
    counted, sizes = cost()
    options.out.mkdir(parents=True, exist_ok=True)
    all_results, plots, names = {}, {}, []
    for machine in MACHINES:
        with Pool(options.scheduler) as pool:
            all_results[machine], names = measure(pool, machine, chosen, ids, options.machines)
        plots[machine] = f"observers_{machine.lower()}.png"
        plot(machine, all_results[machine], options.out / plots[machine])
    help_of = {name: words for name, words in found if name in chosen}
    (options.out / "observers.md").write_text(
        page(all_results, names, plots, counted, sizes, help_of, options.machines))


if __name__ == "__main__":
    main()
