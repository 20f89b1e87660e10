#!/usr/bin/env python3
"""Writes docs/results/injection.md: one set of scenarios over all low-speed position sources of injection/injections.def,
with the settings that the file of each says under `compare`, and what their carriers cost; plots beside it.

usage: injection_report.py [--machines N] [--only NAME...] [--neutral | --currents] [--out DIR] [--scheduler ADDRESS] | --check
--neutral measures again what looks at the star point alone, --currents the rest; the other part of the page stays as it is.
"""
import argparse
import os
import random
import re
import subprocess
import tempfile
from pathlib import Path

import carrier_report
import numpy as np
import observer_report as common
import zero_report
from campaigns.draw import factors
from campaigns.pool import Pool
from observer_report import PMSIM, ROOT, count_lost, degrees, fact, fail, methods, plt, table, worst_of

MACHINE = "IPM-1000"
OTHER = "GMCC KSK89D53U"  # a compressor, with the settings of its file for all sources
LIST = "injection/injections.def"
LOADS = [0, 0.5, 0.75, 1]
ANGLES = [0, 15, 30, 45]
TURNS = [1, -1]
C_LEG = 0.5e-9
NOISE = 0.5  # LSB
SPEED = 0.05
NEUTRAL_MACHINES = 100  # random ones, of each source in the section on the star point
TRAITS = {"SOURCE_HALF_TURN": "poles half a turn apart look alike", "SOURCE_THIRD_TURN": "poles a third of a turn apart "
          "look alike", "SOURCE_EVENTS": "speaks on events only", "SOURCE_ONE_WAY": "carrier turns one way",
          "SOURCE_STATOR": "carrier stands in the stator"}


class Source(common.Study):
    """A study of a source of injections.def, on legs with capacitance unless the sections say otherwise."""

    parameter = "injection"
    theta_e_deg = "$angle"

    def __init__(self, profile, cases, start_s, end_s, drive="", sections="", machine=MACHINE):
        sections = sections or f"inverter: {{c_leg_F: {C_LEG}}}"
        cases = [(name, {"angle": 40, **values}) for name, values in cases]
        super().__init__(machine, profile, cases, start_s, end_s, drive, sections)


def standstill(cases=None, sections=""):
    """The torque is the drive's, the speed the dynamometer's. The error depends on where the rotor stands."""
    cases = cases or [(f"{load} {turn} {angle}", {"load": load * turn, "angle": angle})
                      for load in LOADS for turn in TURNS for angle in ANGLES]
    profile = """  - {t_s: 0.0, mode: torque, torque_rel: 0, imposed_speed_rel: 0, enable: true}
  - {t_s: 0.6, torque_rel: $load, ramp_s: 0.3}"""
    # for as long as it takes: not the protection of the motor is measured
    return Source(profile, cases, 1.5, 2.0, "t_stall: 60, ", sections)


TURNING = f"""  - {{t_s: 0.0, mode: speed, speed_rel: {SPEED}*$turn, enable: true}}
  - {{t_s: 1.5, load_rel: $load, ramp_s: 0.3}}"""


def slow(machine=MACHINE):
    cases = [(f"{load} {turn}", {"load": load * turn, "turn": turn}) for load in LOADS for turn in TURNS]
    return Source(TURNING, cases, 3.0, 4.0, machine=machine)


def both_ways(load=0):
    return [(str(turn), {"turn": turn, "load": load * turn}) for turn in TURNS]


def load_step():
    return Source(TURNING.replace(", ramp_s: 0.3", ""), both_ways(0.5), 1.4, 3.5)


def load_ramp():
    return Source(TURNING, both_ways(0.5), 1.4, 3.5)


def reversal():
    return Source(TURNING + f"\n  - {{t_s: 2.5, speed_rel: -{SPEED}*$turn}}", both_ways(), 2.4, 4.5)


def machines(count):
    """R_s, L_d, L_q and psi_m up to 10 % either way, each for itself; an inductance at rated current as that without."""
    draw = random.Random(7)
    cases = []
    for n in range(count):
        wrong = {f"set_{key}": 1 / x for key, x in factors(draw, ("R", "L_d", "L_q", "psi"), 0.1).items()}
        turn = TURNS[n % 2]
        cases.append((f"machine {n}", {**wrong, "turn": turn, "load": 0.5 * turn}))
    drive = common.told(MACHINE) + ", L_dh_rated: 42.55e-3*$set_L_d, L_qh_rated: 57.32e-3*$set_L_q"
    return Source(TURNING, cases, 1.4, 4.0, drive)


