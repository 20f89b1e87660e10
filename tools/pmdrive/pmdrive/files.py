"""Files of values: one `name: value unit` a line, # before a comment. So written, a file is YAML as well. Of a machine file, which has
sections, the values are those of `drive:`."""
import re
from pathlib import Path

from . import names
from .errors import PmdriveError, UsageError

LINE = re.compile(r"\s*([A-Za-z0-9_.:]+?)\s*:\s+(.*?)\s*")


def _comment(text):
    """Without the comment: # at the start of a line or after a blank."""
    match = re.search(r"(^|\s)#", text)
    return text[: match.start()] if match else text


def _drive(lines, shown):
    """Of a machine file's lines those of `drive:`; None of a file without sections."""
    words = [line.split(":")[0] for _, line in lines]
    if "drive" not in words:
        if {"name", "electrical"} <= set(words):
            raise UsageError(f"{shown}: a machine file without a section `drive:`", "`pmsim tune` completes it")
        return None
    out, inside = [], False
    for number, line in lines:
        if line[0].isspace():
            out += [(number, line)] if inside else []
            continue
        inside = line == "drive:"
        match = LINE.fullmatch(line)
        if match and match[1] == "drive":
            raise UsageError(f"{shown}:{number}: drive: its values stand below it, `name: value` a line each")
        if match and match[1] in names.BY_NAME and match[2][0] not in "{[":  # `winding` is a section as well
            raise UsageError(f"{shown}:{number}: {match[1]} stands outside `drive:`", "indent it below `drive:`")
    return out


def parse(text, shown, note=None):
    """{entry: integer}; errors name file and line. `note` is told when it is a machine file."""
    out, lines = {}, {}
    there = [(number, _comment(line).rstrip()) for number, line in enumerate(text.splitlines(), 1)]
    there = [(number, line) for number, line in there if line.strip() not in ("", "---")]
    drive = _drive(there, shown)
    if drive and note:
        note(f"{shown} is a machine file: `drive:` alone is read, the board's scales and f_pwm stay the drive's")
    for number, line in there if drive is None else drive:
        match = LINE.fullmatch(line)
        if not match:
            raise UsageError(f"{shown}:{number}: not a line of the form `name: value`: {line.strip()}")
        try:
            entry = names.find(match[1])
            if not entry.writable or not entry.number:
                raise UsageError(f"{entry.label} cannot be set")
            raw = entry.parse(match[2].strip("\"'"))
            entry.check(raw)
        except PmdriveError as error:
            raise UsageError(f"{shown}:{number}: {error.text}", error.do) from None
        if entry in out:
            raise UsageError(f"{shown}:{number}: {entry.name} stands here and in line {lines[entry]}")
        out[entry], lines[entry] = raw, number
    return out


def read(path, note=None):
    try:
        values = parse(Path(path).read_text(encoding="utf-8-sig"), path, note)
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise UsageError(f"{path}: {error}") from None
    if not values:
        raise UsageError(f"{path}: there is no value in it")
    return values


def render(values, title=""):
    """The text of a file: {entry: integer}, by record, with units and help."""
    lines, record = ([f"# {title}"] if title else []), None
    for entry, raw in values.items():
        if entry.record != record:
            lines += ["", f"# {entry.record}"]
            record = entry.record
        number = str(raw) if entry.values or not entry.unit else entry.plain(raw)
        value = f"{number} {entry.unit}" if entry.unit not in ("", "1") and not entry.values else number
        lines.append(f"{entry.name + ':':32s} {value:24s} # {entry.help}")
    return "\n".join(lines) + "\n"
