"""What is asked of each row of the book, and whether its proof binds it: tests/acceptance.yaml. For book_map.py, which
refuses what is missing or looser, and results.py, which writes the table of all rows."""
import json
import math
import re
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parent.parent
FILE = "tests/acceptance.yaml"
FIGURES = "docs/results/tests.json"
NOTES = "docs/methods_notes.md"
ERRORS = re.compile(r"angle_error_(mean|max|rms|std)_deg")
WINDOW_S = 0.5  # METHODS.md 0.3: errors are taken over the last half second of a plateau
KEYS = {"asks", "twin", "metric", "measured", "bound", "max", "min", "max_abs", "equals", "scenario", "test", "is", "case", "not",
        "window_s", "also", "looser"}


def read(root=ROOT):
    """Row -> its asks and twins."""
    return {int(row): asks for row, asks in yaml.safe_load((root / FILE).read_text(encoding="utf-8")).items()}


def read_figures(root=ROOT):
    """Id of measured() -> value and bound, as tests wrote them when they were recorded."""
    path = root / FIGURES
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def limits(bounds, values):
    """Lowest and highest value that passes; $name stands for a value of `values`."""
    def number(key, otherwise):
        bound = bounds.get(key, otherwise)
        return float(values[bound[1:]] if isinstance(bound, str) and bound.startswith("$") else bound)
    if "max_abs" in bounds:
        size = number("max_abs", 0)
        return -size, size
    return number("min", -math.inf), number("max", math.inf)


def cases(document, ask):
    found = document.get("cases") or [{}]
    named = [(one.get("name", " ".join(f"{key}={value}" for key, value in one.items())), one) for one in found]
    return [one for name, one in named
            if str(ask.get("case", "")) in name and not ("not" in ask and str(ask["not"]) in name)]


def axes(document):
    """A value of each axis of the sweep, for a bound that is one."""
    return {key: values[0] for key, values in (document.get("sweep") or {}).items() if isinstance(values, list)}


def looser(item, ask, document):
    """Does the expectation allow what the ask does not?"""
    if "equals" in ask:
        return item.get("equals") != ask["equals"]
    allowed = dict(ask)
    if "looser" in ask:
        allowed = {key: ask["looser"]["to"] for key in ("max", "max_abs") if key in ask}
    low, high = limits(allowed, {})
    ends = [limits(item, {**axes(document), **case}) for case in cases(document, ask)]
    return not ends or any(first < low or last > high for first, last in ends)


def window(item, document):
    first, last = item.get("window_s", [0, document["duration_s"]])
    return float(last) - float(first) if not isinstance(first, str) and not isinstance(last, str) else WINDOW_S


def proofs(root, ask, section):
    """The scenario and those of its expectations that show what is asked, with their places."""
    document = yaml.safe_load((root / f"tests/scenario/{ask['scenario']}.yaml").read_text(encoding="utf-8"))
    sections = {section, *map(str, ask.get("also", ()))}
    wanted = ask.get("window_s", WINDOW_S if ERRORS.fullmatch(ask["metric"]) else 0)

    def over(item):
        if isinstance(wanted, list):
            return item.get("window_s") == wanted
        return window(item, document) > 0.999 * float(wanted)
    return document, [(place, item) for place, item in enumerate(document.get("expect", ()))
                      if item["metric"] == ask["metric"] and item["book"] in sections and over(item)]


def in_scenario(root, ask, section):
    name = f"{ask['scenario']}.yaml"
    if not (root / "tests/scenario" / name).exists():
        return f"tests/scenario/{name} is missing"
    document, found = proofs(root, ask, section)
    if not found:
        return f"{name} expects no {ask['metric']} for {section} over the window asked for"
    if not cases(document, ask):
        return f"{name} has no such case"
    if any(looser(item, ask, document) for _, item in found):
        return f"{name}: the bound of {ask['metric']} is looser than asked"
    return ""


def in_test(root, ask, recorded):
    path = root / f"tests/unit/{ask['test']}_test.cpp"
    if not path.exists():
        return f"{path.relative_to(root)} is missing"
    text = path.read_text(encoding="utf-8")
    if "is" in ask:
        suite, name = ask["is"].split(".")
        return "" if re.search(rf"TEST(_P|_F)?\({suite}, {name}\)", text) else f"{ask['test']} has no test {ask['is']}"
    if f'"{ask["measured"]}' not in text:
        return f"{ask['test']} measures no {ask['measured']}"
    bounds = [bound for name, (_, bound) in recorded.items() if name.startswith(ask["measured"])]
    if not bounds:
        return f"{FIGURES} has no {ask['measured']}: tools/results --tests"
    return f"{ask['test']}: the bound of {ask['measured']} is looser than asked" if max(bounds) > ask["max"] else ""


def marks(why):
    """How a heading of the notes, or a point of its lists, begins."""
    return f"\n## {why}\n", f"\n- **{why}**", f"\n- **{why}.**"


