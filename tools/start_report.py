#!/usr/bin/env python3
"""Writes docs/results/start.md: every way to find position and pole of a rotor at rest over the same random machines of a few
classes, what it costs and what it needs; plots beside it.

usage: start_report.py [--machines N] [--only NAME...] [--out DIR] [--scheduler ADDRESS] | --check
--check writes nothing: it runs the machine of the first class again, and fails when the page says something else.
"""
import argparse
import csv
import math
import os
import random
import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import observer_report as common
from campaigns import worker
from campaigns.pool import Pool
from observer_report import PMSIM, ROOT, degrees, fail, plt, table

LIBRARIES = [ROOT / "out/build/stm32g431" / part for part in ("injection/libpm_injection.a", "firmware/drive/libpm_drive.a")]
TOGETHER = 25  # starts of a job
EXACT = 24  # angles of a machine that is told exactly
AUDIBLE_HZ = 200  # from here on; the samples of a period end at f_pwm / 2
GAIN, OTHER = 0.02, 0.1  # gain of each current sensor; R, L_d and psi_m, each for itself; L_q / L_d: `ratio`
SURE = 5  # deviations

# square, sine: v_injection; ratio: by which L_q / L_d is another than told
IPM, SPM = ROOT / "sim_plant/machines/ipm_1000.yaml", ROOT / "sim_plant/machines/spm_400.yaml"
SINES = {0: "v_injection: {square}", 4: "v_injection: {sine}, f_injection: 500, injection_bandwidth: 7, speed_bandwidth: 2"}
CLASSES = {
    "IPM-1000": {"words": "interior magnets, L_q / L_d 1.7", "file": IPM, "drive": "", "square": 70, "sine": 70,
                 "L_d0": 46.3e-3, "L_q0": 76.9e-3, "c": 105, "R": 6.0, "psi": 0.236, "i_link": 6, "ratio": 0.1},
    "SPM-400": {"words": "surface magnets, L_q / L_d 1.1", "file": SPM, "drive": "", "square": 12, "sine": 8,
                "L_d0": 3.385e-3, "L_q0": 3.385e-3, "c": 2.09e5, "R": 0.373, "psi": 0.0776, "i_link": 6, "ratio": 0.02},
    "reluctance": {"words": "IPM-1000 with the L_q of a reluctance machine, L_q / L_d 3.2", "file": IPM,
                   "drive": "L_q: 138e-3, L_q_rated: 100e-3, L_qh_rated: 70e-3, ", "square": 70, "sine": 70,
                   "L_d0": 46.3e-3, "L_q0": 145e-3, "c": 105, "R": 6.0, "psi": 0.236, "i_link": 6, "ratio": 0.1},
    "linear": {"words": "IPM-1000 that does not saturate: its torque alone shows the pole", "file": IPM, "drive": "", "square": 70,
               "sine": 70, "L_d0": 43e-3, "L_q0": 75e-3, "c": 0, "R": 6.0, "psi": 0.236, "i_link": 6, "ratio": 0.1},
}
# name -> (rows of METHODS.md, parameters, carrier, sources whose code it has, state and configuration, knows, has, when to take it)
PULSES = ("pulses", "pulses_config")
LOCK = ("lock",)
METHODS = {
    "six pulses": ("100", "position_pulses: 0", 0, ("initial_pulses", *PULSES), ("initial_pulses_t", "pulses_config_t"),
                   "L_d, L_q, L_d_falls", "three currents", "the default. Angle and pole in a third of the time of what needs a "
                   "lock, with the gains of the sensors found on the way"),
    "four pulses": ("101", "position_pulses: 1", 0, ("four_pulses", *PULSES), ("four_pulses_t", "pulses_config_t"),
                    "L_d, L_q, L_d_falls", "three currents", "where two thirds of the pulses' noise and heat count more than "
                    "a degree: two pulses have no opposite, so that the rotor moves more"),
    "basic pulses": ("99", "position_pulses: 2", 0, ("basic_pulses", "primary", *PULSES), ("basic_pulses_t", "pulses_config_t"),
                     "L_d, L_q, L_d_falls", "one current of each pulse", "where a board shows one current of a pulse only; gains "
                     "of the sensors are its error"),
    "boundary detection": ("102", "position_pulses: 3, boundary_threshold: 0", 0,
                           ("boundary_detection", "boundary_detection_config", "basic_pulses", "primary", *PULSES),
                           ("boundary_detection_t", "boundary_detection_config_t"), "L_d, L_q, L_d_falls", "three currents",
                           "as six pulses, without an arctangent"),
    "DC-link voltage": ("103", "position_pulses: 4, i_pulse: {i_link}", 0,
                        ("dc_link_pulses", "dc_link_pulses_config", "primary", "basic_pulses", *PULSES),
                        ("dc_link_pulses_t", "dc_link_pulses_config_t"), "L_d, L_q, L_d_falls; resistance and capacitance of "
                        "the link", "DC-link voltage, no current", "where no current is seen during a pulse, behind a soft "
                        "supply; longest, and moves the rotor most"),
    "dual pulses": ("93", "position_find: 1, polarity: 1", 0, ("dual_pulses", "dual_pulses_config", "polarity", *LOCK),
                    ("dual_pulses_t", "dual_pulses_config_t"), "L_d, L_q, R, L_d_falls", "three currents, injection 0, 1 or 4",
                    "for the pole when injection has the axis: a wide margin whatever the inverter does"),
    "d-current, square": ("94", "position_find: 1, polarity: 2", 0, ("d_current", "polarity", "polarity_config", *LOCK),
                          ("d_current_t", "polarity_config_t"), "L_d, L_q, L_d_falls; J", "three currents, injection 0",
                          "where pulses are too loud; the rotor must be heavy enough for the loop to hold it"),
    "d-current, sine": ("94", "position_find: 1, polarity: 2", 4, ("d_current", "polarity", "polarity_config", *LOCK),
                        ("d_current_t", "polarity_config_t"), "L_d, L_q, L_d_falls; J", "three currents, injection 4",
                        "as with the square wave, with the noise of the converter averaged"),
    "secondary current": ("96", "position_find: 1, polarity: 3", 4, ("secondary_current", "polarity", "polarity_config", *LOCK),
                          ("secondary_current_t", "polarity_config_t"), "L_d, L_q, L_d_falls", "three currents, injection 4",
                          "where nothing but the carrier may flow: no current of its own, no movement; wants a strong carrier "
                          "of low frequency"),
    "six pulses, torque": ("100", "position_pulses: 0, start_fallback: 1", 0, ("initial_pulses", "torque_polarity", *PULSES),
                           ("initial_pulses_t", "pulses_config_t"), "L_d, L_q, L_d_falls; J", "three currents",
                           "as it comes: where six pulses refuse the pole, which way a torque turns the rotor shows it, also of a "
                           "machine that does not saturate; the rotor must be free to turn"),
    "three-phase HF": ("106, 107; pole 96", "position_find: 2, polarity: 3", 4,
                       ("three_phase_hf", "three_phase_hf_config", "secondary_current", "polarity", "polarity_config"),
                       ("three_phase_hf_t", "three_phase_hf_config_t"), "L_d, L_q, R, L_d_falls", "three currents",
                       "as the secondary current, without a loop that has to lock first; moves nothing"),
}

