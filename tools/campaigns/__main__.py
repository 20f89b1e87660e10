"""Driver of tools/campaign; its help text says what it does."""

import argparse
import json
import shlex
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from campaigns import execute, judge, page, summary, worker  # noqa: E402
from campaigns.plan import Campaign, SourceError  # noqa: E402
from campaigns.pool import Pool, cores  # noqa: E402
from campaigns.store import DRAWN, Store, StoreError, record  # noqa: E402

PMSIM = ROOT / "out/build/host-release/tools/pmsim/pmsim"
OUT = ROOT / "out/campaign"
HELP = """Many runs of pmsim with drawn machines, and what became of them.

  tools/campaign run C.yaml                        all cores of this machine; results in out/campaign/C
  tools/campaign run C.yaml --scheduler HOST:8786  the workers of a Dask cluster
  tools/campaign show out/campaign/C               summary and picture again, of what is there so far
  tools/campaign replay out/campaign/C 17 --out DIR    run 17 once more, with its trace

A campaign that was stopped goes on when it is started again. docs/campaigns.md describes the files.
Exit code: 0 done and within its bounds, 1 a bound fails, 2 bad input, 130 stopped."""
SUMMARY, PICTURE, FIGURES = "summary.md", "page.png", "summary.json"


def fail(reason):
    print(f"campaign: {reason}", file=sys.stderr)
    sys.exit(2)


def write_summary(campaign, rows, folder, timing):
    page.draw(campaign, rows, folder / PICTURE)
    (folder / SUMMARY).write_text(summary.text(campaign, rows, PICTURE), encoding="utf-8")
    lines = summary.verdicts(campaign, rows)
    classes = {
        name: {"runs": n, "share": share, "low": low, "high": high}
        for name, n, share, low, high in summary.counted(campaign, rows)
    }
    figures = {
        "title": campaign.title,
        "runs": len(rows),
        "pass": all(good for good, _ in lines),
        "classes": classes,
        **timing,
    }
    (folder / FIGURES).write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return figures["pass"]


def say(campaign, rows, folder):
    print(campaign.title)
    for name, n, share, low, high in summary.counted(campaign, rows):
        print(
            f"  {name:20} {n:6} of {len(rows)}  {summary.percent(share):>7}   {summary.percent(low)} to {summary.percent(high)}"
        )
    for _, line in summary.verdicts(campaign, rows):
        print(line)
    print(f"{folder / SUMMARY}, {folder / PICTURE}")


def run(options):
    campaign = Campaign(options.campaign)
    if not options.pmsim.is_file():
        fail(f"{options.pmsim} is missing: build the preset host-release")
    folder = options.out or OUT / options.campaign.stem
    count = options.runs or campaign.count
    results = Store(folder, record(campaign, worker.digest(options.pmsim)))
    if options.fresh:
        results.clear()
    folder.mkdir(parents=True, exist_ok=True)
    execute.stop_on_signals()
    try:
        with Pool(options.scheduler, options.jobs) as pool:
            rows, timing = execute.execute(
                campaign, results, options.pmsim.resolve(), pool, count, options.chunk, not options.quiet
            )
    except KeyboardInterrupt:
        print(f"\nstopped: {len(results.rows())} of {count} runs are kept; the same command goes on", file=sys.stderr)
        return 130
    good = write_summary(campaign, rows, folder, timing)
    if not options.quiet:
        say(campaign, rows, folder)
    if timing and not options.quiet:
        print(
            f"{timing['simulated_per_wall_s']:.1f} simulated s per wall s on {timing['cores']} cores, of which pmsim had "
            f"{100 * timing['at_work']:.0f} %"
        )
    return 0 if good else 1


def stored(folder):
    folder = folder.parent if folder.suffix == ".parquet" else folder
    results = Store(folder)
    rows = results.rows()
    if not rows:
        fail(f"{folder}: no results of a campaign")
    return folder, results, rows


