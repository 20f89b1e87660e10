"""The ledger of all places ever given, firmware/params/allocations.txt: what it holds is never lost or changed.

A line is `index:sub type scaling name`. An object that is removed from the source goes to its list `retired`; its
line stays, so that the place cannot be given again.
"""
import re

from .source import SourceError

HEAD = """\
# Every place of the dictionary that was ever given: index:sub type scaling name. Written by tools/gen_dictionary.py,
# which adds lines and never takes one away. What is removed from parameters.yaml goes to `retired` there.
"""
LINE = re.compile(r"([0-9A-F]{4}):([0-9A-F]{2}) (\w+) (\S+) (\S+)")


def _scaling(entry):
    if entry.exp2:
        return f"2^{entry.exp2}_{entry.unit}"
    return f"10^{entry.exp10}_{entry.unit.replace(' ', '_')}" if entry.unit else "-"


def _read(path):
    lines = {}
    if not path.exists():
        return lines
    for number, text in enumerate(path.read_text(encoding="ascii").splitlines(), 1):
        if text.startswith("#"):
            continue
        match = LINE.fullmatch(text)
        if not match:
            raise SourceError(f"{path.name}:{number}: not a line of the ledger: {text}")
        lines[(int(match[1], 16), int(match[2], 16))] = (number, match[3], match[4], match[5])
    return lines


def update(path, dictionary):
    """The text of the ledger with what is new; refuses what contradicts it."""
    known = _read(path)
    present = {(e.index, e.sub): e for e in dictionary.entries if e.sub or not e.name.endswith(".count")}
    retired = {(index, sub): name for index, sub, name in dictionary.retired}
    for at, (number, kind, scaling, name) in known.items():
        where = f"{at[0]:04X}h:{at[1]:02X}"
        entry = present.get(at)
        if entry is None:
            if retired.get(at) != name:
                raise SourceError(
                    f"{path.name}:{number}: {where} `{name}` is gone from parameters.yaml and not among `retired`")
        elif (entry.type, _scaling(entry), entry.name) != (kind, scaling, name):
            raise entry.error(f"{where} was given to `{name}`, {kind} {scaling}: another meaning needs another place")
    rows = dict((at, value[1:]) for at, value in known.items())
    rows.update((at, (e.type, _scaling(e), e.name)) for at, e in present.items())
    body = "".join(f"{at[0]:04X}:{at[1]:02X} {' '.join(row)}\n" for at, row in sorted(rows.items()))
    return HEAD + body
