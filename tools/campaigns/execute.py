"""Makes the runs of a campaign that are not there yet, and keeps each chunk as it is done."""

import signal
import sys
import time

from . import judge, store, worker
from .plan import SourceError

CHUNK_MOST = 16
CHUNKS_PER_CORE = 8  # at least: the last chunks then cost little time in which cores have nothing to do
SAID_EVERY_S = 30  # where there is no terminal


def chunk_size(count, cores):
    return max(1, min(CHUNK_MOST, count // (CHUNKS_PER_CORE * cores)))


class Progress:
    def __init__(self, done, count, stream=sys.stderr):
        self.done, self.first, self.count, self.stream = done, done, count, stream
        self.start = self.said = time.monotonic()
        self.simulated_s, self.classes = 0.0, {}

    def add(self, rows):
        self.done += len(rows)
        for one in rows:
            self.simulated_s += one["simulated_s"]
            self.classes[one["class"]] = self.classes.get(one["class"], 0) + 1
        now, terminal = time.monotonic(), self.stream.isatty()
        if not terminal and now - self.said < SAID_EVERY_S and self.done < self.count:
            return
        self.said = now
        wall = max(now - self.start, 1e-9)
        left = wall / (self.done - self.first) * (self.count - self.done)
        classes = ", ".join(f"{name} {n}" for name, n in sorted(self.classes.items(), key=lambda x: -x[1]))
        rate = self.simulated_s / wall
        line = f"{self.done} of {self.count} runs, {rate:.1f} x real time, {left / 60:.1f} min left: {classes}"
        print(
            f"\r{line[:118]:118}" if terminal else line,
            end="" if terminal and self.done < self.count else "\n",
            file=self.stream,
            flush=True,
        )


def missing(campaign, count, done, size):
    """Chunks of runs that are not there."""
    chunk = []
    for number in range(count):
        if number not in done:
            chunk.append(campaign.run(number))
            if len(chunk) == size:
                yield chunk
                chunk = []
    if chunk:
        yield chunk


def checked(campaign, run, result):
    """A run that pmsim cannot read is an error of the campaign's file, and said with its place there. What does not
    stand in it is what tools/tune.py has chosen, and the run is refused with that."""
    if "error" not in result or judge.refused(result["error"]):
        return result
    head, _, rest = result["error"].partition("machine.yaml:")
    line, _, text = rest.partition(":")
    column, _, after = text.partition(":")
    reason = (after if column.isdigit() else text).strip()
    if not line.isdigit():
        raise SourceError(f"{campaign.path}: run {run.number}: {head}")
    place = campaign.place_of(run.machine, int(line))
    if place is not None:
        raise SourceError(f"{place}: run {run.number}: {reason}")
    return {"error": reason}


def stop_on_signals():
    """SIGTERM as Ctrl-C, which a shell's background processes do not hear."""

    def stop(*_):
        raise KeyboardInterrupt

    for one in signal.SIGINT, signal.SIGTERM:
        signal.signal(one, stop)


def execute(campaign, results, program, pool, count, chunk=None, progress=True):
    """(rows of the campaign's first `count` runs, figures of what was made now). What is stored is not made again."""
    rows = {row["run"]: row for row in results.rows()}
    done = {number for number in rows if number < count}
    if len(done) == count:
        return [rows[number] for number in sorted(rows)], {}
    size = chunk or chunk_size(count - len(done), pool.cores)
    digest = worker.digest(program)
    shown = Progress(len(done), count) if progress else None

    def task(runs):
        """Refused ones need no pmsim."""
        jobs = [run.job() for run in runs if not run.refusal]
        return worker.run_chunk, str(program), digest, campaign.scenario_path.name, campaign.texts["scenario"], jobs

    start = time.monotonic()
    waiting = {}

    def tasks():
        for runs in missing(campaign, count, done, size):
            made = task(runs)
            waiting[id(made)] = runs
            yield made

    for made, found in pool.each(tasks()):
        runs, found = waiting.pop(id(made)), iter(found)
        new = []
        for run in runs:
            result = {"error": run.refusal} if run.refusal else checked(campaign, run, next(found))
            kind, cause = (judge.REFUSED, judge.words(run.refusal)) if run.refusal else judge.class_of(campaign, result)
            new.append(store.row(run, kind, cause, result))
        results.add(new)
        rows.update((one["run"], one) for one in new)
        if shown:
            shown.add(new)
    everything = [rows[number] for number in sorted(rows)]
    results.finish(everything)
    wall_s, new = time.monotonic() - start, [row for number, row in rows.items() if number not in done]
    return everything, {
        "wall_s": wall_s,
        "cores": pool.cores,
        "simulated_per_wall_s": sum(row["simulated_s"] for row in new) / wall_s,
        "at_work": sum(row["wall_s"] for row in new) / (wall_s * pool.cores),  # pmsim's own seconds
    }