def show(options):
    folder, results, rows = stored(options.results)
    campaign = Campaign.stored(results.what)
    good = write_summary(campaign, rows, folder, {})
    say(campaign, rows, folder)
    return 0 if good else 1


def replay(options):
    _, results, rows = stored(options.results)
    row = next((row for row in rows if row["run"] == options.number), None)
    if row is None:
        fail(f"there is no run {options.number}; there are {rows[0]['run']} to {rows[-1]['run']}")
    print(f"run {row['run']}, {row['group'] or 'no group'}: {row['class']}{': ' if row['cause'] else ''}{row['cause']}")
    for name in row:
        if name.startswith(DRAWN) and row[name] is not None:
            print(
                f"  {name.removeprefix(DRAWN):24} {row[name] if isinstance(row[name], str) else format(row[name], '.6g')}"
            )
    if not row["machine"]:
        print(f"refused: {row['error']}")
        return 0
    folder = options.out
    folder.mkdir(parents=True, exist_ok=True)
    machine, scenario = folder / "machine.yaml", folder / results.what["scenario_file"]
    machine.write_text(row["machine"], encoding="utf-8")
    scenario.write_text(results.what["scenario"], encoding="utf-8")
    settings = [f"{name}={value}" for name, value in json.loads(row["settings"]).items()] + [f"machine={machine}"]
    words = ["--out", str(folder)] + (["--decimate", str(options.decimate)] if options.decimate else [])
    sets = " ".join(f"--set {shlex.quote(setting)}" for setting in settings)
    print(f"{options.pmsim} run {scenario} {sets} {' '.join(words)}")
    if worker.digest(options.pmsim) != results.what["pmsim"]:
        print("note: pmsim is another build than that of the campaign; the run may differ")
    code, out, errors = worker.pmsim(options.pmsim, scenario, settings, *words)
    print(out + errors, end="")
    return 2 if code > 1 and not judge.refused(errors) else 0


def arguments():
    parser = argparse.ArgumentParser(
        prog="tools/campaign", description=HELP, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--pmsim", type=Path, default=PMSIM, help=argparse.SUPPRESS)
    commands = parser.add_subparsers(dest="command", required=True, metavar="run | show | replay")
    one = commands.add_parser("run", help="make the runs that are not there yet")
    one.add_argument("campaign", type=Path, help="campaign file (YAML)")
    one.add_argument("--runs", type=positive, help="so many in place of the file's `runs`")
    one.add_argument("--out", type=Path, help="folder of the results (default: out/campaign/NAME)")
    one.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster, as tcp://host:8786")
    one.add_argument(
        "--jobs", type=positive, default=cores(), help="runs at a time on this machine (default: %(default)s)"
    )
    one.add_argument(
        "--chunk", type=positive, help="runs handed over at a time (default: 1 to 16, as their number asks)"
    )
    one.add_argument("--fresh", action="store_true", help="drop results that are there")
    one.add_argument("--quiet", action="store_true", help="no progress, no summary on the terminal")
    one.set_defaults(do=run)
    one = commands.add_parser("show", help="summary and picture of results")
    one.add_argument("results", type=Path, help="folder of the results, or its runs.parquet")
    one.set_defaults(do=show)
    one = commands.add_parser("replay", help="one run again, with its trace")
    one.add_argument("results", type=Path, help="folder of the results, or its runs.parquet")
    one.add_argument("number", type=int, help="of the run")
    one.add_argument("--out", type=Path, required=True, help="folder for machine, scenario, trace.csv and result.json")
    one.add_argument("--decimate", type=positive, help="one trace row every N periods")
    one.set_defaults(do=replay)
    return parser.parse_args()


def positive(text):
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError("1 or more")
    return value


def main():
    options = arguments()
    try:
        return options.do(options)
    except (SourceError, StoreError, worker.Failed, OSError) as error:
        return fail(error)


if __name__ == "__main__":
    sys.exit(main())
