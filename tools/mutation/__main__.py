"""Driver of tools/mutate; its help text says what it does."""
import argparse
import glob
import hashlib
import json
import random
import re
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import page  # noqa: E402
import sites  # noqa: E402
import tree  # noqa: E402
import trials  # noqa: E402
from tree import OUT, ROOT  # noqa: E402

DEFAULT = ["firmware", "observers", "injection", "bldc", "tools/pmsim/metrics*.cpp", "tools/pmsim/runner.cpp"]
NOT_OURS_TO_MUTATE = re.compile(r"dictionary_(table|slots)|trig_table|allocations|/images/|main\.c$")
# Tests that cannot see these sources, or that measure time.
LEFT_OUT = (r"^(board_|sim_plant_|stm32g431|hal_linux|contract_hal_linux|build\.|pmsim\.plot|"
            r"can\.(recording|environment|generator))")
RESULTS = OUT / "results.jsonl"


@dataclass
class Mutant:
    number: int
    file: str
    function: str
    line: str
    place: int  # which of the same mutations on such lines of the function
    what: str
    row: int

    def key(self):
        return f"{self.file}|{self.function}|{self.line}|{self.what}|{self.place}"


def expand(words):
    files = set()
    for word in words or DEFAULT:
        path = ROOT / word
        if path.is_dir():
            found = {file for file in path.rglob("*") if file.suffix in (".c", ".h")}
        else:
            found = {Path(name) for name in glob.glob(str(path), recursive=True)}
        found = {file.resolve() for file in found if ROOT in file.resolve().parents}
        if not found:
            print(f"tools/mutate: no source of this project is {word}", file=sys.stderr)
            sys.exit(2)
        files |= found
    names = sorted(str(file.relative_to(ROOT)) for file in files)
    return [name for name in names if not NOT_OURS_TO_MUTATE.search(name)]


def survey(files):
    """All mutants, and per file its (site, numbers)."""
    mutants, places = [], {}
    for file in files:
        raw = (ROOT / file).read_bytes()
        seen = Counter()
        places[file] = []
        for site in sites.find(ROOT / file, tree.arguments(ROOT / file)):
            numbers = []
            row = raw[:site.start].count(b"\n") + 1
            line = raw.split(b"\n")[row - 1].decode().strip()
            for name, _ in site.what:
                seen[site.function, line, name] += 1
                mutant = Mutant(len(mutants), file, site.function, line, seen[site.function, line, name], name, row)
                numbers.append(mutant.number)
                mutants.append(mutant)
            places[file].append((site, numbers))
    return mutants, places


def sample(mutants, count, seed):
    """At least one of each file, the rest by its size; the same for the same seed."""
    if not count or count >= len(mutants):
        return mutants
    by_file = {}
    for mutant in mutants:
        by_file.setdefault(mutant.file, []).append(mutant)
    chosen = []
    for file, own in sorted(by_file.items()):
        share = max(1, round(count * len(own) / len(mutants)))
        chosen += random.Random(f"{seed} {file}").sample(own, min(share, len(own)))
    return sorted(chosen, key=lambda m: m.number)


def fingerprint(file):
    return hashlib.sha256((ROOT / file).read_bytes()).hexdigest()[:16]


def read_results(files):
    """What is known of mutants of files as they are now."""
    prints = {file: fingerprint(file) for file in files}
    known = {}
    if RESULTS.exists():
        for line in RESULTS.read_text().splitlines():
            row = json.loads(line)
            if prints.get(row["file"]) == row["print"]:
                known[row["key"]] = row
    return known


