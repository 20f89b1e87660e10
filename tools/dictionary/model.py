"""The dictionary as objects, with every rule that a source must keep. What is made from it relies on them."""
import re
from dataclasses import dataclass, field
from typing import Optional

from . import source

# name: (code of CiA 301, bits, least, most); no bits: bytes of any number
TYPES = {
    "i8": (0x02, 8, -(2**7), 2**7 - 1),
    "i16": (0x03, 16, -(2**15), 2**15 - 1),
    "i32": (0x04, 32, -(2**31), 2**31 - 1),
    "u8": (0x05, 8, 0, 2**8 - 1),
    "u16": (0x06, 16, 0, 2**16 - 1),
    "u32": (0x07, 32, 0, 2**32 - 1),
    "string": (0x09, 0, 0, 0),
    "domain": (0x0F, 0, 0, 0),
}
LIVES = ("constant", "node", "parameter", "live")
ACCESS = ("live", "off", "locked", "read", "write", "const")
GROUPS = ("none", "communication", "application", "machine")
MAPS = ("none", "tx", "rx", "both")
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
MEMBER = re.compile(r"[A-Za-z0-9_]+")
BOOK = re.compile(r"(\d+(\.\d+)*|A|B) #(\d+)")
ROWS = 152  # of METHODS.md

TAKEN_OVER = ("type", "lives", "access", "stored", "group", "map", "unit", "exp10", "exp2")
ENTRY_KEYS = TAKEN_OVER + ("name", "help", "range", "values", "list", "preset", "image_bits", "book", "alias")
MEMBER_KEYS = ENTRY_KEYS + ("sub", "repeat")
OBJECT_KEYS = ENTRY_KEYS + ("index", "members", "sub0", "form", "flat")


@dataclass
class Entry:
    place: source.Place
    index: int
    sub: int
    name: str  # as users write it
    member: str  # within its record; of a variable: its name
    type: str
    lives: str
    access: str
    help: str
    unit: str = ""
    exp10: int = 0
    exp2: int = 0
    least: Optional[int] = None  # None: the type's own limit
    most: Optional[int] = None
    preset: Optional[int] = None
    image_bits: dict = field(default_factory=dict)  # method: what only an image that has it adds to the preset
    text: str = ""  # constant bytes: the string, or $eds
    node_id: bool = False  # preset is relative to it
    stored: bool = False
    group: str = "none"
    map: str = "none"
    values: dict = field(default_factory=dict)
    book: str = ""
    alias: str = ""
    slot: int = 0
    methods: tuple = ()  # an image without any of them does without the entry; empty: it concerns all images

    def error(self, text):
        return self.place.error(f"{self.where} {self.name}: {text}")

    @property
    def where(self):
        return f"{self.index:04X}h:{self.sub:02X}"

    @property
    def factor(self):
        """Physical value of 1."""
        return float(f"1e{self.exp10}") * 2.0**self.exp2

    @property
    def bits(self):
        return TYPES[self.type][1]

    @property
    def writable(self):
        return self.access in ("live", "off", "locked", "write")

    @property
    def readable(self):
        return self.access != "write"

    def maps(self, direction):
        return self.map in (direction, "both")


@dataclass
class Object:
    place: source.Place
    index: int
    name: str
    help: str
    form: str  # variable, record, array
    entries: list


@dataclass
class Fault:
    name: str
    text: str
    code: int
    register: int
    do: str


@dataclass
class Pdo:
    direction: str  # receive, transmit
    number: int
    cob_id: int
    enabled: bool
    timer: int
    entries: list


@dataclass
class Dictionary:
    device: dict
    objects: list
    pdos: list
    faults: list
    errors: dict
    reserved: list
    retired: list

    @property
    def entries(self):
        return [entry for obj in self.objects for entry in obj.entries]

    def of(self, lives):
        return [entry for entry in self.entries if entry.lives == lives and not entry.alias]

    def named(self, name):
        return next((entry for entry in self.entries if entry.name == name), None)


TEXT = re.compile(r"[ !#-\[\]-~]*")  # ASCII without quote and backslash: it goes into C, EDS, DBC and Python alike


