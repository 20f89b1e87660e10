"""C: the table, its slots, constant bytes, the drive's parameters, codes of faults."""
import zlib

KINDS = {"constant": "OD_CONSTANT", "node": "OD_NODE", "parameter": "OD_PARAMETER", "live": "OD_LIVE"}
MASK = 2**32


def schema(dictionary):
    """CRC-32 over what a stored value means: place, type, scaling. A range may change without harm."""
    rows = [f"{e.index:04X}:{e.sub:02X} {e.type} {e.exp10}\n" for e in dictionary.entries if e.stored]
    return zlib.crc32("".join(rows).encode())


def c_text(text):
    return text.replace("\\", "\\\\").replace('"', '\\"')


def c_name(name):
    return name.replace(".", "_").upper()


def c_int32(value):
    """The bit pattern as int32_t."""
    value = (value + MASK // 2) % MASK - MASK // 2
    return "INT32_MIN" if value == -(2**31) else str(value)


def c_flags(entry):
    flags = []
    if entry.readable:
        flags.append("OD_READ")
    if entry.writable:
        flags.append("OD_WRITE")
    if entry.maps("tx"):
        flags.append("OD_MAP_TX")
    if entry.maps("rx"):
        flags.append("OD_MAP_RX")
    if entry.stored:
        flags.append("OD_STORED")
    if entry.access in ("off", "locked"):
        flags.append("OD_ONLY_OFF")
    if entry.node_id:
        flags.append("OD_NODE_ID")
    if has_range(entry):
        flags.append("OD_RANGE")
    return " | ".join(flags)


def c_values(entry):
    """Least, preset, most."""
    least, preset, most = (c_int32(value or 0) for value in (entry.least, entry.preset, entry.most))
    if entry.image_bits:
        (method, bit), = entry.image_bits.items()
        preset = f"PM_HAS({method}) ? {c_int32(entry.preset)} : {c_int32(entry.preset - bit)}"
    return least, preset, most


def all_values(dictionary):
    """Each range that occurs, once, and each preset of what has none; those of parameters stand in parameters.def."""
    own = [e for e in dictionary.entries if e.lives != "parameter"]
    ranges = sorted({c_values(e) for e in own if has_range(e)})
    presets = sorted({c_values(e)[1] for e in own if not has_range(e)})
    return {"ranges": ranges, "presets": presets}


def has_range(entry):
    return entry.least is not None and entry.writable


def c_place(entry, values):
    """Of its values in those of all_values()."""
    if entry.lives == "parameter":
        return 0
    least_to_most = c_values(entry)
    return values["ranges"].index(least_to_most) if has_range(entry) else values["presets"].index(least_to_most[1])


def image_methods(dictionary, known):
    """(index, sub) -> methods of the lists, one of which an image must have for the entry; none: all images have it.

    A record's count goes with its last member.
    """
    out = {}
    for obj in dictionary.objects:
        out.update({(e.index, e.sub): e.methods if all(name in known for name in e.methods) else () for e in obj.entries})
        members = [out[(e.index, e.sub)] for e in obj.entries if e.sub]
        if members:
            out[(obj.index, 0)] = tuple(dict.fromkeys(sum(members, ()))) if all(members) else ()
    return out


def _condition(entry, methods):
    return " || ".join(f"PM_HAS({name})" for name in methods[(entry.index, entry.sub)])


def runs(entries, methods):
    """[(condition of the preprocessor, or "", entries)] in order."""
    out = []
    for entry in entries:
        condition = _condition(entry, methods)
        if not out or out[-1][0] != condition:
            out.append((condition, []))
        out[-1][1].append(entry)
    return out


def c_slot(entry):
    """Slots of parameters depend on the image."""
    return f"OD_PARAMETER_{c_name(entry.alias or entry.name)}" if entry.lives == "parameter" else f"{entry.slot}U"


FILTERS = {
    "c_text": c_text,
    "c_name": c_name,
    "c_flags": c_flags,
    "c_locked": lambda e: "1U" if e.access == "locked" else "0U",
    "c_type": lambda e: f"OD_{e.type.upper()}",
    "c_kind": lambda e: KINDS[e.lives],
    "c_group": lambda e: f"OD_GROUP_{e.group.upper()}",
    "c_values": c_values,
    "c_slot": c_slot,
    "c_place": c_place,
}


def constants(dictionary, eds, methods):
    """(C name, bytes, condition of the preprocessor) by slot."""
    out = []
    for entry in dictionary.of("constant"):
        if entry.bits == 0:
            data = eds if entry.text == "$eds" else entry.text.encode("ascii")
            out.append((c_name(entry.name).lower(), [f"0x{x:02X}" for x in data], _condition(entry, methods)))
    return out
