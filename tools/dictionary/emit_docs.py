"""The page for the reader, and the constants of the host tool."""

PARTS = (
    ("Communication", 0x1000, 0x1FFF),
    ("Parameters and measurements", 0x2000, 0x2FFF),
    ("Identification and trace", 0x3000, 0x5FFF),
    ("CiA 402", 0x6000, 0x9FFF),
)


def parts(dictionary):
    return [(name, [obj for obj in dictionary.objects if first <= obj.index <= last]) for name, first, last in PARTS]


def _alike(one, other):
    """Members that differ by their number alone."""
    keys = ("type", "access", "unit", "exp10", "least", "most", "preset", "help", "group", "map", "node_id")
    stem = one.name.rstrip("0123456789")
    return (other.name.rstrip("0123456789") == stem != one.name and other.sub == one.sub + 1
            and all(getattr(one, key) == getattr(other, key) for key in keys))


def rows(obj):
    """(sub-indices, name, entry), with members that differ by their number alone in one row."""
    shown = [e for e in obj.entries if e.sub or obj.form == "variable" or e.writable]
    out = []
    for e in shown:
        if out and _alike(out[-1][-1], e):
            out[-1].append(e)
        else:
            out.append([e])
    return [(f"{run[0].sub}" if len(run) == 1 else f"{run[0].sub} to {run[-1].sub}",
             run[0].name if len(run) == 1 else f"{run[0].name}` to `{run[-1].name.split('.')[-1]}", run[0])
            for run in out]


def _decimal(entry, value):
    """An exact decimal of value * 10^exp10, as people write it."""
    if entry.exp10 >= 0:
        return str(value * 10**entry.exp10)
    digits = f"{abs(value):0{1 - entry.exp10}d}"
    whole, rest = digits[: entry.exp10], digits[entry.exp10 :].rstrip("0")
    return ("-" if value < 0 else "") + whole + ("." + rest if rest else "")


def md_scale(entry):
    if entry.exp2:
        return f"2^{entry.exp2}"
    return f"1e{entry.exp10}" if entry.exp10 else ""


def md_range(entry):
    if entry.least is None:
        return ""
    if entry.most > 0xFFFF and not entry.unit:
        return f"{entry.least:X}h to {entry.most:X}h"
    return f"{_decimal(entry, entry.least)} to {_decimal(entry, entry.most)}"


def md_default(entry):
    if entry.node_id:
        return f"{entry.preset:X}h + node id"
    if entry.preset is None or entry.type in ("string", "domain"):
        return entry.text if entry.type == "string" else ""
    if not entry.unit and entry.preset > 0xFF:
        return f"{entry.preset:X}h"
    return _decimal(entry, entry.preset)


def md_help(entry):
    text = entry.help.replace("|", "\\|")
    if entry.values:
        text += ": " + "; ".join(f"{value} {meaning}" for value, meaning in entry.values.items())
    return text


FILTERS = {"md_rows": rows, "md_scale": md_scale, "md_range": md_range, "md_default": md_default, "md_help": md_help}
