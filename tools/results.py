#!/usr/bin/env python3
"""Runs the scenarios of tests/scenario and writes what they measured: docs/results/scenarios.json, and from it docs/results.md
and the table of the README.

usage: results.py [--seeds N] [SCENARIO...]     measures all scenarios, or those named, each with N seeds (20)
       results.py --tests                       measures what tests write with measured(), and no scenario
       results.py --worst SCENARIO... [--out FOLDER]
                                                runs again what was each expectation's worst run, with its seed; records nothing.
                                                FOLDER/SCENARIO/result.json is the result, if wanted
       results.py --check [BUILD]               measures nothing: is the page what the records and tests/acceptance.yaml make
                                                it? With BUILD, the folder of a build whose tests were run with
                                                PMDRIVE_MEASURED=BUILD/measured.csv: do its values lie in the spread recorded?
"""
import argparse
import csv
import io
import json
import math
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import yaml

import acceptance
from acceptance import FIGURES, ROOT, read_figures

BUILD = ROOT / "out/build/host-release"
PMSIM = BUILD / "tools/pmsim/pmsim"
SCENARIOS = ROOT / "tests/scenario"
RECORD = "docs/results/scenarios.json"
PAGE = "docs/results.md"
README = "README.md"
PERFORMANCE = "docs/performance.md"
SPREAD = 0.1  # of the bound: by which a value may lie outside of those recorded
KEPT = "name", "metric", "pass", "value", "median", "best", "seeds", "bound", "unit", "book", "passed", "of", "worst_run"
HEAD = """# Results

What the closed loop does, measured on the switching-level plant by the scenarios of `tests/scenario`. Made by `tools/results`
with several seeds of noise each; a bound that does not hold fails `tools/check`, which makes the worst run of each line again.
Position errors are electrical degrees, truth minus estimate. A value is that of the worst run of a sweep: with the worst seed,
and with the median of the seeds.

"""


def steps_of(page, column):
    """Instructions of drive_step() at high speed and with injection, of one column of the page's table."""
    lines = page.splitlines()
    rows = [n for n, line in enumerate(lines) if re.match(r"\| (active flux, high speed|square-wave injection) \|", line)][:2]
    head = max(n for n in range(rows[0]) if column in lines[n])
    at = [cell.strip() for cell in lines[head].split("|")].index(column)
    return [lines[n].split("|")[at].strip() for n in rows]


def names():
    return sorted(path.stem for path in SCENARIOS.glob("*.yaml"))


def measure(name, seeds):
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.run([PMSIM, "run", SCENARIOS / f"{name}.yaml", "--seeds", str(seeds), "--quiet", "--out", folder],
                             capture_output=True, text=True, check=False)
        if run.returncode > 1:
            sys.exit(run.stderr)
        result = json.loads((Path(folder) / "result.json").read_text(encoding="utf-8"))
        path = Path(folder) / "runs.csv"
        with path.open(encoding="utf-8") if path.exists() else io.StringIO("") as file:
            runs = list(csv.reader(file))
    items = [{key: item[key] for key in KEPT} for item in result["expectations"]]
    for place, item in enumerate(items):
        item["cases"] = by_case(place - len(items), runs) if runs else one_run(item["value"])
    return {"title": result["title"], "runs": result["runs"], "simulated_s": result["simulated_s"], "expectations": items}


def run_worst(name, result, out):
    """What was each expectation's worst run, again; all runs with the scenario's own seed of one that is not recorded. True: all
    expectations hold."""
    items = result["expectations"] if result else []
    only = sorted({item["worst_run"] for item in items} - {""})
    chosen = (["--seeds", str(seeds_of(result))] if items else []) + [word for run in only for word in ("--only", run)]
    command = ["run", str((SCENARIOS / f"{name}.yaml").relative_to(ROOT)), *chosen]
    run = subprocess.run([PMSIM, *command, "--json"], capture_output=True, text=True, check=False, cwd=ROOT)
    if run.returncode > 1:
        sys.exit(f"{run.stderr}{name}.yaml: tools/results.py {name} measures it again" if result else run.stderr)
    if out:
        folder = Path(out) / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "result.json").write_text(run.stdout, encoding="utf-8")
    measured = json.loads(run.stdout)
    for item in measured["expectations"]:
        print(f"{'PASS' if item['pass'] else 'FAIL'}  {item['name']}: {number(item['value'])}, bound {item['bound']} {item['unit']}, "
              f"{item['passed']} of {item['of']}, worst: {item['worst_run']}")
    print(f"{measured['runs']} runs; with trace: pmsim {shlex.join([*command, '--out', f'out/{name}'])}", flush=True)
    return run.returncode == 0


