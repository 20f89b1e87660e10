"""Accepted survivors, the summary, and docs/results/mutation.md."""
from collections import Counter

import yaml
from tree import ROOT

HELP = """Changes the sources in small ways, one at a time, and runs the tests that reach the change: a mutant that no
test sees is a hole in the tests.

Mutants: other operators and comparisons, other constants, conditions negated, d for q and alpha for beta, limits and
statements left out. All mutants of a run are in one build (a copy of the project in out/mutate/tree), and the
environment chooses the one that is alive, so that each costs only its tests, quickest first.

Survivors that are accepted stand in tests/mutants.yaml with the reason. Results are kept in out/mutate/results.jsonl
until the file changes; a run that was stopped goes on. Exit code 1: fewer killed than the goal, or an accepted survivor
that is not in the sources any more."""

ACCEPTED = ROOT / "tests" / "mutants.yaml"
PAGE = ROOT / "docs" / "results" / "mutation.md"
KILLED = ("killed", "timed out")


def read_accepted(mutants):
    """Keys of accepted mutants with their reason, and the rows that fit no mutant of these files."""
    files = {mutant.file for mutant in mutants}
    accepted, stale = {}, []
    rows = yaml.safe_load(ACCEPTED.read_text()) or [] if ACCEPTED.exists() else []
    for row in rows:
        fits = [m for m in mutants if m.file == row["file"] and m.line == row["line"] and m.what == row["mutation"]
                and row.get("place", m.place) == m.place]
        for mutant in fits:
            accepted[mutant.key()] = row["reason"]
        if not fits and row["file"] in files:
            stale.append(row)
    return accepted, stale


def _folder(file):
    parts = file.split("/")
    return "/".join(parts[:2]) if parts[0] in ("firmware", "tools") else parts[0]


def table(mutants, known, accepted):
    """Rows: folder, tried, killed, timed out, accepted, survived; the last is the sum."""
    counts = {}
    for mutant in mutants:
        row = known.get(mutant.key())
        verdict = "accepted" if mutant.key() in accepted else row["verdict"] if row else None
        if verdict == "not reached":
            verdict = "survived"
        if verdict:
            counts.setdefault(_folder(mutant.file), Counter())[verdict] += 1
    rows = [[folder, sum(c.values()), c["killed"], c["timed out"], c["accepted"], c["survived"]]
            for folder, c in sorted(counts.items())]
    return [*rows, ["all", *(sum(row[n] for row in rows) for n in range(1, 6))]]


def share(row):
    judged = row[1] - row[4]
    return 100 * (row[2] + row[3]) / judged if judged else 100.0


def summary(mutants, known, accepted, stale, goal):
    rows = table(mutants, known, accepted)
    print(f"{'folder':22} tried killed time acc. surv.  killed of the rest")
    for row in rows:
        print(f"{row[0]:22} {row[1]:5} {row[2]:6} {row[3]:4} {row[4]:4} {row[5]:5} {share(row):7.1f} %")
    for row in stale:
        print(f"tests/mutants.yaml: no such mutant any more: {row['file']}: {row['mutation']}: {row['line']}")
    return share(rows[-1]) >= goal and not stale


TEXT = """<!-- Written by `tools/mutate --page`. -->
# Mutation testing

`tools/mutate` changes the sources in small ways, one at a time, and runs the tests that reach the change. A mutant
that no test sees is a hole in the tests, or it changes nothing that matters: then it stands below with the reason
(`tests/mutants.yaml`).

Mutants: comparisons and operators exchanged, conditions negated, constants changed, d read for q and alpha for beta,
limits, signs and statements left out. Tried were {tried} of the {all} mutants of {files} files, a sample spread over all
files by size. Tests: unit and contract, on the host, each with three times its usual time and a second more, in seconds of
the processor.

"killed": of those that are not accepted.

{table}

## Accepted survivors

{accepted}

## Survivors that are holes in the tests

{survivors}
"""


def _cell(text):
    return text.replace("|", "\\|")


def write(mutants, known, accepted):
    rows = table(mutants, known, accepted)
    lines = ["| folder | tried | killed by a test | timed out | accepted | survived | killed |",
             "|---|---:|---:|---:|---:|---:|---:|"]
    lines += [f"| {row[0]} | {' | '.join(str(n) for n in row[1:])} | {share(row):.1f} % |" for row in rows]
    tolerated = ["| where | mutation | reason |", "|---|---|---|"]
    holes = ["| where | mutation |", "|---|---|"]
    for mutant in mutants:
        where = f"{mutant.file}, {mutant.function}: `{_cell(mutant.line)}`"
        row = known.get(mutant.key())
        if mutant.key() in accepted:
            tolerated.append(f"| {where} | `{_cell(mutant.what)}` | {_cell(accepted[mutant.key()])} |")
        elif row and row["verdict"] not in KILLED:
            holes.append(f"| {where} | `{_cell(mutant.what)}` |")
    text = TEXT.format(tried=rows[-1][1], all=len(mutants), files=len({m.file for m in mutants}),
                       table="\n".join(lines),
                       accepted="\n".join(tolerated) if len(tolerated) > 2 else "None.",
                       survivors="\n".join(holes) if len(holes) > 2 else "None.")
    PAGE.write_text(text)
    print(f"wrote {PAGE.relative_to(ROOT)}")
