"""What a campaign has shown, as text: classes with their intervals, causes with the numbers of their runs, groups."""

from collections import Counter, defaultdict

from .judge import CONFIDENCE, interval
from .reader import OK, OTHER, REFUSED
from .store import DRAWN

NUMBERS_SHOWN = 8
WORDS_MOST = 12  # of a drawn word that has more values no table is made


def classes_of(campaign, rows):
    """In the order of the rules; those of the file also where no run has them."""
    names = [OK, REFUSED, *dict.fromkeys(rule.name for rule in campaign.rules)]
    return names + ([OTHER] if any(row["class"] == OTHER for row in rows) else [])


def percent(share):
    return f"{100 * share:.1f} %" if share not in (0, 1) else f"{100 * share:.0f} %"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1)]
    return "\n".join(lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows]) + "\n"


def split(rows, key, names):
    """A table of classes by the value of a column."""
    parts = defaultdict(list)
    for row in rows:
        parts[row[key]].append(row["class"])
    body = []
    for value, classes in sorted(parts.items(), key=lambda item: str(item[0])):
        counts = Counter(classes)
        low, high = interval(counts[OK], len(classes))
        body.append(
            [value, len(classes), *(counts[name] or "" for name in names), f"{percent(low)} to {percent(high)}"]
        )
    return table([key.removeprefix(DRAWN), "runs", *names, "ok within"], body)


def causes(rows):
    found = defaultdict(list)
    for row in rows:
        if row["class"] != OK:
            found[row["class"], row["cause"]].append(row)
    body = []
    for (name, cause), of in sorted(found.items(), key=lambda item: -len(item[1])):
        numbers = ", ".join(str(row["run"]) for row in of[:NUMBERS_SHOWN]) + (
            ", ..." if len(of) > NUMBERS_SHOWN else ""
        )
        groups = ", ".join(
            f"{group} {n}" for group, n in Counter(row["group"] for row in of if row["group"]).most_common(4)
        )
        body.append([f"{name}: {cause}", len(of), groups, numbers])
    return table(["class: cause", "runs", "most in", "numbers"], body)


def verdicts(campaign, rows):
    """(pass, line) of each bound of the file."""
    counts = Counter(row["class"] for row in rows)
    lines = []
    for bound in campaign.bounds:
        share = counts[bound.name] / len(rows)
        good = bound.least <= share <= bound.most
        low, high = interval(counts[bound.name], len(rows))
        wanted = f">= {percent(bound.least)}" if bound.least > 0 else f"<= {percent(bound.most)}"
        lines.append(
            (
                good,
                f"{'PASS' if good else 'FAIL'}  {bound.name:20} {counts[bound.name]:6} of {len(rows)}  {percent(share):>7}  {wanted}  "
                f"({100 * CONFIDENCE:.0f} % confidence: {percent(low)} to {percent(high)})",
            )
        )
    return lines


def words_drawn(rows):
    """Columns of drawn words with few values."""
    names = [name for name in rows[0] if name.startswith(DRAWN)]
    for name in names:
        values = {row[name] for row in rows if row.get(name) is not None}
        if values and all(isinstance(value, str) for value in values) and len(values) <= WORDS_MOST:
            yield name


def counted(campaign, rows):
    """(class, runs, share, low, high)."""
    counts = Counter(row["class"] for row in rows)
    return [
        (name, counts[name], counts[name] / len(rows), *interval(counts[name], len(rows)))
        for name in classes_of(campaign, rows)
    ]


def text(campaign, rows, picture):
    names = classes_of(campaign, rows)
    parts = [
        f"# {campaign.title}\n",
        f"{len(rows)} runs, seed {campaign.seed}, {sum(row['simulated_s'] for row in rows):.0f} s "
        f"simulated. Intervals are Clopper and Pearson's at {100 * CONFIDENCE:.0f} %.\n",
        f"![{campaign.title}]({picture})\n",
        table(
            ["class", "runs", "share", "within"],
            [
                [name, n, percent(share), f"{percent(low)} to {percent(high)}"]
                for name, n, share, low, high in counted(campaign, rows)
            ],
        ),
    ]
    if any(row["class"] != OK for row in rows):
        parts += ["## Causes\n", causes(rows)]
    columns = (["group"] if any(row["group"] for row in rows) else []) + list(words_drawn(rows))
    for name in columns:
        parts += [f"## By {name.removeprefix(DRAWN)}\n", split(rows, name, names)]
    parts.append("`tools/campaign replay FOLDER NUMBER --out DIR` runs one again with its trace.\n")
    return "\n".join(parts)
