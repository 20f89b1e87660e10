"""A Python environment with the host tool and independent readers of what the generator makes.

usage: environment.py FOLDER SCRIPT [WORD...]     runs the script in it; FOLDER is made if it is not there

Exit code 77: the packages could not be installed from the Python registry (no connection). Distributions have only
some of them, and old ones. Nothing is installed outside the folder.
"""
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("canopen==2.4.1", "python-can==4.6.1", "cantools==40.2.3", "eds-utils==0.3.1")
TOOL = ROOT / "tools" / "pmdrive"
SKIPPED = 77


def skip(why):
    print(f"skipped: the environment could not be made: {why}")
    sys.exit(SKIPPED)


def make(folder, python, wanted):
    print(f"making {folder} (once)", flush=True)
    try:
        venv.create(folder, clear=True, with_pip=True)
    except (OSError, subprocess.CalledProcessError) as error:
        skip(f"no virtual environment (on Debian: package python3-venv): {error}")
    with tempfile.TemporaryDirectory() as copy:  # installing writes beside the sources
        shutil.copytree(TOOL, Path(copy) / "pmdrive", ignore=shutil.ignore_patterns("*.egg-info", "build"))
        command = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *PACKAGES,
                   str(Path(copy) / "pmdrive")]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        lines = (result.stderr or result.stdout).strip().splitlines() or ["no message"]
        skip(lines[-1])
    (folder / "complete").write_text(wanted, encoding="utf-8")


def main():
    folder = Path(sys.argv[1]).absolute()
    python = folder / "bin" / "python"
    complete = folder / "complete"
    project = (TOOL / "pyproject.toml").read_text(encoding="utf-8")
    wanted = hashlib.sha256("\n".join([*PACKAGES, str(TOOL), project]).encode()).hexdigest()
    if not complete.is_file() or complete.read_text(encoding="utf-8") != wanted:
        make(folder, python, wanted)
    sys.stdout.flush()
    os.execv(python, [str(python), *sys.argv[2:]])


if __name__ == "__main__":
    main()
