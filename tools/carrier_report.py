"""What the carrier of a low-speed source costs: its current and loss, how it sounds, instructions of the control interrupt. Parts of
docs/results/injection.md, made by tools/injection_report.py."""

import csv
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
import performance_report
from campaigns import worker
from observer_report import PMSIM, ROOT, fail, plt

LAST_S = 0.2   # of a trace at standstill without load
AUDIBLE_HZ = 20
SOURCES = ROOT / "tests/scenario/board/sources.yaml"
IMAGES = "foc", "salient"  # the first that has the source


class Carrier(NamedTuple):
    """The current's deviation from its mean, a vector in the frame of the rotor, at the sample instants: converter noise and ripple of
    the PWM aside."""

    frequency_Hz: float
    rms_A: float
    heard_A: float         # rms, each line as loud as the ear has it
    lines_Hz: np.ndarray
    lines_A: np.ndarray    # rms of each


def heard(f_Hz):
    """A-weighting, IEC 61672: as a factor of the amplitude, 1 at 1 kHz."""
    f2 = np.asarray(f_Hz, dtype=float) ** 2
    below = (f2 + 20.6 ** 2) * np.sqrt((f2 + 107.7 ** 2) * (f2 + 737.9 ** 2))
    return 1.2589 * 12194 ** 2 * f2 ** 2 / (below * (f2 + 12194 ** 2))


def submit(pool, study, n, settings):
    """A trace of every period."""
    return pool.submit(worker.run_file, str(PMSIM), worker.digest(PMSIM), study.text(), study.settings(n, settings),
                       ("--decimate", 1))


def result(job):
    done = job.result()
    if done["code"] > 1:
        fail(done["errors"])
    rows = list(csv.DictReader(done["trace"].splitlines()))
    t, *rest = (np.array([float(row[key]) for row in rows])
                for key in ("t_s", "v_alpha_V", "v_beta_V", "id_A", "iq_A"))
    last = t > t[-1] - LAST_S
    v, i = ((a + 1j * b)[last] for a, b in (rest[:2], rest[2:]))
    f = np.fft.fftfreq(len(v), t[1] - t[0])
    carrier = abs(f[np.abs(np.fft.fft(v - v.mean())).argmax()])
    turning = np.abs(np.fft.fft(i - i.mean())) / len(i)
    # forwards and backwards alike
    lines = np.unique(np.abs(f))
    power = np.array([np.sum(turning[np.abs(f) == line] ** 2) for line in lines])
    audible = lines >= AUDIBLE_HZ
    loud = power[audible] * heard(lines[audible]) ** 2
    return Carrier(carrier, float(np.sqrt(power.sum())), float(np.sqrt(loud.sum())), lines, np.sqrt(power))


def loss_W(carrier, R_s):
    """In the copper; |i| is the peak of a phase."""
    return 1.5 * R_s * carrier.rms_A ** 2


def plot(carriers, title, path):
    """Spectra, one below the other."""
    figure, axes = plt.subplots(len(carriers), 1, figsize=(9, 1.25 * len(carriers) + 0.8), sharex=True, sharey=True)
    for axis, (name, c) in zip(np.atleast_1d(axes), carriers.items()):
        axis.vlines(c.lines_Hz / 1e3, 1e-2, np.maximum(1e3 * c.lines_A, 1e-2), color="C0", lw=1)
        axis.plot(c.lines_Hz / 1e3, 1e3 * c.lines_A.max() * heard(np.maximum(c.lines_Hz, 1)), color="0.6", lw=0.8, ls=":")
        axis.set(yscale="log", ylim=(1e-2, 5e2))
        axis.set_title(f"{name}: {1e3 * c.rms_A:.0f} mA, heard as {1e3 * c.heard_A:.0f} mA", loc="left", fontsize=8, pad=2)
        axis.grid(True, alpha=0.3)
    axes = np.atleast_1d(axes)
    figure.suptitle(title, fontsize=10)
    axes[len(axes) // 2].set_ylabel("current of a line, mA rms")
    axes[-1].set_xlabel("frequency, kHz")
    figure.tight_layout()
    figure.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(figure)


def instructions(names):
    """Name -> (image, mean of the whole control interrupt, worst), of those that an image of the board has."""
    found = {}
    with tempfile.TemporaryDirectory(prefix="pm_carrier") as folder:
        for name in names:
            for image in (x for wanted in IMAGES for x in performance_report.IMAGES if x.name == wanted):
                if name in found or name not in image.methods:
                    continue
                elf = performance_report.TARGET / f"{image.program}.elf"
                run = performance_report.run_board(Path(folder), SOURCES, "--set", "sensor.shunt=in_line", "--set", f"case={name}",
                                                   image=elf)
                found[name] = image.name, run["control.injection.mean"], run["control.injection.worst"]
    return found