def one_run(value):
    return {"": figures([[value]])} if isinstance(value, (int, float)) else {}


def by_case(place, runs):
    """Case -> of the runs of each seed the smallest, the largest and the largest magnitude: of all seeds, and their median.
    place: of the expectation, from the end; each has two columns."""
    head, rows = runs[0], runs[1:]
    found = {}
    for row in rows:
        try:
            value = float(row[2 * place])
        except ValueError:
            return {}  # a word
        case, seed = (row[head.index(name)] if name in head else "" for name in ("case", "seed"))
        found.setdefault(case, {}).setdefault(seed, []).append(value)
    return {case: figures(list(seeds.values())) for case, seeds in found.items()}


def figures(seeds):
    lows, highs = [min(values) for values in seeds], [max(values) for values in seeds]
    sizes = [max(map(abs, values)) for values in seeds]
    ends = {"min": min(lows), "max": max(highs), "max_abs": max(sizes)}
    middles = {"min": median(lows), "max": median(highs), "max_abs": median(sizes)}
    return {key: [round_figure(ends[key]), round_figure(middles[key])] for key in ends}


def round_figure(value):
    return float(f"{value:.4g}")


def write_record(record):
    lines = []
    for name, result in sorted(record.items()):
        items = ",\n  ".join(json.dumps(item, sort_keys=True) for item in result["expectations"])
        head = json.dumps({key: result[key] for key in ("title", "runs", "simulated_s")})[:-1]
        lines.append(f'"{name}": {head}, "expectations": [\n  {items}\n]}}')
    (ROOT / RECORD).write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def read_record():
    path = ROOT / RECORD
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def wanted_figures():
    """How the names begin that the rows ask for."""
    return tuple(ask["measured"] for asks in acceptance.read().values() for ask in asks if "measured" in ask)


def figures_of(path):
    """Id -> value and bound that measured() wrote last, of what is asked for."""
    wanted = wanted_figures()
    with path.open(encoding="utf-8") as file:
        return {row[0]: [float(row[1]), float(row[2])] for row in csv.reader(file) if row[0].startswith(wanted)}


def measure_tests():
    folders = sorted({ask["test"].split("/")[0] for asks in acceptance.read().values() for ask in asks if "measured" in ask})
    with tempfile.NamedTemporaryFile() as file:
        subprocess.run(["ctest", "--test-dir", str(BUILD), "--output-on-failure", "-L", "unit",
                        "-R", f"^({'|'.join(folders)})_", "-j", str(os.cpu_count())], check=True,
                       env={**os.environ, "PMDRIVE_MEASURED": file.name}, stdout=subprocess.DEVNULL)
        found = figures_of(Path(file.name))
    lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(pair)}" for name, pair in sorted(found.items()))
    (ROOT / FIGURES).write_text("{\n" + lines + "\n}\n", encoding="utf-8")


def number(value):
    return f"{value:.3g}" if isinstance(value, (int, float)) else "–" if value is None else str(value)


def table(result):
    lines = ["| what | worst seed | median | bound | unit | section | runs | worst run |", "|---|---|---|---|---|---|---|---|"]
    for item in result["expectations"]:
        verdict = "" if item["pass"] else " **FAIL**"
        lines.append(f"| `{item['name']}` | {number(item['value'])}{verdict} | {number(item['median'])} | {item['bound']} "
                     f"| {item['unit']} | {item['book']} | {item['passed']}/{item['of']} | {item['worst_run']} |")
    return "\n".join(lines)


def seeds_of(result):
    return result["expectations"][0]["seeds"]


def page(record):
    parts = [HEAD, acceptance.page(record, read_figures()), "\n# All scenarios\n"]
    for name, result in sorted(record.items()):
        parts.append(f"\n## {result['title']}\n\n`{name}.yaml`, {seeds_of(result)} seeds, {result['simulated_s']:.1f} s "
                     f"simulated\n\n{table(result)}\n")
    return "".join(parts)


