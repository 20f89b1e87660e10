"""Values of the drive over time: drawn in the terminal while they come, and as a picture afterwards."""
import time
from pathlib import Path

from .errors import UsageError

SHOWN_S = 20.0  # of the past, in the terminal
PICTURES = ".png", ".svg", ".pdf"


def check_path(path):
    """That a picture can be made under this name: known before anything is read for it."""
    if path is None:
        return
    if Path(path).suffix not in PICTURES:
        raise UsageError(f"{path} is no picture", f"its name ends with one of: {', '.join(PICTURES)}")
    _library("matplotlib")


def _library(name):
    try:
        return __import__(name, fromlist=["*"])
    except ImportError:
        raise UsageError(f"{name} is not installed", "pip install 'pmdrive[plot]'") from None


class History:
    """Times and physical values of some entries, as they were read."""

    def __init__(self, entries):
        self.entries, self.time_s, self.values = entries, [], {entry: [] for entry in entries}
        self.began = time.monotonic()

    def read(self, drive):
        """One more sample of each; their integers."""
        raws = {entry: drive.read(entry) for entry in self.entries}
        self.time_s.append(time.monotonic() - self.began)
        for entry, raw in raws.items():
            self.values[entry].append(float(entry.physical(raw)))
        return raws

    def since(self, seconds):
        first = next(n for n, at in enumerate(self.time_s) if at >= self.time_s[-1] - seconds)
        return self.time_s[first:], {entry: values[first:] for entry, values in self.values.items()}


class Terminal:
    """One panel for each entry, all of the last 20 s."""

    def __init__(self):
        self.plot = _library("plotext")

    def draw(self, history):
        times, values = history.since(SHOWN_S)
        plot = self.plot
        plot.clear_figure()
        plot.subplots(len(values), 1)
        for row, (entry, y) in enumerate(values.items(), 1):
            panel = plot.subplot(row, 1)
            panel.theme("clear")
            panel.plot(times, y, marker="braille")
            panel.title(f"{entry.name} {y[-1]:.4g} {entry.unit}")
        plot.clear_terminal()
        plot.show()


def picture(history, path):
    matplotlib = _library("matplotlib")
    matplotlib.use("Agg")
    plt = _library("matplotlib.pyplot")
    figure, axes = plt.subplots(len(history.entries), 1, sharex=True, squeeze=False, figsize=(9, 1 + 1.8 * len(history.entries)))
    for (axis,), entry in zip(axes, history.entries):
        axis.plot(history.time_s, history.values[entry])
        axis.set_ylabel(f"{entry.name}\n{entry.unit}")
        axis.grid(True, alpha=0.3)
    axes[-1][0].set_xlabel("time, s")
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
