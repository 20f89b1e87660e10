#!/usr/bin/python3
"""Plots a run of pmsim: speed, position error, currents, torque and link voltage over one time axis.

    pmsim run tests/scenario/demo.yaml --out out/demo
    tools/plot_run.py out/demo
"""

import argparse
import csv
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.patches import Patch  # noqa: E402

# Okabe and Ito: distinguishable with every kind of colour blindness.
BLUE, ORANGE, GREEN, RED, SKY, PURPLE, GREY = (
    "#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7", "#666666",
)
DPI_MOST = 1200
RAD_S_TO_RPM = 60.0 / (2.0 * 3.141592653589793)
WORDS = ("state", "fault")
NEEDED = (
    "t_s", "state", "fault", "v_dc_V", "omega_ref_mech_rad_s", "omega_mech_rad_s", "omega_hat_mech_rad_s", "angle_error_deg",
    "weight", "ia_A", "ib_A", "ic_A", "iq_A", "id_A", "torque_Nm",
)
WITH_POSITION = ("running", "stopping")
STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "legend.fontsize": 8,
    "legend.frameon": True,
    "legend.framealpha": 0.85,
    "legend.edgecolor": "none",
    "lines.linewidth": 1.2,
}


def fail(reason):
    print(f"plot_run.py: {reason}", file=sys.stderr)
    sys.exit(2)