DISTURBED = [("no leg capacitance", {"c_leg": 0}), ("0.5 nF", {}), ("1 nF", {"c_leg": 2 * C_LEG}),
             ("noise 2 LSB", {"noise": 4 * NOISE}), ("dead time told 20 % short", {"dead": 2.5e-6})]


def disturbances():
    """5 % speed, half load, one change of inverter or converter at a time."""
    cases = []
    for name, change in DISTURBED:
        values = {"c_leg": C_LEG, "noise": NOISE, "dead": 2e-6, **change}
        cases += [(f"{name} {turn}", {**values, "turn": turn, "load": 0.5 * turn}) for turn in TURNS]
    sections = "inverter: {c_leg_F: $c_leg, dead_time_s: $dead}\nsensor: {noise_lsb: $noise}"
    return Source(TURNING, cases, 3.0, 4.0, "dead_time: 2e-6", sections)


def defaults():
    """Presets of the parameters and what the machine's file sets."""
    text = subprocess.run([PMSIM, "params"], capture_output=True, text=True, check=True).stdout
    values = {m[1]: float(m[2]) for m in re.finditer(r"^(\w+) +\S+ +-?[\d.e+-]+ +(-?[\d.e+-]+) ", text, re.MULTILINE)}
    machine = (ROOT / "sim_plant/machines" / common.MACHINES[MACHINE]).read_text()
    for name, value in re.findall(r"^  (\w+): +([-\d.e]+)", machine.split("\ndrive:")[1], re.MULTILINE):
        values[name] = float(value)
    return values


def settings(name):
    """What the source is compared with beside the defaults: name -> text."""
    file = f"injection/{name}.yaml"
    if not re.search("^compare:", (ROOT / file).read_text(), re.MULTILINE):
        return {}
    return dict(re.findall(r"(\w+): ([^,]+)", fact(file, "compare")))


def sizes(names):
    """Name -> (bytes of state, of configuration): all members have the same size on the target."""
    lines = [f'    printf("%zu %zu\\n", sizeof({name}_t), sizeof({name}_config_t));' for name in names]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "sizes.c").write_text("#include <stdio.h>\n#include \"injection/methods.h\"\nint main(void)\n{\n"
                                              + "\n".join(lines) + "\n    return 0;\n}\n")
        subprocess.run([os.environ.get("CC", "cc"), f"-I{ROOT}", "-o", f"{folder}/sizes", f"{folder}/sizes.c"],
                       check=True)
        out = subprocess.run([f"{folder}/sizes"], capture_output=True, text=True, check=True).stdout
    return {name: tuple(line.split()) for name, line in zip(names, out.splitlines())}


def needs_in_words(needs):
    """As the board's channels are called in firmware/math/measure.h."""
    text = (ROOT / "firmware/math/measure.h").read_text()
    words = dict(re.findall(r'X\(name, needs, (NEEDS_\w+), "(.*?)"', text))
    return [words.get(need, need) for need in re.findall(r"NEEDS_\w+", needs)]


def by_load(results, per_load):
    """Load -> direction -> worst result."""
    each = per_load // len(TURNS)
    return [[worst_of(results[k * per_load + d * each:k * per_load + (d + 1) * each]) for d in range(len(TURNS))]
            for k in range(len(LOADS))]


def plot(results, path):
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.2), sharey=True)
    loads = [100 * load for load in LOADS]
    for axis, key, per_load in (axes[0], "standstill", len(TURNS) * len(ANGLES)), (axes[1], "slow", len(TURNS)):
        for n, (name, r) in enumerate(results.items()):
            parts = [worst_of(part) for part in by_load(r[key], per_load)]
            axis.plot(loads, [np.nan if p.lost else p.largest for p in parts], f"C{n}o-", ms=4)
            axis.plot(loads, [np.nan if p.lost else abs(p.mean) for p in parts], f"C{n}s--", ms=3)
        axis.set(xlabel="load, % of rated", xticks=loads)
        axis.grid(True, alpha=0.3)
    axes[0].set(ylabel="error, deg", title=f"{MACHINE}: standstill, worst of directions and angles", ylim=(0, None))
    axes[1].set_title(f"{MACHINE}: {100 * SPEED:.0f} % speed, worst of directions")
    names = [plt.Line2D([], [], color=f"C{n}", label=name) for n, name in enumerate(results)]
    kinds = [plt.Line2D([], [], color="k", marker="o", ms=4, label="largest"),
             plt.Line2D([], [], color="k", marker="s", ms=3, ls="--", label="|mean|")]
    figure.tight_layout(rect=(0, 0, 0.84, 1))
    figure.legend(handles=names + kinds, loc="center right", fontsize=8)
    figure.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(figure)


