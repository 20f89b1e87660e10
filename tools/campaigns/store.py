"""Results: one Parquet file, `runs.parquet`, a row a run; until the campaign is finished a file for each chunk in
`parts`, so that nothing that was done is lost. The file holds all that a replay needs: campaign, scenario, machine files
and seeds."""

import hashlib
import json
import os
import shutil
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

import tune

KEY = b"pmdrive.campaign"
FORMAT = 1
FIXED = {
    "run": pa.int64(),
    "group": pa.string(),
    "seed": pa.int64(),
    "class": pa.string(),
    "cause": pa.string(),
    "simulated_s": pa.float64(),
    "wall_s": pa.float64(),
    "machine": pa.string(),
    "settings": pa.string(),
    "error": pa.string(),
}
NAMES = "campaign_file", "scenario_file"
DRAWN, PASSED = "drawn.", "pass."


class StoreError(Exception):
    """Results that cannot be read or do not belong to the campaign."""


def plain(value):
    """Numbers are one type of column, words another."""
    return value if isinstance(value, str) or value is None else float(value)


def row(run, kind, cause, result):
    values = {
        "run": run.number,
        "group": run.group,
        "seed": run.seed,
        "class": kind,
        "cause": cause,
        "simulated_s": result.get("simulated_s", 0.0),
        "wall_s": result.get("wall_s", 0.0),
        "machine": run.machine,
        "settings": json.dumps(run.settings),
        "error": result.get("error", ""),
    }
    values.update((DRAWN + name, plain(value)) for name, value in run.drawn.items())
    for item in result.get("expectations", []):
        values[item["name"]] = plain(item["value"])
        values[PASSED + item["name"]] = item["pass"]
    return values


def table_of(rows):
    """Of rows that need not have the same columns."""
    return pa.table({name: column(name, rows) for name in dict.fromkeys(name for one in rows for name in one)})


def column(name, rows):
    values = [one.get(name) for one in rows]
    if name not in FIXED and any(isinstance(value, str) for value in values):
        values = [value if value is None or isinstance(value, str) else f"{value:g}" for value in values]
    return pa.array(values, FIXED.get(name))


def record(campaign, program_digest):
    """What results are made of; others are not mixed with them."""
    what = {
        "format": FORMAT,
        "campaign_file": campaign.path.name,
        "scenario_file": campaign.scenario_path.name,
        "pmsim": program_digest,
        **campaign.texts,
    }
    if campaign.base is None:
        what["tools/tune.py"] = tuning_digest()
    return what


def tuning_digest():
    """Of the rules by which machines are completed."""
    return hashlib.sha256(b"".join(Path(module.__file__).read_bytes() for module in (tune, tune.tune))).hexdigest()


def identity(what):
    kept = {key: value for key, value in what.items() if key not in NAMES}
    return hashlib.sha256(json.dumps(kept, sort_keys=True).encode()).hexdigest()


class Store:
    def __init__(self, folder, what=None):
        self.folder = Path(folder)
        self.parts, self.file = self.folder / "parts", self.folder / "runs.parquet"
        self.what = what

    def _files(self):
        parts = sorted(self.parts.glob("*.parquet")) if self.parts.is_dir() else []
        return ([self.file] if self.file.is_file() else []) + parts

    def clear(self):
        shutil.rmtree(self.parts, ignore_errors=True)
        self.file.unlink(missing_ok=True)

    def _read(self, path):
        try:
            table = pq.read_table(path)
            what = json.loads(table.schema.metadata[KEY])
        except (OSError, pa.ArrowException, KeyError, TypeError, ValueError) as error:
            raise StoreError(f"{path}: no results of a campaign ({error})") from None
        if what["format"] != FORMAT:
            raise StoreError(f"{path}: format {what['format']}, this program reads {FORMAT}")
        if self.what is None:
            self.what = what
        elif identity(what) != identity(self.what):
            changed = [key for key in self.what if key not in NAMES and what.get(key) != self.what[key]]
            raise StoreError(
                f"{path}: made with another {' and '.join(changed)}; take another folder (--out), or drop what is "
                "there (--fresh)"
            )
        return table

    def rows(self):
        """All rows, by number; of a run that is there twice one."""
        found = {}
        for path in self._files():
            for one in self._read(path).to_pylist():
                found[one["run"]] = one
        return [found[number] for number in sorted(found)]

    def add(self, rows):
        """A part is there whole or not at all."""
        self.parts.mkdir(parents=True, exist_ok=True)
        self._write(rows, self.parts / f"{min(one['run'] for one in rows):08}.parquet")

    def finish(self, rows):
        self._write(rows, self.file)
        shutil.rmtree(self.parts, ignore_errors=True)

    def _write(self, rows, path):
        table = table_of(rows).replace_schema_metadata({KEY: json.dumps(self.what).encode()})
        partial = path.with_suffix(".partial")
        pq.write_table(table, partial, compression="zstd")
        with open(partial, "rb") as file:
            os.fsync(file.fileno())
        os.replace(partial, path)
