"""From what the user writes to entries."""
import difflib
import re

from . import dictionary
from .errors import UsageError

BY_NAME = {entry.name: entry for entry in dictionary.ENTRIES}
BY_PLACE = {(entry.index, entry.sub): entry for entry in dictionary.ENTRIES}
RECORDS = {}
for _entry in dictionary.ENTRIES:
    RECORDS.setdefault(_entry.record, []).append(_entry)
PLACE = re.compile(r"(?:0x)?([0-9A-Fa-f]{4})h?(?::(?:0x)?([0-9A-Fa-f]{1,2})h?)?")
DRIVE_RECORDS = ("board", "schematic", "machine", "control", "position", "sliding_mode", "ekf", "injection", "third", "windings", "six_step", "protections", "sensors")


def find(text):
    """One entry by its name, or by index:sub in hexadecimal."""
    if text in BY_NAME:
        return BY_NAME[text]
    place = PLACE.fullmatch(text)
    if place:
        at = (int(place[1], 16), int(place[2] or "0", 16))
        if at in BY_PLACE:
            return BY_PLACE[at]
        raise UsageError(f"{at[0]:04X}h:{at[1]:02X} is not in the dictionary", "docs/object-dictionary.md lists all")
    folded = {name.lower(): name for name in BY_NAME}
    if text.lower() in folded:
        return BY_NAME[folded[text.lower()]]
    near = difflib.get_close_matches(text.lower(), list(folded), 3, 0.6)
    do = f"did you mean {' or '.join(folded[x] for x in near)}?" if near else "`pmdrive list` shows all names"
    raise UsageError(f"no object is called `{text}`", do)


def _record(text):
    """Whole record that is meant, by its name or by its index alone."""
    place = PLACE.fullmatch(text)
    if place and not place[2]:
        return next((e.record for e in dictionary.ENTRIES if e.index == int(place[1], 16)), None)
    return text if text in RECORDS else None


def select(texts):
    """Entries by names, places or whole records; none named: all parameters of the drive."""
    out = []
    for text in texts or DRIVE_RECORDS:
        record = _record(text)
        found = [e for e in RECORDS[record] if not e.name.endswith(".count")] if record else [find(text)]
        out += [entry for entry in found if entry not in out]
    return out


def stored(group=None):
    """What 1010h keeps, but the identity on the bus."""
    return [e for e in dictionary.ENTRIES if e.stored and e.record != "bus" and group in (None, e.group)]
