#!/usr/bin/env python3
"""Fills docs/performance.md, between `<!-- measured -->` and `<!-- end -->`, with what is measured now.

The builds must be there: tools/performance_report makes them first. --keep-speed leaves the speed of the emulation as it
stands: on a machine that is not quiet. --check writes nothing: it fails when instructions of a control period or bytes of an image
are not those of the page.
"""
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import gen_images  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/performance.md"
PMSIM = ROOT / "out/build/host-release/tools/pmsim/pmsim"
TARGET = ROOT / "out/build/stm32g431"
IMAGES = gen_images.images(ROOT)
FOC, SMALL, BLDC = (TARGET / f"{next(x.program for x in IMAGES if x.name == name)}.elf" for name in ("foc", "small", "bldc"))
SCENARIOS = ROOT / "tests/scenario"
FAST = (SCENARIOS / "board/identity.yaml", "--set", "noise=5")  # at 20 kHz
RUNS = 5


def output(command):
    return subprocess.run(command, check=True, cwd=ROOT, capture_output=True, text=True).stdout


def count_step(folder, image):
    """Mode -> {mean, max} of the instructions of an image's drive_step() under QEMU."""
    record = folder / "demo.rec"
    output([PMSIM, "record", SCENARIOS / "demo.yaml", "--out", record])
    elf = TARGET / f"tests/target/drive/drive_replay_{image.name}.elf"
    return json.loads(output([sys.executable, ROOT / "tests/target/count.py", elf, "--function", "step_*", "--json", "-",
                              "--", record]))["functions"]


def step_rows(steps):
    for what, key, budget in (("active flux, high speed", "step_flux", "drive_step_flux"),
                              ("square-wave injection", "step_injection", "drive_step_injection"),
                              ("off, calibration, pulses", "step_start", None)):
        row = [what]
        for image, step in steps:
            row += [f"{step[key]['mean']:.0f}", f"{step[key]['max']}", f"{image.budgets[budget]}" if budget else ""]
        yield row


def run_board(folder, *words, image=SMALL):
    """Figures of a run on the emulated board."""
    figures = folder / "figures.json"
    output([PMSIM, "board", image, "--similar", *words, "--jobs", "1", "--quiet", "--figures", figures])
    return json.loads(figures.read_text())


def board_speed(*words):
    """Simulated seconds per second of the wall: the best of several runs, which others on the machine slow down."""
    runs = (json.loads(output([PMSIM, "board", SMALL, "--similar", *words, "--jobs", "1", "--json"])) for _ in range(RUNS))
    return max(run["simulated_s"] / run["wall_s"] for run in runs)


def limits(image):
    """What -> (bytes, budget) of an image."""
    manifest = ROOT / gen_images.FOLDER / f"{image.name}.yaml"
    text = output([sys.executable, ROOT / "tests/target/image/limits.py", TARGET / f"{image.program}.elf", manifest])
    return {what: (size, most) for what, size, most in re.findall(r"(?m)^ok\s+(.+?): (\d+) of (\d+) bytes", text)}


def size_rows():
    """Bytes and budget of every image."""
    found = [limits(image) for image in IMAGES]
    return [[what, *(figure for sizes in found for figure in sizes[what])] for what in found[0]]


# Number -> name of those that the image `small` leaves out.
OBSERVERS = {6: "`ekf_full`", 7: "`ekf_reduced`", 8: "`mras_current`", 9: "`mras_voltage`", 10: "`mras_simple`"}
SPEEDS = ("speed of the emulation with plant and comparison, simulated s per wall s",
          "the same for the demonstration, at 10 kHz")
MODES_RUN = SCENARIOS / "board/modes.yaml"
MODES = [("off", "off"), ("calibrate", "calibration"), ("pulses", "initial-position pulses"),
         ("identify", "identification"), ("align", "alignment"), ("open_loop", "open-loop current"),
         ("injection", "injection"), ("blend", "injection and observer"), ("flux", "active flux"),
         ("weakening", "active flux, field weakening"), ("limited", "of these: at the voltage limit"),
         ("fault", "of these: a fault found"), ("swap", "of these: after a swap of parameters")]


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def speeds(keep):
    """Simulated seconds per wall second, fast and demonstration, as text: measured, or as the page has them."""
    if keep:
        page = PAGE.read_text()
        return [re.search(rf"(?m)^\| {re.escape(what)} \| ([\d.]+)", page)[1] for what in SPEEDS]
    return [f"{board_speed(*FAST):.1f}", f"{board_speed(SCENARIOS / 'demo.yaml'):.1f}"]


def observer_rows(folder):
    """Of the image `foc`, by optional observer."""
    for number, name in OBSERVERS.items():
        run = run_board(folder, SCENARIOS / "board/observers.yaml", "--set", f"observer={number}", image=FOC)
        yield [name, *(f"{run[f'control.{key}']:.0f}" for key in ("flux.mean", "blend.mean", "worst")),
               f"{run['control.worst_percent']:.1f} %", f"{run['load_percent']:.1f} %"]


BLOCKS = (("H_PWM-L_ON, BLDC-FAN", "--set", "case=FAN", "--set", "angle=130"),
          ("H_PWM-L_ON, BLDC-HS, 40 kHz", "--set", "case=HS", "--set", "angle=10", "--set", "sensor.shunt=in_line"),
          ("H_PWM-L_PWM, BLDC-HS, 40 kHz, low-side shunts", "--set", "case=HS", "--set", "angle=10", "--set", "drive.pattern=0"))