def worst(record, names_of, metric):
    """The largest magnitude of a metric in some scenarios, over all seeds."""
    found = [abs(item["value"]) for name in names_of for item in record[name]["expectations"] if item["metric"] == metric]
    return max(found)


def up(value):
    """Rounded up to a tenth."""
    return f"{math.ceil(10 * value - 1e-9) / 10:.1f}"


def readme(record):
    """The table of the README, from the records."""
    starts, steady, effects = "ipm_start_grid", "ipm_steady_grid", "ipm_all_effects"
    count = record[starts]["runs"]
    wrong = [item for item in record[starts]["expectations"] if not item["pass"]]
    steps = steps_of((ROOT / PERFORMANCE).read_text(), "`foc`, mean")

    def mean_and_largest(name):
        return (f"mean position error ≤ {up(worst(record, [name], 'angle_error_mean_deg'))}°, "
                f"largest ≤ {up(worst(record, [name], 'angle_error_max_deg'))}°")
    return f"""
| | |
|---|---|
| {count} starts: 72 angles, both directions, without load and with 50 %, {seeds_of(record[starts])} seeds | {'NOT all' if wrong else 'all'} in the right direction, \
backward movement below {up(worst(record, [starts], 'backward_movement_deg_mech'))}° |
| 0 to 100 % speed, 0 to 100 % load | {mean_and_largest(steady)} |
| Load step 0 to 100 % at 2 % and 50 % speed; reversal through zero at 50 % load | \
≤ {up(worst(record, ['load_step', 'reversal'], 'angle_error_max_deg'))}° |
| 0 to 100 % speed and load with 5th and 7th EMF harmonics, output capacitance, switching delays, temperature drift and cogging | \
{mean_and_largest(effects)} |
| R +50 %, L_q −20 %, ψ −10 % in the firmware's parameters | starts and runs, errors as the theory predicts |
| One control period on Cortex-M4, gcc -O2 | {steps[0]} instructions at high speed, {steps[1]} with injection (mean; ST's kit 688, VESC 1391, \
phobia 1436); [the image](docs/performance.md) |

"""


def with_readme(record):
    text = (ROOT / README).read_text(encoding="utf-8")
    return re.sub(r"(?s)(<!-- measured -->\n).*?(<!-- end -->)", lambda found: found[1] + readme(record) + found[2], text)


def differs(item, now, expected):
    """Why a value does not belong to the record of it; "" if it does. expected: what the scenario's file says."""
    if item["bound"] != now["bound"]:
        if any("$" in str(expected.get(key)) for key in ("max", "min", "max_abs", "equals")):
            return ""  # another run is the worst, with a bound of its own
        return f"bound {now['bound']}, recorded {item['bound']}"
    ends = item["value"], item["best"]
    if any(not isinstance(x, (int, float)) for x in (*ends, now["value"])):
        return "" if now["value"] in ends else f"{now['value']}, recorded {ends[0]}"
    bounds = [abs(float(part)) for part in item["bound"].replace("+-", "").split() if part.lstrip("-")[:1].isdigit()]
    room = SPREAD * (max(bounds) if bounds and max(bounds) > 0 else 1)
    low, high = min(ends) - room, max(ends) + room
    if "+-" in item["bound"]:
        return "" if abs(now["value"]) <= max(map(abs, ends)) + room else f"{now['value']:.3g}, recorded {ends[0]:.3g}"
    return "" if low <= now["value"] <= high else f"{now['value']:.3g}, recorded {ends[1]:.3g} to {ends[0]:.3g}"


def stale_figures(path):
    """Of tests: another bound, or a value that is another by half and by a twentieth of its bound."""
    recorded, now = read_figures(), figures_of(path)
    for name, (value, bound) in sorted(recorded.items()):
        if name not in now:
            continue  # skipped where its data are not
        value_now, bound_now = now[name]
        if bound_now != bound:
            yield f"{name}: bound {bound_now:g}, recorded {bound:g}"
        elif abs(value_now - value) > max(0.5 * abs(value), 0.05 * abs(bound)):
            yield f"{name}: {value_now:.3g}, recorded {value:.3g}"
    for name in sorted(now.keys() - recorded.keys()):
        yield f"{name}: not in {FIGURES}; tools/results --tests measures it"


