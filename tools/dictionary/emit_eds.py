"""EDS after CiA 306, and the short form of it that a device keeps in 1021h."""
import lzma

from .model import TYPES

MANDATORY = (0x1000, 0x1001, 0x1018)
ACCESS = {"live": "rw", "off": "rw", "locked": "rw", "read": "ro", "write": "wo", "const": "const"}
# What every reader of .lzma files can do without more memory than it needs: 64 KiB of window.
FILTERS = [{"id": lzma.FILTER_LZMA1, "preset": 9 | lzma.PRESET_EXTREME, "dict_size": 65536, "lc": 2, "lp": 0, "pb": 0}]


def lists(dictionary):
    """Objects by the three lists of an EDS."""
    out = {"MandatoryObjects": [], "OptionalObjects": [], "ManufacturerObjects": []}
    for obj in dictionary.objects:
        if obj.index in MANDATORY:
            out["MandatoryObjects"].append(obj)
        elif 0x2000 <= obj.index < 0x6000:
            out["ManufacturerObjects"].append(obj)
        else:
            out["OptionalObjects"].append(obj)
    return list(out.items())


def eds_access(entry):
    """CiA 306 tells by it, for what can be mapped, in which direction."""
    access = ACCESS[entry.access]
    if access == "rw" and entry.map in ("tx", "rx"):
        return "rwr" if entry.map == "tx" else "rww"
    return access


def eds_name(entry):
    return entry.name.replace(".", "_") if entry.member.isdigit() else entry.member


def compressed(text, before=b""):
    """Another version of the compressor may find other bytes: those from before are kept while they say the same."""
    try:
        if lzma.decompress(before, format=lzma.FORMAT_ALONE) == text.encode("ascii"):
            return before
    except (lzma.LZMAError, EOFError):
        pass
    return lzma.compress(text.encode("ascii"), format=lzma.FORMAT_ALONE, filters=FILTERS)


FILTERS_OF_TEMPLATE = {"eds_access": eds_access, "eds_name": eds_name, "eds_type": lambda e: TYPES[e.type][0]}
