#!/usr/bin/env python3
"""Writes docs/book.md: for every section of the book its row, the sources that name it, its test and its result.

usage: book_map.py [--check] [--root DIR]

Rows and sections are those of tools/pmsim/methods.def, with the proofs of what belongs to no list; a method of a list says
in `book` of its own x.yaml which rows it implements, and tools/pmsim/methods_of_lists.def is made from these. A source belongs to the rows that its comments name
("row 14", "rows 21 to 23"). Refused are orphans: a row that is there without a source or whose proof is missing, and
a source that names a row which is not there; also a proof that does not have the bound asked of its row (acceptance.py). --check writes nothing and fails also when the page is not up to date.
"""
import argparse
import re
import sys
from pathlib import Path

import acceptance

METHOD = re.compile(r'^PM_METHOD\((\d+), "(.*?)", "(.*?)", [A-Z_ |]+, (\w+), "(.*?)", "(.*?)"\)', re.MULTILINE)
CLAIM = re.compile(r'- \{row: (\d+), parameter: (?:""|(\w+)), proof: ([\w/]+)\}')
CLAIMS = "observers/*.yaml", "injection/**/*.yaml", "bldc/**/*.yaml", "firmware/control/*.yaml", "firmware/drive/**/*.yaml"
CLAIMED = "tools/pmsim/methods_of_lists.def"
NUMBERS = r"\d+(?:[\s*/]*(?:,|and|to)[\s*/]*\d+)*"  # also over the end of a comment's line
ROWS = re.compile(rf"\brows?[\s*/]+({NUMBERS})", re.IGNORECASE)
MANUALS = ".h", ".cpp"  # where a first comment is the manual: headers, and the programs of tools
FOLDERS = "firmware", "observers", "injection", "bldc", "sim_plant", "tools"
HEAD = """# Map of the book

Made by `tools/book_map.py`; the build fails when it is not up to date, when a method has no source or no proof, or when a
source names a method that `pmsim methods` does not have. Sources name the rows that they implement in their first comment.

| section | row | method | source | selected by | proof | result |
|---|---:|---|---|---|---|---|
"""


def numbers(text):
    """ "12, 14 and 21 to 23" -> 12, 14, 21, 22, 23"""
    found = []
    for first, last in re.findall(r"(\d+)(?:[\s*/]+to[\s*/]+(\d+))?", text):
        found += range(int(first), int(last or first) + 1)
    return found


def sources(root):
    """Row -> files that name it."""
    found = {}
    for folder in FOLDERS:
        for path in sorted(p for p in (root / folder).rglob("*") if p.suffix in MANUALS):
            for match in ROWS.finditer(path.read_text(encoding="utf-8")):
                for row in numbers(match.group(1)):
                    found.setdefault(row, set()).add(path.relative_to(root).as_posix())
    return found


def proof_of(scenario):
    return f"tests/unit/{scenario}_test.cpp" if "/" in scenario else f"tests/scenario/{scenario}.yaml"


def result_of(scenario):
    if scenario.startswith("sim_plant/"):
        return "[plant.md](plant.md)"
    return "in the test" if "/" in scenario else "[results.md](results.md)"


class Refused(Exception):
    """A line that cannot be meant, with its file and number."""


def claims(root):
    """Row -> (parameter, proof) of what the methods of the lists say in `book`."""
    found = {}
    for path in sorted({path for pattern in CLAIMS for path in root.glob(pattern)}):
        inside = False
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            if not inside or not line.startswith("-"):
                inside = line == "book:"
                continue
            where = f"{path.relative_to(root).as_posix()}:{number}"
            claim = CLAIM.fullmatch(line)
            if not claim:
                raise Refused(f"{where}: not {{row: N, parameter: name or none or \"\", proof: scenario or folder/test}}")
            row = int(claim[1])
            if row in found:
                raise Refused(f"{where}: row {row} is claimed already")
            found[row] = claim[2] or "", claim[3]
    return found


def read(root):
    methods = [(int(row), *rest) for row, *rest in METHOD.findall((root / "tools/pmsim/methods.def").read_text())]
    claimed = claims(root)
    for row in claimed.keys() - {row for row, _, _, state, _, _ in methods if state == "NOT_YET"}:
        raise Refused(f"row {row} of a method's `book` is not one of the book, or has its proof in tools/pmsim/methods.def")
    return [(row, section, name, "IMPLEMENTED", *claimed[row]) if row in claimed else (row, section, name, *rest)
            for row, section, name, *rest in methods]


def claimed_rows(root):
    lines = "".join(f'PM_CLAIM({row}, "{parameter}", "{proof}")\n' for row, (parameter, proof) in sorted(claims(root).items()))
    return "/* Made by tools/book_map.py from `book` of the methods of the lists: PM_CLAIM(row, parameter, scenario). */\n" + lines


def orphans(root, methods, files):
    here = {row for row, _, _, state, _, _ in methods if state == "IMPLEMENTED"}
    for row, _, name, state, _, scenario in methods:
        if state == "IMPLEMENTED":
            if row not in files:
                yield f"row {row}, {name}: no source names it"
            if not (root / proof_of(scenario)).exists():
                yield f"row {row}, {name}: {proof_of(scenario)} is missing"
    for row in sorted(files.keys() - here):
        for path in sorted(files[row]):
            yield f"{path}: row {row} is not implemented, says tools/pmsim/methods.def"


def link(path):
    return f"[{Path(path).name}](../{path})"


def page(methods, files):
    lines = []
    for row, section, name, state, parameter, scenario in methods:
        if state == "IMPLEMENTED":
            where = " ".join(link(path) for path in sorted(files.get(row, ())))
            selected = {"": "always", "none": "in no image yet"}.get(parameter, f"`{parameter}`")
            cells = where, selected, link(proof_of(scenario)), result_of(scenario)
        else:
            cells = "not yet", "", "", ""
        lines.append(f"| {section} | {row} | {name} | " + " | ".join(cells) + " |\n")
    done = [method[4] for method in methods if method[3] == "IMPLEMENTED"]
    return HEAD + "".join(lines) + f"\n{len(done)} of {len(methods)} rows, {done.count('none')} of them in no image yet.\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--root", type=Path, default=Path(__file__).resolve().parent.parent)
    options = parser.parse_args()
    try:
        methods, files = read(options.root), sources(options.root)
    except Refused as refused:
        sys.exit(str(refused))
    found = list(orphans(options.root, methods, files)) + list(acceptance.faults(methods, options.root))
    for name, text in ("docs/book.md", page(methods, files)), (CLAIMED, claimed_rows(options.root)):
        path = options.root / name
        if not options.check:
            path.write_text(text)
        elif not path.exists() or path.read_text() != text:
            found.append(f"{name} is not up to date: run tools/book_map.py")
    for line in found:
        print(line, file=sys.stderr)
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
