"""Runs pmsim. Of the standard library alone, since it is also sent to workers that have nothing of this project but
pmsim."""

import csv
import hashlib
import json
import os
import signal
import subprocess
import tempfile
from pathlib import Path

STOPPED = signal.SIGINT, signal.SIGTERM, signal.SIGKILL
_digests = {}
_running, _stopping = set(), []  # no locks, which cannot be sent


class Failed(Exception):
    """pmsim could not be run, or was stopped: no result of a run."""


def digest(program):
    """Of a program, read once."""
    state = os.stat(program)
    key = str(program), state.st_mtime_ns, state.st_size
    if key not in _digests:
        _digests[key] = hashlib.sha256(Path(program).read_bytes()).hexdigest()
    return _digests[key]


def check_program(program, wanted):
    """Every worker must have the same pmsim at the same place."""
    try:
        found = digest(program)
    except OSError as error:
        raise Failed(f"{os.uname().nodename}: no pmsim: {error}; build it there, or share the folder") from None
    if found != wanted:
        raise Failed(f"{os.uname().nodename}: {program} is another build; copy this machine's, or share the folder")


def stop():
    """Ends what runs in this process; nothing is begun after it."""
    _stopping.append(True)
    for process in list(_running):
        process.terminate()


def pmsim(program, scenario, settings=(), *words):
    """(exit code, output, errors) of `pmsim run`. settings: name=value."""
    sets = [word for setting in settings for word in ("--set", setting)]
    command = [str(program), "run", str(scenario), *sets, *map(str, words)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    _running.add(process)
    if _stopping:
        process.terminate()
    try:
        out, errors = process.communicate()
    finally:
        _running.discard(process)
    if -process.returncode in STOPPED:
        raise Failed("pmsim was stopped")
    return process.returncode, out, errors


def run_one(program, folder, scenario, job, *words):
    """A job is {"machine": text or None, "settings": {name: value}}; returns what `--json` says, or {"error": text}."""
    settings = [f"{name}={value}" for name, value in job["settings"].items()]
    if job["machine"] is not None:
        path = Path(folder) / "machine.yaml"
        path.write_text(job["machine"], encoding="utf-8")
        settings.append(f"machine={path}")
    code, out, errors = pmsim(program, scenario, settings, "--jobs", 1, "--json", *words)
    if code in (0, 1):
        return json.loads(out)
    return {"error": errors.strip() or f"pmsim ended with {code}"}


def run_chunk(program, wanted, name, scenario, jobs):
    """Results of some jobs. scenario: text; name: of its file, for messages."""
    check_program(program, wanted)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_text(scenario, encoding="utf-8")
        return [run_one(program, folder, path, job) for job in jobs]


def run_file(program, wanted, scenario, settings=(), words=()):
    """{"code", "errors", "rows", "trace"} of a scenario, which may have cases: a row a run, below one that says what the
    columns are; the trace as text, if words ask for one. scenario: text."""
    check_program(program, wanted)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path, table = folder / "study.yaml", folder / "runs.csv"
        path.write_text(scenario, encoding="utf-8")
        code, out, errors = pmsim(program, path, settings, "--jobs", 1, "--out", folder, *words)
        if code > 1:
            return {"code": code, "errors": errors or out}
        if table.exists():
            with table.open(encoding="utf-8") as file:
                rows = list(csv.reader(file))
        else:
            one = json.loads((folder / "result.json").read_text(encoding="utf-8"))["expectations"]
            rows = [[item["name"] for item in one], ["nan" if item["value"] is None else item["value"] for item in one]]
        trace = (folder / "trace.csv").read_text(encoding="utf-8") if words else ""
        return {"code": code, "errors": errors, "rows": rows, "trace": trace}