def faults(methods, root=ROOT):
    """What does not bind. methods: (row, section, name, state, ...)."""
    asked, recorded = read(root), read_figures(root)
    notes = (root / NOTES).read_text(encoding="utf-8")
    here = {row: section for row, section, _, state, *_ in methods if state == "IMPLEMENTED"}
    for row in sorted(here.keys() - asked.keys()):
        yield f"row {row} is implemented, but {FILE} asks nothing of it"
    for row in sorted(asked.keys() - here.keys()):
        yield f"{FILE}: row {row} is not implemented"
    for row in sorted(here.keys() & asked.keys()):
        if not any("asks" in ask for ask in asked[row]):
            yield f"{FILE}: row {row}: nothing is asked"
        for ask in asked[row]:
            where = f"{FILE}: row {row}, {ask.get('asks', ask.get('twin'))}"
            unknown = ask.keys() - KEYS
            if unknown:
                yield f"{where}: unknown {', '.join(sorted(unknown))}"
            if "looser" in ask and not any(mark in notes for mark in marks(ask["looser"]["why"])):
                yield f"{where}: {NOTES} has no heading \"{ask['looser']['why']}\""
            fault = in_scenario(root, ask, here[row]) if "scenario" in ask else in_test(root, ask, recorded)
            if fault:
                yield f"{where}: {fault}"


SECTION_OF = re.compile(r'^PM_METHOD\((\d+), "(.*?)", "(.*?)"', re.MULTILINE)
HEAD = """# What the specification asks, row by row

From `tests/acceptance.yaml`; `tools/book_map.py` refuses a row whose proof does not have its bound. Ratio: worst to bound, below 1
where it holds. Twins have the remedy off, or a parameter wrong: they must show the error that theory predicts.

| row | section | method | asked | bound | median | worst | ratio | shown by |
|---:|---|---|---|---|---:|---:|---:|---|
"""


def bound_of(ask):
    if "bound" in ask:
        return str(ask["bound"])
    if "equals" in ask:
        return ask["equals"]
    if "max_abs" in ask:
        return f"±{ask['max_abs']:g}"
    ends = [f"{sign} {ask[key]:g}" for key, sign in (("min", "≥"), ("max", "≤")) if key in ask]
    text = ", ".join(ends)
    return text if "looser" not in ask else f"{text}; here {ask['looser']['to']:g} ([why](methods_notes.md))"


def of_seeds(ask, items, case_names):
    """(median, worst, ratio) of the asked figure in the record of the scenario's expectations."""
    if "equals" in ask:
        return items[0]["median"], items[0]["value"], ""
    found = {}
    for key in ("min", "max", "max_abs"):
        pairs = [one["cases"][name][key] for one in items for name in one.get("cases", {}) if name in case_names or not case_names]
        if pairs and key in ask:
            pick = min if key == "min" else max
            found[key] = pick(pair[1] for pair in pairs), pick(pair[0] for pair in pairs)
    ratios = []
    for key, (_, worst) in found.items():
        bound = abs(ask[key])
        if bound and not ("min" in ask and "max" in ask):
            ratios.append(f"{bound / worst:.2f}" if key == "min" and worst else f"{abs(worst) / bound:.2f}")
    medians = " … ".join(f"{middle:.3g}" for middle, _ in found.values())
    return medians, " … ".join(f"{worst:.3g}" for _, worst in found.values()), ratios[0] if len(ratios) == 1 else ""


def page(record, measured=None, root=ROOT):
    names = {int(row): (section, name) for row, section, name
             in SECTION_OF.findall((root / "tools/pmsim/methods.def").read_text(encoding="utf-8"))}
    lines = []
    for row, asks in sorted(read(root).items()):
        section, name = names[row]
        for ask in asks:
            median = worst = ratio = ""
            if "scenario" in ask:
                document, found = proofs(root, ask, section)
                where = f"`{ask['scenario']}.yaml`"
                recorded = record.get(ask["scenario"], {"expectations": []})["expectations"]
                items = [recorded[place] for place, _ in found if place < len(recorded)]
                if items:
                    median, worst, ratio = of_seeds(ask, items, {one.get("name", "") for one in cases(document, ask)} - {""})
            else:
                where = f"`{ask['test']}`" + (f", {ask['is']}" if "is" in ask else "")
                values = [(float(value), float(bound)) for key, (value, bound) in (measured or {}).items()
                          if key.startswith(str(ask.get("measured")))]
                if values:
                    worst, ratio = f"{max(value for value, _ in values):.2g}", f"{max(v for v, _ in values) / ask['max']:.2g}"
            what = ask["asks"] if "asks" in ask else f"*twin*: {ask['twin']}"
            lines.append(f"| {row} | {section} | {name} | {what} | {bound_of(ask)} | {median} | {worst} | {ratio} | {where} |\n")
    return HEAD + "".join(lines)