def place_in_list():
    """What the parameter `injection` is for each source."""
    return {row[0]: n for n, row in enumerate(methods(LIST))}


def measure(pool, rows, chosen, count):
    studies = {"standstill": standstill(), "slow": slow(), "step": load_step(), "ramp": load_ramp(),
               "reversal": reversal(), "machines": machines(count), "disturbed": disturbances(), "other": slow(OTHER)}
    rest = standstill([("trace", {"load": 0})])
    results, jobs = {}, {}
    number = place_in_list()
    for name, *_ in rows:
        n = number[name]
        if name in chosen:
            own = [f"{key}={value}" for key, value in settings(name).items()]
            jobs[name] = {key: study.submit(pool, n, () if key == "other" else own) for key, study in studies.items()}
            jobs[name]["carrier"] = carrier_report.submit(pool, rest, n, own)
    for name, parts in jobs.items():
        results[name] = {}
        for key, job in parts.items():
            results[name][key] = carrier_report.result(job) if key == "carrier" else studies[key].result(job)
            if results[name][key] is None:
                fail(f"the drive refuses {name}: {key}")
            print(f"{name}: {key}", flush=True)
    return results


HEAD = f"""# Comparison of the low-speed position sources

One set of scenarios over every source of `injection/injections.def`, on {MACHINE}: the switching plant with dead time, 0.5 nF at
each leg, converter and its noise, and the period of delay. Made by `tools/injection_report`. Each source has the settings that its
file says under `compare`, beside them the defaults: the loops are part of what a source can do, and are not the same. Errors are
electrical degrees, plant minus estimate: mean, rms, largest.
"""


def disturbed(r):
    parts = [worst_of(r["disturbed"][k:k + len(TURNS)]) for k in range(0, len(r["disturbed"]), len(TURNS))]
    return dict(zip([name for name, _ in DISTURBED], parts))


def which(results):
    """The words of each source's file, with the figures of this page."""
    lines = ["## Which to take\n"]
    for name, r in results.items():
        step, reverse = (worst_of(r[key]).one("largest") for key in ("step", "reversal"))
        d = disturbed(r)
        none, double, usual, noisy = (d[key] for key in ("no leg capacitance", "1 nF", "0.5 nF", "noise 2 LSB"))
        lost = count_lost(r["machines"])
        lines.append(f"- **`{name}`**: {fact(f'injection/{name}.yaml', 'take')}. Measured: load step {step}, reversal {reverse}; "
                     f"leg capacitance of 0, 0.5 and 1 nF: mean {', '.join(x.one('mean') for x in (none, usual, double))}; "
                     f"noise of 0.5 and 2 LSB: rms {', '.join(x.one('rms') for x in (usual, noisy))}; "
                     f"{lost} of {len(r['machines'])} machines lost.")
    return "\n".join(lines) + "\n"


def seen(results):
    """Of the sources whose carrier is there at the sample instants."""
    within = {row[0] for row in methods(LIST) if "NEEDS_HALVES" in row[3]}
    return {name: r["carrier"] for name, r in results.items() if name not in within}


