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
    if entry.access == "off":
        flags.append("OD_ONLY_OFF")
    if entry.node_id:
        flags.append("OD_NODE_ID")
    if entry.least is not None and entry.writable:
        flags.append("OD_RANGE")
    return " | ".join(flags)


def c_values(entry):
    """Least, preset, most."""
    return tuple(c_int32(value or 0) for value in (entry.least, entry.preset, entry.most))


def all_values(dictionary):
    """Each that occurs, once."""
    return sorted({c_values(e) for e in dictionary.entries})


FILTERS = {
    "c_text": c_text,
    "c_name": c_name,
    "c_flags": c_flags,
    "c_type": lambda e: f"OD_{e.type.upper()}",
    "c_kind": lambda e: KINDS[e.lives],
    "c_group": lambda e: f"OD_GROUP_{e.group.upper()}",
    "c_values": c_values,
}


def constants(dictionary, eds):
    """(C name, bytes) by slot."""
    out = []
    for entry in dictionary.of("constant"):
        if entry.bits == 0:
            data = eds if entry.text == "$eds" else entry.text.encode("ascii")
            out.append((c_name(entry.name).lower(), [f"0x{x:02X}" for x in data]))
    return out
