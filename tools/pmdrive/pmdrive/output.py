"""What the commands show: lines for people, or JSON for programs."""
import json
import math
import sys
from pathlib import Path

from .drive import error_text, fault_text


class Output:
    """Lines for people, or one JSON object per answer for programs; progress goes to a terminal only."""

    def __init__(self, as_json, stream=None):
        self.as_json, self.stream = as_json, stream or sys.stdout

    def line(self, text=""):
        if not self.as_json:
            print(text, file=self.stream)

    def data(self, data):
        if self.as_json:
            print(json.dumps(data), file=self.stream, flush=True)

    @staticmethod
    def warn(text):
        if text:
            print(f"pmdrive: {text}", file=sys.stderr)

    def progress(self, *what):
        if not self.as_json and sys.stderr.isatty():
            text = f"{what[0]}/{what[1]}" if len(what) == 2 else str(what[0])
            print(f"\r{text:40s}\r", end="", file=sys.stderr, flush=True)


def plain(entry, raw):
    """For JSON: a number in the entry's unit, text as it is, bytes in hexadecimal."""
    if not entry.number:
        return raw if isinstance(raw, str) else raw.hex()
    value = entry.physical(raw)
    return int(value) if value == int(value) else float(value)


def as_json(values):
    return {entry.name: {"value": plain(entry, raw), "unit": entry.unit, "raw": raw if entry.number else None}
            for entry, raw in values.items()}


def shown(entry, raw):
    """With what a code means."""
    if entry.name in ("drive_fault", "fault_record.code"):
        return f"{raw} ({fault_text(raw)})"
    if entry.name == "error_code":
        return f"{raw:04X}h ({error_text(raw) if raw else 'none'})"
    if entry.unit == "rad/s" and "velocity" in entry.name:  # of the shaft
        return f"{entry.text(raw)} ({float(entry.physical(raw)) * 30 / math.pi:.1f} rpm)"
    return entry.text(raw)


def show(out, values):
    out.data(as_json(values))
    width = max((len(entry.name) for entry in values), default=0)
    for entry, raw in values.items():
        out.line(f"{entry.name:{width}s}  {shown(entry, raw)}")


def show_changes(changes, out, words=("here", "there")):
    out.data([{"name": e.name, words[0]: plain(e, here), words[1]: plain(e, there), "unit": e.unit}
              for e, here, there in changes])
    for entry, here, there in changes:
        out.line(f"{entry.name:26s} {entry.text(here):>20s} -> {entry.text(there)}")


def check_file(path):
    """Whether a file can be written, before something is recorded for it that would be lost; OSError if it cannot."""
    if path:
        new = not Path(path).exists()
        with open(path, "ab"):
            pass
        if new:
            Path(path).unlink()


def write_text(path, text, out):
    if path:
        Path(path).write_text(text, encoding="utf-8")
        out.line(f"wrote {path}")
    else:
        out.stream.write(text)