def costs(results, spectra_name, values, counted):
    """What the carrier takes and how it sounds."""
    rated_W = 1.5 * values["R_s"] * values["i_rated"] ** 2
    carriers = seen(results)
    body = []
    for name in results:
        figures = ["between the samples", "", "", ""]
        if name in carriers:
            c = carriers[name]
            loss_W = carrier_report.loss_W(c, values["R_s"])
            loudest_Hz = c.lines_Hz[(c.lines_A * carrier_report.heard(c.lines_Hz)).argmax()]
            figures = [f"{1e3 * c.rms_A:.0f} mA", f"{1e3 * loss_W:.0f} mW, {100 * loss_W / rated_W:.2f} %",
                       f"{1e3 * c.heard_A:.0f} mA", f"{loudest_Hz:.0f} Hz"]
        image, mean, worst = counted.get(name, ("", 0, 0))
        body.append([f"`{name}`", *figures, f"{mean:.0f}, {worst:.0f}, `{image}`" if image else "-"])
    head = ["source", "current, rms", "loss, of that at rated current", "heard as", "loudest line", "instructions: mean, worst, image"]
    return "\n".join([
        f"## Loss, sound and processor\n\n![Spectra of the carriers' currents]({spectra_name})\n", table(head, body),
        "Current of the carrier at the sample instants, at standstill without load, its copper loss beside the "
        f"{rated_W:.0f} W of rated current (iron loss is not in the plant), and the same current with each line weighted as the ear has "
        "it (A, dotted; 1 at 1 kHz): force on the teeth goes with the current, so this ranks sources on one machine; what is radiated, "
        "its frame decides. Instructions of the whole control interrupt on the board at 20 kHz while injection leads "
        "(`tests/scenario/board/sources.yaml`); `-`: the board's port has not the channel.\n"])


def page(rows, results, plot_name, spectra_name, values, bytes_of, counted):
    text = [HEAD, which(results)]
    body = []
    for name, words, traits, needs in rows:
        if name not in results:
            continue
        own = {**values, **settings(name)}
        frequency = results[name]["carrier"].frequency_Hz
        channels = ["currents, DC-link voltage", *needs_in_words(needs)]
        body.append([f"`{name}`: {words}", f"{frequency:.0f} Hz, {float(own['v_injection']):.0f} V",
                     f"{float(own['injection_bandwidth']):g} Hz", f"{float(own['speed_bandwidth']):g} Hz",
                     "; ".join(TRAITS.get(x, x) for x in re.findall(r"SOURCE_\w+", traits)) or "-",
                     "; ".join(channels), fact(f"injection/{name}.yaml", "knows"), " + ".join(bytes_of[name])])
    text.append("## Properties\n")
    text.append(table(["source", "carrier", "position loop", "speed control", "traits", "measures with",
                       "needs to know", "bytes of state + configuration"], body))
    text.append(costs(results, spectra_name, values, counted))
    text.append(f"## Error over load\n\n![{MACHINE}]({plot_name})\n")
    heads = [f"{100 * load:.0f} %" for load in LOADS]
    for key, per_load, title in (
            ("standstill", len(TURNS) * len(ANGLES), "Standstill, held by a dynamometer; load is the drive's torque, and of the "
             f"angles {', '.join(map(str, ANGLES))} degrees the worst counts:"),
            ("slow", len(TURNS), f"{100 * SPEED:.0f} % speed, free rotor under speed control, load against the rotation:")):
        body = []
        for name, r in results.items():
            loads = by_load(r[key], per_load)
            body += [[f"`{name}`, {'forwards' if turn > 0 else 'backwards'}", *(str(part[d]) for part in loads)]
                     for d, turn in enumerate(TURNS)]
        text += [title + "\n", table(["source", *heads], body)]
    text.append(f"{OTHER}, {100 * SPEED:.0f} % speed likewise: a compressor with the settings of its file for all sources, carriers of 30 V, "
                "loops of 25 Hz and speed control of 8 Hz, since its rotor of 0.18 g m2 cannot be held by slower ones:\n")
    body = []
    for name, r in results.items():
        loads = by_load(r["other"], len(TURNS))
        body += [[f"`{name}`, {'forwards' if turn > 0 else 'backwards'}", *(str(part[d]) for part in loads)]
                 for d, turn in enumerate(TURNS)]
    text.append(table(["source", *heads], body))
    text.append(f"## Dynamics and wrong parameters\n\nAt {100 * SPEED:.0f} % speed, largest error of both directions: load 0 to 50 % as a "
                f"step and within 0.3 s, reversal without load. Machines: R_s, L_d, L_q and psi_m told wrong by up to 10 %, each for "
                "itself, half load within 0.3 s, directions in turn. Lost: a fault, or 60 degrees of error. Open loop: what "
                "is measured says that the source would err too much, and the drive imposes the current vector instead.\n")
    body = []
    for name, r in results.items():
        kept = [m for m in r["machines"] if not m.lost]
        body.append([f"`{name}`", *(worst_of(r[key]).one("largest") for key in ("step", "ramp", "reversal")),
                     f"{len(r['machines']) - len(kept)} of {len(r['machines'])}",
                     degrees(max((m.mean for m in kept), key=abs)) if kept else "-",
                     degrees(max(m.largest for m in kept)) if kept else "-"])
    text.append(table(["source", "load step", "load within 0.3 s", "reversal", "machines lost", "their largest mean error",
                       "their largest error"], body))
    text.append(f"## Inverter and converter\n\n{100 * SPEED:.0f} % speed, half load, worst direction, one change at a time:\n")
    text.append(table(["source", *(name for name, _ in DISTURBED)],
                      [[f"`{name}`", *map(str, disturbed(r).values())] for name, r in results.items()]))
    return "\n".join(text)