def read_trace(path):
    """Columns by name; numbers as floats."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            columns = {name: [] for name in reader.fieldnames or []}
            missing = [name for name in NEEDED if name not in columns]
            if missing:
                fail(f"{path} is no trace of pmsim: it has no {missing[0]}")
            for row in reader:
                for name, text in row.items():
                    columns[name].append(text if name in WORDS else float(text))
    except (KeyError, TypeError, ValueError, csv.Error):  # rows of another length, words in place of numbers
        fail(f"{path}:{reader.line_num}: not a row of a trace of pmsim")
    if not columns["t_s"]:
        fail(f"{path}: no data")
    return columns


def spans(t, flags):
    """Intervals of time in which the flag is set."""
    start = None
    for time, flag in zip(t, flags):
        if flag and start is None:
            start = time
        elif not flag and start is not None:
            yield start, time
            start = None
    if start is not None:
        yield start, t[-1]


def shade(axis, t, flags, colour, alpha=0.16):
    found = False
    for start, end in spans(t, flags):
        axis.axvspan(start, end, color=colour, alpha=alpha, linewidth=0)
        found = True
    return found


def where(values, flags):
    """Values with gaps where the flag is not set."""
    return [value if flag else float("nan") for value, flag in zip(values, flags)]


def of(run, *names):
    """The first of these columns that the trace has: those of earlier versions have fewer."""
    return next((run[name] for name in names if name in run), None)


def dragged(run):
    """Where the vector is imposed and the position is not known."""
    flags = of(run, "open_loop")
    return [flag > 0 for flag in flags] if flags else [False] * len(run["t_s"])


def mark_faults(axes, run):
    """A line where a fault comes, on every axis, with its name on the first."""
    before = "NONE"
    for time, fault in zip(run["t_s"], run["fault"]):
        if fault not in ("NONE", before):
            for axis in axes:
                axis.axvline(time, color=RED, linewidth=1.2)
            axes[0].annotate(fault, (time, 0.03), xycoords=("data", "axes fraction"), xytext=(3, 0), textcoords="offset points",
                             color=RED, fontsize=8, fontweight="bold")
        before = fault


def plot_link(axis, run):
    axis.plot(run["t_s"], run["v_dc_V"], color=BLUE, linewidth=0.8)
    low, high = min(run["v_dc_V"]), max(run["v_dc_V"])
    room = max(0.05 * high - (high - low), 0.0) / 2  # a link that stays is a flat line
    axis.set_ylim(low - room - 0.1 * (high - low), high + room + 0.1 * (high - low))
    axis.set_ylabel("Link (V)")


def plot_speed(axis, run, positioned):
    rpm = {key: [RAD_S_TO_RPM * x for x in run[key]] for key in
           ("omega_ref_mech_rad_s", "omega_mech_rad_s", "omega_hat_mech_rad_s")}
    t = run["t_s"]
    axis.plot(t, where(rpm["omega_hat_mech_rad_s"], positioned), color=ORANGE, linewidth=2.4, label="estimate")
    axis.plot(t, rpm["omega_mech_rad_s"], color=BLUE, label="true")
    axis.plot(t, where(rpm["omega_ref_mech_rad_s"], positioned), color="black", linewidth=0.9,
              linestyle=(0, (4, 2)), label="reference")
    axis.set_ylabel("Speed (r/min)")
    axis.legend(loc="upper right", ncol=3)


def plot_error(axis, run, positioned):
    t = run["t_s"]
    axis.plot(t, where(run["angle_error_deg"], positioned), color=BLUE, linewidth=0.8)
    axis.axhline(0.0, color="black", linewidth=0.6)
    shown = [abs(e) for e, p in zip(run["angle_error_deg"], positioned) if p]
    led = [abs(e) for e, p, d in zip(run["angle_error_deg"], positioned, dragged(run)) if p and not d]
    limit = max(6.0, 1.15 * max(led or shown, default=0.0))
    axis.set_ylim(-min(limit, 180.0), min(limit, 180.0))
    entries = []
    open_loop = dragged(run)
    led = [p and not o for p, o in zip(positioned, open_loop)]
    injection = [p and w <= 0.0 for p, w in zip(led, run["weight"])]
    blend = [p and 0.0 < w < 1.0 for p, w in zip(led, run["weight"])]
    searching = [s in ("calibrating", "finding") for s in run["state"]]
    for flags, colour, label in (
        (searching, GREY, "finding position"),
        ([p and o for p, o in zip(positioned, open_loop)], PURPLE, "open loop"),
        (injection, SKY, "injection"),
        (blend, ORANGE, "blending"),
        ([f != "NONE" for f in run["fault"]], RED, "fault"),
    ):
        if shade(axis, t, flags, colour, 0.3):
            entries.append(Patch(color=colour, alpha=0.3, linewidth=0, label=label))
    axis.set_ylabel("Position error\n(deg, electrical)")
    if entries:
        axis.legend(handles=entries, loc="upper right", ncol=len(entries))


def plot_current(axis, run):
    t = run["t_s"]
    for key, label, grey in (("ia_A", "phases", "#a6a6a6"), ("ib_A", None, "#bdbdbd"), ("ic_A", None, "#d4d4d4")):
        axis.plot(t, run[key], color=grey, linewidth=0.5, label=label, rasterized=True)
    axis.plot(t, run["iq_A"], color=GREEN, linewidth=1.0, label="$i_q$")
    axis.plot(t, run["id_A"], color=PURPLE, linewidth=1.0, label="$i_d$")
    axis.set_ylabel("Current (A)")
    axis.legend(loc="upper right", ncol=3)


def plot_torque(axis, run):
    t = run["t_s"]
    axis.plot(t, run["torque_Nm"], color=BLUE, linewidth=0.8, label="air gap")
    axis.plot(t, of(run, "loads_Nm", "load_Nm"), color=RED, linestyle=(0, (4, 2)), linewidth=1.4, label="all loads")
    axis.set_ylabel("Torque (Nm)")
    axis.legend(loc="upper right", ncol=2)


def headroom(axis, share=0.28):
    """Space above the curves for the legend."""
    low, high = axis.get_ylim()
    axis.set_ylim(low, high + share * (high - low))


def plot(run, title):
    positioned = [state in WITH_POSITION for state in run["state"]]
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(5, 1, sharex=True, figsize=(8.0, 9.4), constrained_layout=True,
                                    gridspec_kw={"height_ratios": (1, 1, 1, 1, 0.45)})
        plot_speed(axes[0], run, positioned)
        plot_error(axes[1], run, positioned)
        plot_current(axes[2], run)
        plot_torque(axes[3], run)
        plot_link(axes[4], run)
        for axis in axes[:4]:
            headroom(axis)
        shade(axes[0], run["t_s"], dragged(run), PURPLE)
        mark_faults(axes, run)
        axes[-1].set_xlabel("Time (s)")
        axes[-1].set_xlim(run["t_s"][0], run["t_s"][-1])
        figure.align_ylabels(axes)
        if title:
            figure.suptitle(title, fontsize=10.5, fontweight="bold")
    return figure


def title_beside(trace):
    """First line of summary.txt, which pmsim writes beside the trace."""
    summary = trace.parent / "summary.txt"
    return summary.read_text().splitlines()[0] if summary.is_file() else ""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trace", type=pathlib.Path, help="trace.csv of pmsim run --out, or its folder")
    parser.add_argument("-o", "--out", type=pathlib.Path, help="picture; default: demo.png beside the trace")
    parser.add_argument("--title", help="default: the title in summary.txt beside the trace")
    parser.add_argument("--dpi", type=int, default=150)
    arguments = parser.parse_args()
    trace = arguments.trace / "trace.csv" if arguments.trace.is_dir() else arguments.trace
    if not 1 <= arguments.dpi <= DPI_MOST:
        parser.error(f"--dpi {arguments.dpi} is not 1 to {DPI_MOST}")
    if not trace.is_file():
        parser.error(f"{trace}: no such file")
    title = arguments.title if arguments.title is not None else title_beside(trace)
    out = arguments.out or trace.with_name("demo.png")
    figure = plot(read_trace(trace), title)
    kinds = figure.canvas.get_supported_filetypes()
    if out.suffix[1:] not in kinds:
        parser.error(f"{out} is no picture: its name ends with one of {', '.join(kinds)}")
    try:
        figure.savefig(out, dpi=arguments.dpi)
    except OSError as error:
        fail(f"{out}: {error.strerror}")


if __name__ == "__main__":
    main()