PROFILE = """profile:
  - {{t_s: 0.0, mode: {}, enable: true}}
"""
EXPECT = [("fault", "equals: NONE"), ("start_refusal", "equals: none"), ("found_angle_error_deg", "max_abs: 360"), ("pulses_angle_error_deg", "max_abs: 360"),
          ("start_margin_sigma", "min: 0"), ("start_s", "max: 9"), ("travel_max_deg_mech", "max: 360"), ("current_peak_A", "max: 1e4")]


def exact(turn):
    return {"theta": 360.0 * turn, "R": 1, "L_d": 1, "L_q": 1, "psi": 1, "ga": GAIN, "gb": 0, "gc": -GAIN}


def drawn(draw, kind):
    """Of one machine: where it stands, by how much it is not what the drive is told, and its sensors."""
    case = {"theta": draw.uniform(0, 360)}
    case |= {key: draw.uniform(1 - OTHER, 1 + OTHER) for key in ("R", "L_d", "psi")}
    case["L_q"] = case["L_d"] * draw.uniform(1 - CLASSES[kind]["ratio"], 1 + CLASSES[kind]["ratio"])
    return case | {key: draw.uniform(-GAIN, GAIN) for key in ("ga", "gb", "gc")}


def scenario(kind, method, cases):
    k, (_, choice, carrier, *_) = CLASSES[kind], METHODS[method]
    rows = []
    for n, x in enumerate(cases):
        values = {"theta": x["theta"], "R": k["R"] * x["R"], "L_d": k["L_d0"] * x["L_d"], "L_q": k["L_q0"] * x["L_q"],
                  "psi": k["psi"] * x["psi"], **{key: x[key] for key in ("ga", "gb", "gc")}}
        rows.append(f"  - {{name: m{n}, " + ", ".join(f"{key}: {value:.7g}" for key, value in values.items()) + "}")
    falls_back = "start_fallback" in choice
    held = "speed, speed_rel: 0" if falls_back else "torque, torque_rel: 0"  # a torque leaves a free rotor turning
    choice += "" if falls_back else ", start_fallback: 0"
    drive = f"start_method: 1, injection: {carrier}, {k['drive']}{choice}, {SINES[carrier]}".format(**k)
    link = "dclink: {r_source_ohm: 1, c_F: 470.0e-6}\n" if method == "DC-link voltage" else ""
    expect = "".join(f"  - {{metric: {metric}, {bound}, book: \"8.1\"}}\n" for metric, bound in EXPECT)
    return (f"title: start\nmachine: {k['file']}\nstart: {{theta_e_deg: $theta}}\nelectrical: {{R_s_ohm: $R, L_d0_H: $L_d, "
            f"L_q0_H: $L_q, psi_m_Wb: $psi, c_A_Wb5: {k['c']}}}\nsensor: {{gain_error: [$ga, $gb, $gc]}}\n{link}"
            f"drive: {{{drive}}}\nduration_s: {1.2 if falls_back else 0.5}\nafter_fault_s: 0\ncases:\n" + "\n".join(rows) + f"\n{PROFILE.format(held)}expect:\n{expect}")