def block_rows(folder):
    """Block commutation in `bldc`, and field orientation in the same image."""
    def row(what, run, mode):
        return [what, *(f"{run[f'control.{mode}.{x}']:.0f}" for x in ("mean", "worst", "cycles")), f"{run['load_percent']:.1f} %"]

    for what, *words in BLOCKS:
        yield row(what, run_board(folder, SCENARIOS / "six_step.yaml", *words, image=BLDC), "six_step")
    duty = run_board(folder, SCENARIOS / "six_step_duty.yaml", "--set", "case=FAN ramp", image=BLDC)
    yield row("mode duty, BLDC-FAN", duty, "six_step")
    yield [*row("active flux, high speed", duty, "flux")[:-1], ""]


def check():
    with tempfile.TemporaryDirectory(prefix="pm_performance") as name:
        steps = [(image, count_step(Path(name), image)) for image in IMAGES]
    page = PAGE.read_text()
    lines = ["| " + " | ".join(row) + " |" for row in (*step_rows(steps), *size_rows())]
    stale = [line for line in lines if line not in page]
    if stale:
        sys.exit("\n".join([f"{PAGE.relative_to(ROOT)} is not up to date; now:", *stale, "tools/performance_report --keep-speed"]))


def main():
    if "--check" in sys.argv[1:]:
        check()
        return
    with tempfile.TemporaryDirectory(prefix="pm_performance") as name:
        folder = Path(name)
        steps = [(image, count_step(folder, image)) for image in IMAGES]
        demo = run_board(folder, SCENARIOS / "demo.yaml")
        fast = run_board(folder, *FAST)
        modes = run_board(folder, MODES_RUN)
        busy = run_board(folder, MODES_RUN, "--busy")
        optional = list(observer_rows(folder))
        blocks = list(block_rows(folder))
        speed, slow_speed = speeds("--keep-speed" in sys.argv[1:])

    def mode(key):
        return [f"{demo[f'control.{key}.mean']:.0f}", f"{demo[f'control.{key}.worst']:.0f}",
                f"{demo[f'control.{key}.cycles']:.0f}", f"{demo[f'control.{key}.cycles_worst']:.0f}"]

    def by_mode(key, what):
        traced = [f"{busy[f'control.{key}.{x}']:.0f}" if f"control.{key}.{x}" in busy else "" for x in ("mean", "worst")]
        return [what, *(f"{modes[f'control.{key}.{x}']:.0f}" if f"control.{key}.{x}" in modes else ""
                        for x in ("mean", "worst")), *traced]

    parts = [
        table(["`drive_step()`, executed instructions",
               *(f"`{image.name}`, {word}" for image in IMAGES for word in ("mean", "worst", "budget, mean"))],
              step_rows(steps)),
        table(["whole control interrupt of `small`, with its register accesses", "mean", "worst", "cycles, mean", "cycles, worst"],
              [["active flux, high speed", *mode("flux")], ["square-wave injection", *mode("injection")],
               ["initial-position pulses", *mode("pulses")],
               ["all of the demonstration; budget 420 and 480", f"{demo['control.mean']:.0f}",
                f"{demo['control.worst']:.0f}", f"{demo['control.cycles']:.0f}", f"{demo['control.cycles_worst']:.0f}"],
               ["1 kHz interrupt (speed, state machine)", f"{demo['slow.mean']:.0f}", f"{demo['slow.worst']:.0f}",
                f"{demo['slow.cycles']:.0f}", f"{demo['slow.cycles_worst']:.0f}"]]),
        table(["whole control interrupt of `small` by mode; budget 420 and 480", "mean", "worst", "mean, traced", "worst, traced"],
              [by_mode(key, what) for key, what in MODES]),
        table(["at 20 kHz, 170 MHz", "measured", "budget"],
              [["worst control interrupt, share of the period", f"{fast['control.worst_percent']:.1f} %", "12 %"],
               ["processor load", f"{fast['load_percent']:.1f} %", ""],
               ["stack, measured", f"{max(demo['stack_bytes'], fast['stack_bytes']):.0f} bytes", "2048"],
               ["interrupts after which the drive's memory was the host's, bit for bit",
                f"{demo['identical'] + fast['identical']:.0f} of as many", "all"],
               [SPEEDS[0], speed, "4"], [SPEEDS[1], slow_speed, ""]]),
        table(["control interrupt of `foc`, 20 kHz", "observer, mean", "with injection, mean", "worst",
               "of the period, worst", "processor load"], optional),
        table(["whole control interrupt of `bldc`, the sample within the period among it", "mean", "worst", "cycles, mean", "processor load"],
              blocks),
        table(["bytes", *(head for image in IMAGES for head in (f"`{image.name}`", "budget"))], size_rows()),
    ]
    text, found = re.subn(r"(?s)(<!-- measured -->\n).*?(<!-- end -->)",
                          lambda m: m[1] + "\n" + "\n\n".join(parts) + "\n\n" + m[2], PAGE.read_text())
    if found != 1:
        sys.exit(f"{PAGE}: the markers are missing")
    PAGE.write_text(text)
    print("\n\n".join(parts))


if __name__ == "__main__":
    main()
