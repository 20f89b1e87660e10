"""Python environments with packages of the Python registry, made on first use; nothing is installed outside their folder.

usage: python_environment.py NAME FOLDER SCRIPT [WORD...]     runs the script in it; FOLDER is made if it is not there

Exit code 77: the packages could not be installed (no connection). Distributions have only some of them, and old ones.
"""
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TOOL = ROOT / "tools" / "pmdrive"
SKIPPED = 77  # exit code of a test that cannot be run here
# Name: packages, and whether our host tool comes with them
ENVIRONMENTS = {
    # independent readers and masters of CANopen
    "can": (("canopen==2.4.1", "python-can==4.6.1", "cantools==40.2.3", "eds-utils==0.3.1"), True),
    # independent readers of the pictures and measurement files of our host tool
    "recording": (("asammdf>=7,<9", "matplotlib>=3.5,<4", "plotext>=5.2,<6"), True),
    # tools/campaign: columnar files and clusters
    "campaign": (("pyarrow>=15,<22", "distributed>=2024.8,<2026", "matplotlib>=3.7,<4", "PyYAML>=6,<7"), False),
    # https://pypi.org/project/motulator: its models beside the plant, in tests/optional and tools/bench_motulator.py
    "motulator": (("motulator==0.5.0",), False),
}


def _skip(why):
    print(f"skipped: the environment could not be made: {why}")
    sys.exit(SKIPPED)


def _install(python, words):
    command = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *words]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        lines = (result.stderr or result.stdout).strip().splitlines() or ["no message"]
        _skip(lines[-1])


def _make(folder, python, packages, with_tool):
    print(f"making {folder} with {', '.join(packages)} (once)", flush=True)
    try:
        venv.create(folder, clear=True, with_pip=True)
    except (OSError, subprocess.CalledProcessError) as error:
        _skip(f"no virtual environment (on Debian: package python3-venv): {error}")
    with tempfile.TemporaryDirectory() as copy:  # installing writes beside the sources
        tool = Path(copy) / "pmdrive"
        if with_tool:
            shutil.copytree(TOOL, tool, ignore=shutil.ignore_patterns("*.egg-info", "build"))
        _install(python, [*packages, *([str(tool)] if with_tool else [])])


def _wanted(packages, with_tool):
    """What a folder must have been made of."""
    tool = [str(TOOL), (TOOL / "pyproject.toml").read_text(encoding="utf-8")] if with_tool else []
    return hashlib.sha256("\n".join([*packages, *tool]).encode()).hexdigest()


def execute(name, folder, words):
    """Goes on with that script in the environment; does not return."""
    packages, with_tool = ENVIRONMENTS[name]
    folder = Path(folder).absolute()
    python, complete = folder / "bin" / "python", folder / "complete"
    wanted = _wanted(packages, with_tool)
    if not complete.is_file() or complete.read_text(encoding="utf-8") != wanted:
        _make(folder, python, packages, with_tool)
        complete.write_text(wanted, encoding="utf-8")
    sys.stdout.flush()
    os.execv(python, [str(python), *map(str, words)])


def enter(name, folder):
    """Goes on with the calling script in the environment; returns once it is there."""
    if Path(sys.prefix) != Path(folder).absolute():
        execute(name, folder, sys.argv)


if __name__ == "__main__":
    if len(sys.argv) < 4 or sys.argv[1] not in ENVIRONMENTS:
        sys.exit(__doc__)
    execute(sys.argv[1], sys.argv[2], sys.argv[3:])