def submit(pool, kind, method, cases):
    return [pool.submit(worker.run_file, str(PMSIM), worker.digest(PMSIM), scenario(kind, method, cases[k:k + TOGETHER]))
            for k in range(0, len(cases), TOGETHER)]


def number(text):
    return float(text) if text not in ("", None) else math.nan


def results(jobs):
    """Per start {metric: value}."""
    found = []
    for done in [job.result() for job in jobs]:
        if done["code"] > 1:
            fail(done["errors"])
        head, *rows = done["rows"]
        columns = {metric: next(k for k, name in enumerate(head) if name.startswith(metric)) for metric, _ in EXPECT}
        for row in rows:
            found.append({metric: row[k] if metric in ("fault", "start_refusal") else number(row[k])
                          for metric, k in columns.items()})
    return found


def submit_carrier(pool, kind, method):
    return pool.submit(worker.run_file, str(PMSIM), worker.digest(PMSIM), scenario(kind, method, [exact(0.11)]), (),
                       ("--decimate", 1))


def sound(done):
    """(rms of the audible current while the start works, its energy, A^2 s)."""
    rows = list(csv.DictReader(done["trace"].splitlines()))
    t, a, b, c = (np.array([float(row[key]) for row in rows]) for key in ("t_s", "ia_A", "ib_A", "ic_A"))
    works = np.array([row["state"] == "finding" for row in rows])
    t, i = t[works], ((2 * a - b - c) / 3 + 1j * (b - c) / math.sqrt(3))[works]
    spectrum = np.fft.fft(i)
    spectrum[np.abs(np.fft.fftfreq(len(i), t[1] - t[0])) < AUDIBLE_HZ] = 0
    rms = float(np.sqrt(np.mean(np.abs(np.fft.ifft(spectrum)) ** 2)))
    return rms, rms ** 2 * (t[-1] - t[0])


def code_bytes():
    """Source file -> bytes on the target."""
    sizes = {}
    for library in LIBRARIES:
        if not library.exists():
            fail(f"{library.relative_to(ROOT)} is missing: build the preset stm32g431")
        out = subprocess.run(["arm-none-eabi-size", library], capture_output=True, text=True, check=True).stdout
        for size, name in re.findall(r"^\s*(\d+)\s.*\s(\w+)\.c\.obj", out, re.MULTILINE):
            sizes[name] = sizes.get(name, 0) + int(size)
    return sizes


def state_bytes():
    """Name -> (state, configuration)."""
    lines = [f'    printf("%zu %zu\\n", sizeof({state}), sizeof({config}));' for *_, (state, config), _, _, _ in METHODS.values()]
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "sizes.c"
        source.write_text("#include <stdio.h>\n#include \"firmware/drive/procedures/procedure.h\"\nint main(void)\n{\n"
                          + "\n".join(lines) + "\n    return 0;\n}\n")
        subprocess.run([os.environ.get("CC", "cc"), f"-I{ROOT}", "-o", f"{folder}/sizes", source], check=True)
        out = subprocess.run([f"{folder}/sizes"], capture_output=True, text=True, check=True).stdout
    return dict(zip(METHODS, [tuple(line.split()) for line in out.splitlines()]))


def kind_of(r):
    """What became of a start."""
    if r["fault"] == "NONE" and not math.isnan(r["found_angle_error_deg"]):
        return "wrong" if abs(r["found_angle_error_deg"]) > 90 else "right"
    return r["start_refusal"] if r["start_refusal"] != "none" else r["fault"]