def try_all(todo, places, options, report):
    """Puts the mutants into the tree, builds, and runs the tests on each."""
    alive = {mutant.number for mutant in todo}
    changed = {}
    for file in sorted({mutant.file for mutant in todo}):
        # Numbers in the order in which they are tried, so that they are few.
        chosen = [(sites.Site(s.start, s.end, [w for w, n in zip(s.what, ns) if n in alive], s.statement),
                   [n for n in ns if n in alive]) for s, ns in places[file] if alive & set(ns)]
        changed[file], left = tree.with_mutants(file, chosen)
        alive -= {n for _, ns in chosen for n in ns} - set(left)
    print(f"{len(alive)} mutants in {len(changed)} files; building", flush=True)
    tree.write(changed)
    tree.build(options.jobs)
    workers = trials.Workers(options.jobs)
    tests = [t for t in trials.listed(options.labels.split(","), LEFT_OUT) if re.search(options.tests, t.name)]
    print(f"{len(tests)} tests; running each without a mutant", flush=True)
    tests, failed = trials.record(tests, max(alive, default=0) + 1, options.longest, workers)
    for command in failed:
        print(f"fails without a mutant, not used: {command}", flush=True)
    print(f"{len(tests)} tests reach one, {sum(t.seconds for t in tests):.0f} s", flush=True)
    order = [mutant for mutant in todo if mutant.number in alive]

    def one(mutant, scratch):
        return trials.kill(mutant.number, mutant.file, tests, options.most, scratch)

    for done, (mutant, (verdict, test)) in enumerate(workers.map(one, order), 1):
        report(mutant, verdict, test)
        if verdict in ("survived", "not reached"):
            print(f"{mutant.file}:{mutant.row}: {verdict}: {mutant.what}   {mutant.line}", flush=True)
        elif done % 50 == 0:
            print(f"[{done}/{len(order)}]", flush=True)


def main():
    parser = argparse.ArgumentParser(prog="tools/mutate", description=page.HELP,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", metavar="FILE", help=f"files or folders (default: {' '.join(DEFAULT)})")
    parser.add_argument("--sample", type=int, default=0, metavar="N", help="only N of them, spread over all files")
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--list", action="store_true", help="print the mutants and end")
    parser.add_argument("--again", action="store_true", help="try those again that survived the last time")
    parser.add_argument("--only", default="", metavar="REGEX", help="of the sample, only files that match")
    parser.add_argument("--tests", default="", metavar="REGEX", help="only tests whose names match")
    parser.add_argument("--labels", default="unit,contract", help="kinds of tests (default: %(default)s)")
    parser.add_argument("--longest", type=float, default=15, metavar="SECONDS",
                        help="tests that take longer are left out (default: %(default)s s of the processor)")
    parser.add_argument("--most", type=float, default=60, metavar="SECONDS",
                        help="after so much without a kill a mutant has survived (default: %(default)s s of the "
                        "processor)")
    parser.add_argument("--goal", type=float, default=95, metavar="PERCENT", help="of those that can be killed")
    parser.add_argument("--page", action="store_true", help="write docs/results/mutation.md from all that is known")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()

    OUT.mkdir(parents=True, exist_ok=True)
    files = expand(options.files)
    mutants, places = survey(files)
    chosen = sample(mutants, options.sample, options.seed)
    if options.list:
        for mutant in chosen:
            print(f"{mutant.file}:{mutant.row}: {mutant.what}   {mutant.line}")
        print(f"{len(chosen)} of {len(mutants)} mutants in {len(files)} files")
        return 0
    accepted, stale = page.read_accepted(mutants)
    known = read_results(files)

    def open_still(mutant):
        row = known.get(mutant.key())
        return row is None or (options.again and row["verdict"] in ("survived", "not reached"))

    todo = [mutant for mutant in chosen if open_still(mutant) and mutant.key() not in accepted
            and re.search(options.only, mutant.file)]
    if todo and not options.page:
        with RESULTS.open("a") as output:
            def report(mutant, verdict, test):
                row = {"file": mutant.file, "print": fingerprint(mutant.file), "key": mutant.key(), "verdict": verdict,
                       "test": test}
                known[mutant.key()] = row
                output.write(json.dumps(row) + "\n")
                output.flush()

            try_all(todo, places, options, report)
    good = page.summary(chosen, known, accepted, stale, options.goal)
    if options.page:
        page.write(mutants, known, accepted)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