def check(entry):
    """The rules of a single entry."""
    _, bits, lowest, highest = TYPES[entry.type]
    if not entry.help or "\n" in entry.help:
        raise entry.error("help must be one line of text")
    for text in (entry.help.replace('"', ""), entry.unit, entry.text, *entry.values.values()):
        if not TEXT.fullmatch(text):
            raise entry.error(f"only printable ASCII without backslash is possible in texts, quotes in help alone: {text}")
    if entry.book and not (BOOK.fullmatch(entry.book) and 1 <= int(BOOK.fullmatch(entry.book)[3]) <= ROWS):
        raise entry.error(f'book is section and row, as in "5.2.2.2 #51"; not `{entry.book}`')
    if not -12 <= entry.exp10 <= 9:
        raise entry.error("exp10 must be -12 to 9")
    if entry.exp2 not in (0, -32) or (entry.exp2 and (entry.exp10 or entry.type != "u32")):
        raise entry.error("exp2 is -32, for a u32 without exp10")
    if (entry.exp10 or entry.exp2) and not entry.unit:
        raise entry.error("a scaling needs a unit")
    if bits == 0:
        if entry.map != "none" or entry.least is not None or entry.stored:
            raise entry.error("a string or domain has no range, is not stored and not mapped")
        return
    least = lowest if entry.least is None else entry.least
    most = highest if entry.most is None else entry.most
    if least > most or least < lowest or most > highest:
        raise entry.error(f"range {least} to {most} is empty or beyond {entry.type}")
    if entry.preset is not None and not least <= entry.preset <= most:
        raise entry.error(f"preset {entry.preset} is outside {least} to {most}")
    for value in entry.values:
        if not least <= value <= most:
            raise entry.error(f"value {value} is outside {least} to {most}")
    if entry.values and entry.preset is not None and entry.preset not in entry.values:
        raise entry.error(f"preset {entry.preset} is none of its values")
    _check_use(entry, least, most)


def _check_use(entry, least, most):
    if entry.lives == "parameter" and not entry.alias:
        if entry.least is None or entry.preset is None or entry.type != "i32" or not entry.unit:
            raise entry.error("a parameter of the drive is an i32 with unit, range and preset")
        if least >= most or most == 2**31 - 1 or least == -(2**31) or entry.exp10 > 0:
            raise entry.error("a parameter needs a range with room beyond both ends, and exp10 of 0 or less")
        if entry.writable != entry.stored:
            raise entry.error("a parameter of the drive can be written and is stored, or neither: what the board says")
    if entry.stored and not entry.writable:
        raise entry.error("what is stored must be writable")
    if entry.stored and entry.preset is None:
        raise entry.error("what is stored needs a preset")
    if entry.group != "none" and not entry.stored:
        raise entry.error("it has a group but is not stored")
    if entry.lives == "constant" and entry.preset is None:
        raise entry.error("a constant needs a preset")
    if entry.access == "const" and entry.lives not in ("constant", "live"):
        raise entry.error("const does not go with its place")
    if entry.map in ("rx", "both") and entry.access != "live":
        raise entry.error("process data can be received only into what is writable at any time")
    if entry.map in ("tx", "both") and not entry.readable:
        raise entry.error("process data can be sent only from what is readable")


def link_alias(dictionary):
    for entry in dictionary.entries:
        if entry.alias:
            target = dictionary.named(entry.alias)
            if target is None or target.lives != "parameter":
                raise entry.error(f"no parameter `{entry.alias}` to be another name for")
            if target.least is None or target.least < TYPES[entry.type][2]:
                raise entry.error(f"{entry.type} cannot hold all values of `{entry.alias}`")
            entry.unit, entry.exp10 = target.unit, target.exp10
            entry.least, entry.most, entry.preset = target.least, target.most, target.preset
            entry.access, entry.book, entry.methods = target.access, target.book, target.methods


def is_mapping(entry):
    """One place of a PDO: the node keeps which object stands there instead of a word."""
    return entry.lives == "node" and entry.sub > 0 and (entry.index & 0xFE00 == 0x1600 or entry.index & 0xFE00 == 0x1A00)


def number_slots(dictionary):
    for lives in LIVES:
        for slot, entry in enumerate(sorted(dictionary.of(lives), key=is_mapping)):
            entry.slot = slot
    for slot, entry in enumerate(x for x in dictionary.of("constant") if x.bits == 0):
        entry.slot = slot
    for entry in dictionary.of("constant"):
        if entry.bits:
            entry.slot = 0
    for entry in dictionary.entries:
        if entry.alias:
            entry.slot = dictionary.named(entry.alias).slot


def check_all(dictionary):
    """The rules between entries."""
    places, names, indices = {}, {}, {}
    for obj in dictionary.objects:
        if obj.index in indices:
            other = indices[obj.index]
            raise obj.place.error(f"index {obj.index:04X}h is used by {other.name} already, at {other.place}")
        indices[obj.index] = obj
        for first, last, why in dictionary.reserved:
            if first <= obj.index <= last:
                raise obj.place.error(f"index {obj.index:04X}h is reserved for {why}")
    gone = {(index, sub): name for index, sub, name in dictionary.retired}
    gone_names = {name for _, _, name in dictionary.retired}
    for entry in dictionary.entries:
        at = (entry.index, entry.sub)
        if at in places:
            raise entry.error(f"{entry.where} is used by {places[at].name} already, at {places[at].place}")
        if entry.name in names:
            other = names[entry.name]
            raise entry.error(f"the name is used at {other.where} already, at {other.place}")
        if at in gone:
            raise entry.error(f"{entry.where} was `{gone[at]}` and is never used again")
        if entry.name in gone_names:
            raise entry.error("the name is that of a retired object and is never used again")
        places[at], names[entry.name] = entry, entry
        check(entry)