def of(rs, metric):
    """Of those that were right."""
    return [abs(r[metric]) for r in rs if kind_of(r) == "right" and not math.isnan(r[metric])]


def own(method):
    """The error of what the method itself has found: those with a lock or a torque go on from it, the others are followed by injection."""
    return "found_angle_error_deg" if {"lock", "torque_polarity"} & set(METHODS[method][3]) else "pulses_angle_error_deg"


def cell(rs, metric):
    """mean, largest."""
    values = of(rs, metric)
    return f"{degrees(float(np.mean(values)))}, {degrees(max(values))}" if values else "-"


def outcome(rs):
    kinds = [kind_of(r) for r in rs]
    refused = sorted({kind for kind in kinds if kind not in ("right", "wrong")})
    return [str(kinds.count("right")), str(kinds.count("wrong")),
            ", ".join(f"{kinds.count(kind)} {kind}" for kind in refused) or "0"]


def applies(found):
    """Of all machines that saturate: (all, those whose pole some method finds, refused of these by six pulses, and refused
    by the dual pulses after them, too)."""
    count = some = six = both = 0
    for kind in CLASSES:
        if kind == "linear" or "six pulses" not in found or "dual pulses" not in found:
            continue
        for n, first in enumerate(found["six pulses"][kind]):
            count += 1
            if any(kind_of(rs[kind][n]) == "right" for rs in found.values()):
                some += 1
                six += kind_of(first) != "right"
                both += kind_of(first) != "right" and kind_of(found["dual pulses"][kind][n]) != "right"
    return count, some, six, both


def most(rs, metric, factor=1, digits=3):
    values = of(rs, metric)
    return f"{factor * max(values):.{digits}g}" if values else "-"


def least(rs):
    values = of(rs, "start_margin_sigma")
    return f"{min(values):.3g}" if values else "-"


def plot(found, path):
    kinds = [kind for kind in CLASSES if kind != "linear"]
    figure, axes = plt.subplots(2, len(kinds), figsize=(4.2 * len(kinds), 7))
    for column, kind in enumerate(kinds):
        for n, method in enumerate(found):
            style = {"color": f"C{n}", "label": method}
            for axis, metric in (axes[0][column], own(method)), (axes[1][column], "start_margin_sigma"):
                values = sorted(of(found[method][kind], metric))
                axis.plot(values, [(k + 1) / len(found[method][kind]) for k in range(len(values))], **style)
        axes[0][column].set(title=kind, xlabel="error, deg", xscale="log")
        axes[1][column].set(xlabel="margin, deviations", xscale="log")
        axes[1][column].axvline(SURE, color="k", linewidth=0.8, linestyle="--")
    for axis in axes.flat:
        axis.set(ylim=(0, 1.02))
        axis.grid(True, which="both", alpha=0.3)
    for row in axes:
        row[0].set_ylabel("share of the starts")
    axes[0][0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=100, metadata={"Software": None})
    plt.close(figure)


HEAD = """# Comparison of the ways to start

Every way to find position and pole of a rotor at rest, on the same machines: the switching plant with dead time, leg capacitance,
converter and its noise, and the period of delay, the rotor free. Made by `tools/start_report`. Errors are electrical degrees,
plant minus estimate, of what the method has found, and `with injection` after the 30 ms in which injection settles and makes its own of
the sensors' gains: mean, largest.

"""


