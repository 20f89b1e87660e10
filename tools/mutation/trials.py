"""The tests of the build with mutants: what each reaches, what it takes, and whether it sees a mutant."""
import json
import os
import re
import resource
import shlex
import signal
import subprocess
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path

from tree import BUILD, OUT, TREE

MEMORY = 4 << 30  # bytes, of a test


@dataclass
class Test:
    name: str
    command: list
    folder: str
    environment: dict
    label: str
    seconds: float = 0.0  # of the processor
    reached: set = field(default_factory=set)


def listed(labels, left_out):
    """The tests of the build that have one of the labels."""
    command = ["ctest", "--show-only=json-v1"]
    listing = subprocess.run(command, cwd=BUILD, capture_output=True, text=True, check=True).stdout
    tests = []
    for entry in json.loads(listing)["tests"]:
        facts = {p["name"]: p["value"] for p in entry.get("properties", [])}
        label = (facts.get("LABELS") or [""])[0]
        command = entry.get("command")
        if label not in labels or not command or re.search(left_out, entry["name"]) or facts.get("RUN_SERIAL"):
            continue
        if not all(Path(word).exists() for word in command if word.startswith(str(BUILD)) and "--out" not in command):
            continue
        environment = dict(word.split("=", 1) for word in facts.get("ENVIRONMENT", []))
        tests.append(Test(entry["name"], command, facts.get("WORKING_DIRECTORY", str(BUILD)), environment, label))
    return tests


def _limits(seconds):
    def apply():
        os.setsid()
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 2))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 30, 1 << 30))
    return apply


def run(test, variables, limit, scratch):
    """Exit code (None: did not end in time) and processor seconds. The limit is in processor seconds: a busy machine
    does not make a mutant time out."""
    command = [str(scratch) if word.startswith(f"{BUILD}/scenario") else word for word in test.command]
    environment = {**os.environ, **test.environment, **variables, "TMPDIR": str(scratch)}
    environment.pop("GTEST_FILTER", None)
    before = time.monotonic()
    nothing = subprocess.DEVNULL
    with subprocess.Popen(command, cwd=test.folder, env=environment, stdin=nothing, stdout=nothing, stderr=nothing,
                          preexec_fn=_limits(limit)) as process:
        # One that waits for something uses no processor.
        timer = threading.Timer(20 + 10 * limit, os.killpg, (process.pid, signal.SIGKILL))
        timer.start()
        _, status, usage = os.wait4(process.pid, 0)
        timer.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
    used = usage.ru_utime + usage.ru_stime
    code = process.returncode
    if code in (-signal.SIGXCPU, -signal.SIGKILL) or time.monotonic() - before > 20 + 10 * limit:
        return None, used
    return code, used


def scratch_folders(jobs):
    return [Path(tempfile.mkdtemp(prefix="mutate-", dir=OUT)) for _ in range(jobs)]


class Workers:
    """Threads with a folder each for what tests write."""

    def __init__(self, jobs):
        self._pool = ThreadPoolExecutor(jobs)
        self._free = scratch_folders(jobs)
        self._lock = threading.Lock()

    def map(self, function, items):
        """(item, result) in the order in which they end."""
        def call(item):
            with self._lock:
                folder = self._free.pop()
            try:
                return item, function(item, folder)
            finally:
                with self._lock:
                    self._free.append(folder)
        return (future.result() for future in as_completed([self._pool.submit(call, item) for item in items]))


def record(tests, count, longest, workers):
    """Runs each test once without a mutant. Those that fail, that take too long or that reach none are left out."""
    memory = OUT / "too_long.json"
    too_long = set(json.loads(memory.read_text())) if memory.exists() else set()

    def one(test, scratch):
        with tempfile.NamedTemporaryFile(dir=OUT) as file:
            file.truncate(max(1, count))
            code, test.seconds = run(test, {"PM_MUTANT_REACHED": file.name}, longest, scratch)
            data = Path(file.name).read_bytes()
        test.reached = {n for n, byte in enumerate(data) if byte}
        return code

    tests = [test for test in tests if test.name not in too_long]
    used, failed = [], []
    for test, code in workers.map(one, tests):
        if code == 0 and test.reached:
            used.append(test)
        elif code is None:
            too_long.add(test.name)
        elif code not in (0, 77):
            failed.append(shlex.join(test.command))
    memory.write_text(json.dumps(sorted(too_long)))
    return sorted(used, key=lambda t: t.seconds), failed


def kill(number, file, tests, most, scratch):
    """Tries one mutant, first on the tests of its file and folder, else quick ones first, for `most` processor seconds.
    Returns the verdict and the test that gave it."""
    reached, used = False, 0.0
    own, folder = f"_{Path(file).stem}.", f"_{Path(file).parent.name}."
    for test in sorted(tests, key=lambda t: (own not in t.name, folder not in t.name, t.seconds)):
        if number not in test.reached:
            continue
        if reached and used > most:
            break
        reached = True
        code, seconds = run(test, {"PM_MUTANT_ALIVE": str(number)}, 3 * test.seconds + 1, scratch)
        used += seconds
        if code is None:
            return "timed out", test.name
        if code != 0:
            return "killed", test.name
    return ("survived", "") if reached else ("not reached", "")


__all__ = ["TREE", "Workers", "kill", "listed", "record"]