def unrecorded_figures():
    """Of the tests' sources: what is asked for, by a name that is written out. The others the build's values show."""
    recorded, wanted = read_figures(), wanted_figures()
    for path in sorted((ROOT / "tests/unit").rglob("*_test.cpp")):
        for name in re.findall(r'\bmeasured\("(\w+)",', path.read_text(encoding="utf-8")):
            if name.startswith(wanted) and name not in recorded:
                yield f"{name} of {path.relative_to(ROOT)}: not in {FIGURES}; tools/results --tests measures it"


def stale(record, build):
    """What the page says and no longer is so."""
    folder = build / "scenario" if build else None
    yield from unrecorded_figures()
    if build:
        yield from stale_figures(build / "measured.csv")
    for name in names():
        if name not in record:
            yield f"{name}.yaml: not in {RECORD}"
    for name in record.keys() - set(names()):
        yield f"{name}: in {RECORD}, but no scenario of it"
    for name, result in sorted(record.items()):
        path = folder / name / "result.json" if folder else None
        if not path or not path.exists():
            continue  # not run
        now = json.loads(path.read_text())["expectations"]
        if [item["metric"] for item in now] != [item["metric"] for item in result["expectations"]]:
            yield f"{name}.yaml: expects other things than were recorded"
            continue
        expected = yaml.safe_load((SCENARIOS / f"{name}.yaml").read_text(encoding="utf-8"))["expect"]
        for recorded, item, line in zip(result["expectations"], now, expected):
            why = differs(recorded, item, line)
            if why:
                yield f"{name}.yaml: {item['name']}: {why}"
    if (ROOT / PAGE).read_text(encoding="utf-8") != page(record):
        yield f"{PAGE}: not what {RECORD} and {acceptance.FILE} make"
    if (ROOT / README).read_text(encoding="utf-8") != with_readme(record):
        yield f"{README}: its table is not what {RECORD} and {PERFORMANCE} make"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--tests", action="store_true", help="measure what tests write, and no scenario")
    parser.add_argument("--worst", action="store_true", help="run again what was the worst run, and record nothing")
    parser.add_argument("--out", metavar="FOLDER", help="of --worst: for FOLDER/SCENARIO/result.json")
    parser.add_argument("--check", nargs="?", const="", metavar="BUILD",
                        help="measure nothing; fail when the page is not up to date, or a value of BUILD's tests is not in it")
    parser.add_argument("scenario", nargs="*", help="names of tests/scenario, without .yaml (default: all)")
    options = parser.parse_args()
    record = read_record()
    if options.check is not None:
        found = list(stale(record, Path(options.check) if options.check else None))
        if found:
            sys.exit("\n".join(found) + "\ntools/results SCENARIO... measures scenarios again")
        return
    unknown = sorted(set(options.scenario) - set(names()))
    if unknown:
        sys.exit(f"no scenario {', '.join(unknown)} in tests/scenario")
    chosen = [] if options.tests else options.scenario or names()
    if options.worst:
        sys.exit(0 if all([run_worst(name, record.get(name), options.out) for name in chosen]) else 1)
    if options.tests or not options.scenario:
        measure_tests()
    failed = []
    for count, name in enumerate(chosen, 1):
        start = time.monotonic()
        record[name] = measure(name, options.seeds)
        write_record(record)  # what was measured is not lost when the work is stopped
        bad = [item for item in record[name]["expectations"] if not item["pass"]]
        print(f"{count:3} of {len(chosen)}  {name}: {time.monotonic() - start:.0f} s", flush=True)
        for item in bad:
            print(f"     FAIL {item['name']}: {number(item['value'])}, bound {item['bound']}, "
                  f"{item['passed']} of {item['of']}, worst: {item['worst_run']}", flush=True)
        failed += bad
    record = {name: result for name, result in record.items() if name in names()}
    write_record(record)
    (ROOT / PAGE).write_text(page(record), encoding="utf-8")
    if set(names()) <= record.keys():
        (ROOT / README).write_text(with_readme(record), encoding="utf-8")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
