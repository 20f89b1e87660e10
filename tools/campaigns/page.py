"""The picture of a campaign: shares of the classes, groups, and in what the runs that failed differ from the others."""

from collections import Counter, defaultdict

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.ticker import NullFormatter  # noqa: E402

from .reader import OK, REFUSED  # noqa: E402
from .store import DRAWN  # noqa: E402
from .summary import classes_of, counted, percent  # noqa: E402

GOOD, GREY = "#4c9f70", "#9aa5b1"
BAD = ["#e0a030", "#c8553d", "#7b3f8c", "#2f6690", "#b5838d", "#555b6e"]
SEPARATING = 4  # drawn values that are shown
LEAST_FAILED = 5  # below that nothing is said of in what they differ
LOG_SPAN = 30.0  # a value that spans more is shown on a logarithmic axis


def colours(names):
    bad = iter(BAD * len(names))
    return {name: GOOD if name == OK else GREY if name == REFUSED else next(bad) for name in names}


def draw_shares(axis, campaign, rows, colour):
    found = counted(campaign, rows)[::-1]
    for y, (name, n, share, low, high) in enumerate(found):
        axis.barh(y, 100 * share, color=colour[name], height=0.62)
        axis.plot([100 * low, 100 * high], [y, y], color="#222222", lw=1.4, solid_capstyle="butt")
        axis.text(102, y, f"{n}  ({percent(low)} to {percent(high)})", va="center", fontsize=8)
    axis.set_yticks(range(len(found)), [name for name, *_ in found])
    axis.set(xlim=(0, 100), xlabel="% of the runs; line: 95 % confidence", title="Classes")
    axis.grid(True, axis="x", alpha=0.3)


def draw_groups(axis, rows, names, colour):
    groups = defaultdict(Counter)
    for row in rows:
        groups[row["group"] or "all"][row["class"]] += 1
    order = sorted(groups, key=lambda group: groups[group][OK] / sum(groups[group].values()), reverse=True)
    for y, group in enumerate(order):
        total, left = sum(groups[group].values()), 0.0
        for name in names:
            width = 100 * groups[group][name] / total
            axis.barh(y, width, left=left, color=colour[name], height=0.7)
            left += width
        axis.text(101, y, str(total), va="center", fontsize=8)
    axis.set_yticks(range(len(order)), order)
    axis.set(xlim=(0, 100), xlabel="% of the group's runs", title="Groups")
    axis.invert_yaxis()


def logarithmic(axis, low, high):
    """Of at least a decade and a half, so that two ticks have numbers."""
    if low > 0 and high / low > LOG_SPAN:
        axis.set_xscale("log")
        axis.xaxis.set_minor_formatter(NullFormatter())


def separation(good, bad):
    """Largest distance of the two cumulative distributions (Kolmogorov and Smirnov)."""
    every = np.sort(np.concatenate([good, bad]))
    return np.max(
        np.abs(
            np.searchsorted(np.sort(good), every, "right") / len(good)
            - np.searchsorted(np.sort(bad), every, "right") / len(bad)
        )
    )


def separating(rows):
    """Drawn numbers in which failed runs differ most from good ones: (name, good, failed)."""
    found = []
    for name in (key for key in rows[0] if key.startswith(DRAWN)):
        parts = [[], []]
        for row in rows:
            if isinstance(row.get(name), (int, float)) and row["class"] != REFUSED:
                parts[row["class"] != OK].append(row[name])
        good, bad = map(np.array, parts)
        if len(bad) >= LEAST_FAILED and len(good) >= LEAST_FAILED and np.ptp(np.concatenate([good, bad])) > 0:
            found.append((separation(good, bad), name, good, bad))
    return [part[1:] for part in sorted(found, key=lambda part: -part[0])[:SEPARATING]]


def draw_separating(axis, name, good, bad):
    every = np.concatenate([good, bad])
    for values, colour, label in ((good, GOOD, "ok"), (bad, BAD[1], "failed")):
        axis.step(
            np.sort(values),
            100 * np.arange(1, len(values) + 1) / len(values),
            where="post",
            color=colour,
            lw=1.8,
            label=f"{label} ({len(values)})",
        )
    logarithmic(axis, every.min(), every.max())
    axis.set(title=f"{name.removeprefix(DRAWN)}, as drawn", ylim=(0, 100), ylabel="% of the runs below")
    axis.grid(True, alpha=0.3, which="both")
    axis.legend(fontsize=8, frameon=False)


def draw_shown(axis, name, metric, rows):
    """Share of the good runs below a value."""
    values = np.sort([row[name] for row in rows if row["class"] == OK and isinstance(row.get(name), (int, float))])
    if len(values):
        axis.step(values, 100 * np.arange(1, len(values) + 1) / len(values), where="post", color=GOOD, lw=1.8)
        logarithmic(axis, values[0], values[-1])
    axis.set(title=f"{name}, runs that are ok", xlabel=metric, ylim=(0, 100), ylabel="% of the runs below")
    axis.grid(True, alpha=0.3, which="both")


def draw(campaign, rows, path):
    names = classes_of(campaign, rows)
    colour = colours(names)
    groups = len({row["group"] for row in rows})
    differ = separating(rows)
    below = len(differ) + len(campaign.shown)
    lines = (below + 1) // 2
    height = max(3.0, 0.3 * max(groups, len(names)) + 1.2)
    figure = plt.figure(figsize=(12, height + 2.6 * lines + 0.8), layout="constrained")
    grid = figure.add_gridspec(1 + lines, 2, height_ratios=[height, *[2.6] * lines])
    draw_shares(figure.add_subplot(grid[0, 0]), campaign, rows, colour)
    draw_groups(figure.add_subplot(grid[0, 1]), rows, names, colour)
    places = [(1 + k // 2, k % 2) for k in range(below)]
    for place, part in zip(places, differ):
        draw_separating(figure.add_subplot(grid[place]), *part)
    for place, name in zip(places[len(differ) :], campaign.shown):
        draw_shown(figure.add_subplot(grid[place]), name, campaign.expectations[name], rows)
    kinds = [name for name in names if any(row["class"] == name for row in rows)]
    patches = [plt.Rectangle((0, 0), 1, 1, color=colour[name]) for name in kinds]
    title = {"title": f"{campaign.title}: {len(rows)} runs", "title_fontsize": 13}
    figure.legend(patches, kinds, loc="outside upper center", ncols=len(kinds), fontsize=9, frameon=False, **title)
    figure.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(figure)
