"""A Python environment with motulator (https://pypi.org/project/motulator), made on first use.

For tests/optional and tools/bench_motulator.py, which compare the plant with motulator's models. Nothing else of the
project needs it, and nothing of it is installed outside its folder.
"""
import os
import subprocess
import sys
import venv
from pathlib import Path

VERSION = "0.5.0"
REQUIREMENT = f"motulator=={VERSION}"
SKIPPED = 77  # exit code of a test that cannot be run here


def _skip(why):
    print(f"skipped: {REQUIREMENT} could not be installed from the Python registry: {why}")
    sys.exit(SKIPPED)


def _run(command):
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        lines = (result.stderr or result.stdout).strip().splitlines() or ["no message"]
        _skip(f"{' '.join(command[1:4])}: {lines[-1]}")


def _install(folder, python):
    print(f"making {folder} with {REQUIREMENT} (once)", flush=True)
    try:
        venv.create(folder, clear=True, with_pip=True)
    except (OSError, subprocess.CalledProcessError) as error:
        _skip(f"no virtual environment (on Debian: package python3-venv): {error}")
    _run([str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", REQUIREMENT])
    (folder / "complete").write_text(REQUIREMENT + "\n", encoding="utf-8")


def enter(folder):
    """Goes on with the calling script in the environment of that folder; returns once it is there."""
    folder = Path(folder).absolute()
    if Path(sys.prefix) == folder:
        return
    python = folder / "bin" / "python"
    complete = folder / "complete"
    if not complete.is_file() or complete.read_text(encoding="utf-8").strip() != REQUIREMENT:
        _install(folder, python)
    sys.stdout.flush()
    os.execv(python, [str(python), *sys.argv])
