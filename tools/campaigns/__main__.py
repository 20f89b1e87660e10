"""Driver of tools/campaign; the help text in options.py says what it does."""

import json
import os
import shlex
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from campaigns import execute, judge, page, summary, worker  # noqa: E402
from campaigns.options import arguments  # noqa: E402
from campaigns.plan import Campaign, SourceError  # noqa: E402
from campaigns.pool import Pool  # noqa: E402
from campaigns.store import DRAWN, Store, StoreError, record  # noqa: E402

OUT = ROOT / "out/campaign"
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


def say(campaign, rows, folder, timing=None):
    """A reader that has enough, as `head`, does not change the verdict."""
    lines = [campaign.title]
    for name, n, share, low, high in summary.counted(campaign, rows):
        lines.append(
            f"  {name:20} {n:6} of {len(rows)}  {summary.percent(share):>7}   {summary.percent(low)} to {summary.percent(high)}"
        )
    lines += [line for _, line in summary.verdicts(campaign, rows)]
    lines.append(f"{folder / SUMMARY}, {folder / PICTURE}")
    if timing:
        lines.append(
            f"{timing['simulated_per_wall_s']:.1f} simulated s per wall s on {timing['cores']} cores, of which pmsim had "
            f"{100 * timing['at_work']:.0f} %"
        )
    try:
        for line in lines:
            print(line, flush=True)
    except BrokenPipeError:
        nobody_reads()


def nobody_reads():
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


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
        say(campaign, rows, folder, timing)
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
    print(out + errors, end="", flush=True)
    return 2 if code > 1 and not judge.refused(errors) else 0


def main():
    options = arguments()
    try:
        return {"run": run, "show": show, "replay": replay}[options.command](options)
    except BrokenPipeError:
        nobody_reads()
        return 0
    except (SourceError, StoreError, worker.Failed, OSError) as error:
        return fail(error)


if __name__ == "__main__":
    sys.exit(main())
