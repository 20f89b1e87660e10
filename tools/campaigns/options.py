"""Words of tools/campaign. Of the standard library alone: run as a program, it says what is wrong with them, or the help, before
anything is installed."""

import argparse
from pathlib import Path

PMSIM = Path(__file__).resolve().parents[2] / "out/build/host-release/tools/pmsim/pmsim"
HELP = """Many runs of pmsim with drawn machines, and what became of them.

  tools/campaign run C.yaml                        all cores of this machine; results in out/campaign/C
  tools/campaign run C.yaml --scheduler HOST:8786  the workers of a Dask cluster
  tools/campaign show out/campaign/C               summary and picture again, of what is there so far
  tools/campaign replay out/campaign/C 17 --out DIR    run 17 once more, with its trace

A campaign that was stopped goes on when it is started again. docs/campaigns.md describes the files.
Exit code: 0 done and within its bounds, 1 a bound fails, 2 bad input, 130 stopped."""


def arguments(words=None):
    """They make sense: files that are to be read are there."""
    parser = argparse.ArgumentParser(
        prog="tools/campaign",
        description=HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,  # tools/campaign looks for --help
    )
    parser.add_argument("--pmsim", type=Path, default=PMSIM, help=argparse.SUPPRESS)
    commands = parser.add_subparsers(dest="command", required=True, metavar="run | show | replay")
    one = commands.add_parser("run", help="make the runs that are not there yet", allow_abbrev=False)
    one.add_argument("campaign", type=existing, help="campaign file (YAML)")
    one.add_argument("--runs", type=positive, help="so many in place of the file's `runs`")
    one.add_argument("--out", type=Path, help="folder of the results (default: out/campaign/NAME)")
    one.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster, as tcp://host:8786")
    one.add_argument("--jobs", type=positive, help="runs at a time on this machine (default: one a core)")
    one.add_argument(
        "--chunk", type=positive, help="runs handed over at a time (default: 1 to 16, as their number asks)"
    )
    one.add_argument("--fresh", action="store_true", help="drop results that are there")
    one.add_argument("--quiet", action="store_true", help="no progress, no summary on the terminal")
    one = commands.add_parser("show", help="summary and picture of results", allow_abbrev=False)
    one.add_argument("results", type=existing, help="folder of the results, or its runs.parquet")
    one = commands.add_parser("replay", help="one run again, with its trace", allow_abbrev=False)
    one.add_argument("results", type=existing, help="folder of the results, or its runs.parquet")
    one.add_argument("number", type=int, help="of the run")
    one.add_argument("--out", type=Path, required=True, help="folder for machine, scenario, trace.csv and result.json")
    one.add_argument("--decimate", type=positive, help="one trace row every N periods")
    return parser.parse_args(words)


def existing(text):
    path = Path(text)
    if not path.exists():
        raise argparse.ArgumentTypeError(f"there is no {text}")
    return path


def positive(text):
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError("1 or more")
    return value


if __name__ == "__main__":
    arguments()