def page(found, told, noise, count, plot_name):
    code, state = code_bytes(), state_bytes()
    text = [HEAD + f"{count} random machines of each class: R, L_d and psi_m of the plant within {100 * OTHER:.0f} % of what the "
            f"drive is told, each for itself, and L_q / L_d, of SPM-400 within 2 %; gains of the current sensors within {100 * GAIN:.0f} %, any angle. There is no "
            "fall-back here but that of `six pulses, torque`: what is refused is told with its reason.\n"]
    text.append("## Which to take\n")
    for method, (*_, take) in METHODS.items():
        if method in found:
            right = [r for kind in found[method] if kind != "linear" for r in found[method][kind]]
            text.append(f"- **{method}**: {take}. {sum(kind_of(r) == 'right' for r in right)} of {len(right)} right, "
                        f"{sum(kind_of(r) == 'wrong' for rs in found[method].values() for r in rs)} wrong, "
                        f"mean and largest error {cell(right, own(method))}.")
    count, some, six, both = applies(found)
    text.append(f"\nOf the {count} machines that saturate some method finds the pole of {some}. Of these six pulses refuse {six}; six pulses "
                f"and, where they refuse the pole, dual pulses (`polarity: 1`) {both}.\n")
    text.append(f"## Random machines\n\n![error and margin]({plot_name})\n")
    for kind in CLASSES:
        text.append(f"### {kind}\n\n{CLASSES[kind]['words'][0].upper()}{CLASSES[kind]['words'][1:]}.\n")
        rows = [[method, *outcome(rs), cell(rs, own(method)), cell(rs, "found_angle_error_deg"), least(rs),
                 most(rs, "start_s", 1e3), most(rs, "travel_max_deg_mech"), most(rs, "current_peak_A"), *(f"{x:.2g}" for x in noise[method][kind])]
                for method, rs in ((m, found[m][kind]) for m in found)]
        text.append(table(["method", "right", "wrong", "refused", "error, deg", "with injection, deg", "least margin, sigma", "longest, ms",
                           "movement, deg mech", "peak current, A", "audible current, A rms", "its energy, A^2 s"], rows))
    text.append(f"Time from the end of the sensors' calibration to the running drive, with 30 ms in which injection settles, movement and "
                f"current: of those that found the pole, the largest. Audible: the current from {AUDIBLE_HZ} Hz to half of "
                "f_pwm while the start works, at its samples, of one start; the ripple of the PWM aside.\n")
    text.append(f"## Machines that are told exactly\n\n{EXACT} angles, gains {100 * GAIN:.0f}, 0 and -{100 * GAIN:.0f} %:\n")
    kinds = [kind for kind in CLASSES if kind != "linear"]
    text.append(table(["method", *kinds], [[m, *(cell(told[m][kind], own(m)) for kind in kinds)] for m in told]))
    text.append("## What each needs\n")
    rows = []
    for method, (number_of, _, _, files, _, knows, has, _) in METHODS.items():
        if method in found:
            rows.append([method, number_of, knows, has, str(sum(code.get(name, 0) for name in files)), " + ".join(state[method])])
    text.append(table(["method", "rows of [the book](../book.md)", "needs to know", "needs to have", "bytes of code", "state + configuration"], rows))
    text.append("Code: all that the method needs beside injection, also what it shares with others.\n")
    return "\n".join(text)


def exact_cases():
    return [exact((k + 0.3) / EXACT) for k in range(EXACT)]


def check(path):
    """IPM-1000, told exactly."""
    with Pool() as pool:
        jobs = {method: submit(pool, "IPM-1000", method, exact_cases()) for method in METHODS}
        now = {method: cell(results(job), own(method)) for method, job in jobs.items()}
    shown = common.cells(path, "## Machines that are told exactly", "IPM-1000")
    stale = []
    for method, cell_now in now.items():
        was = shown.get(method, "nothing")
        pairs = list(zip(was.split(", "), cell_now.split(", ")))
        if "nothing" in was or any(a != b and ("-" in (a, b) or abs(float(a) - float(b)) > 0.1 + 0.25 * float(a)) for a, b in pairs):
            stale.append(f"{path.relative_to(ROOT)}: {method}: {was}; now {cell_now}")
    if stale:
        fail("\n".join(["not up to date:", *stale]))


def measure(pool, chosen, count):
    draw = random.Random(18)
    machines = {kind: [drawn(draw, kind) for _ in range(count)] for kind in CLASSES}
    jobs = {method: {kind: (submit(pool, kind, method, machines[kind]), submit(pool, kind, method, exact_cases()),
                            submit_carrier(pool, kind, method)) for kind in CLASSES} for method in chosen}
    found, told, noise = {}, {}, {}
    for method, parts in jobs.items():
        found[method] = {kind: results(part[0]) for kind, part in parts.items()}
        told[method] = {kind: results(part[1]) for kind, part in parts.items()}
        noise[method] = {kind: sound(part[2].result()) for kind, part in parts.items()}
        print(method, flush=True)
    return found, told, noise


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--machines", type=int, default=100, help="of each class")
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--out", type=Path, default=ROOT / "docs/results")
    parser.add_argument("--check", action="store_true", help="write nothing; fail when the page is not up to date")
    options = common.with_scheduler(parser)
    if options.check:
        check(options.out / "start.md")
        return
    chosen = options.only or list(METHODS)
    if unknown := set(chosen) - set(METHODS):
        fail(f"there is no {', '.join(sorted(unknown))}")
    options.out.mkdir(parents=True, exist_ok=True)
    with Pool(options.scheduler) as pool:
        found, told, noise = measure(pool, chosen, options.machines)
    plot(found, options.out / "start.png")
    (options.out / "start.md").write_text(page(found, told, noise, options.machines, "start.png"), encoding="utf-8")


if __name__ == "__main__":
    main()