def probe_page(names, path):
    """Every source: rated load at standstill, half load at slow speed, a step of the load, noise; and the section on the neutral."""
    number = place_in_list()
    probes = []
    for name in names:
        own = [f"{key}={value}" for key, value in settings(name).items()]
        probes += [common.Probe(heading, column, f"`{name}`" + way, study, number[name], cases, own, figure)
                   for heading, column, way, study, cases, figure in (
                       ("Standstill, held", "100 %", ", forwards", standstill(), [f"1 1 {angle}" for angle in ANGLES], ""),
                       ("free rotor under speed control", "50 %", ", forwards", slow(), ["0.5 1"], ""),
                       ("## Dynamics", "load step", "", load_step(), ["1", "-1"], "largest"),
                       ("## Inverter and converter", "noise 2 LSB", "", disturbances(), ["noise 2 LSB 1", "noise 2 LSB -1"], ""))]
    common.check(path, probes + zero_report.probes())


def measure_currents(pool, options, rows, chosen):
    """Text of the page up to the section on the neutral; writes the plots."""
    results = measure(pool, rows, chosen, options.machines)
    plot_name, spectra_name = (f"injection_{what}{MACHINE.lower()}.png" for what in ("", "spectra_"))
    plot(results, options.out / plot_name)
    carrier_report.plot(seen(results), f"{MACHINE}: carriers at standstill without load", options.out / spectra_name)
    return page(rows, results, plot_name, spectra_name, defaults(), sizes([row[0] for row in rows]), carrier_report.instructions(results))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--machines", type=int, default=100)
    parser.add_argument("--only", nargs="*")
    part = parser.add_mutually_exclusive_group()
    part.add_argument("--neutral", action="store_true", help="only the section on the voltage at the neutral")
    part.add_argument("--currents", action="store_true", help="all but that section")
    parser.add_argument("--out", type=Path, default=ROOT / "docs/results")
    parser.add_argument("--check", action="store_true", help="write nothing; fail when the page is not up to date")
    options = common.with_scheduler(parser)
    # MACHINE does not lead its star point out; a carrier in the reference of the current needs another regulator than the others
    rows = [row for row in methods(LIST) if "NEEDS_NEUTRAL" not in row[3] and "SOURCE_IN_REFERENCE" not in row[2]]
    names = [row[0] for row in rows]
    chosen = options.only or names
    if options.check:
        probe_page(names, options.out / "injection.md")
        return
    if unknown := set(chosen) - set(names):
        fail(f"{LIST} has no {', '.join(sorted(unknown))}")
    if options.machines < 1:
        fail("--machines is 1 or more")
    options.out.mkdir(parents=True, exist_ok=True)
    file = options.out / "injection.md"
    kept = (ROOT / "docs/results/injection.md").read_text(encoding="utf-8").split(zero_report.HEADING)
    currents, neutral = kept[0], zero_report.HEADING + kept[-1]
    with Pool(options.scheduler) as pool:
        if not options.neutral:
            currents = measure_currents(pool, options, rows, chosen)
        if not options.currents:
            neutral = zero_report.section(zero_report.measure(pool, NEUTRAL_MACHINES), NEUTRAL_MACHINES)
    file.write_text(currents.rstrip() + "\n\n" + neutral)


if __name__ == "__main__":
    main()
