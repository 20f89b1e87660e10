"""Process data: a short plan per PDO becomes its communication record and its mapping."""
from dataclasses import dataclass

from . import source
from .model import Entry, Object, Pdo

ENTRIES = 8  # of a mapping; objects are 8 to 32 bits
DISABLED = 0x80000000
NO_REQUEST = 0x40000000  # of a transmit PDO by a remote frame
KEYS = {
    "receive": ("cob_id", "enabled", "transmission", "timer", "map"),
    "transmit": ("cob_id", "enabled", "transmission", "timer", "map", "inhibit"),
}
SHORT = {"receive": "rpdo", "transmit": "tpdo"}
COMMUNICATION = {"receive": 0x1400, "transmit": 0x1800}
MAPPING = {"receive": 0x1600, "transmit": 0x1A00}


@dataclass
class Plan:
    place: source.Place
    direction: str
    number: int
    cob_id: int
    enabled: bool
    transmission: int
    inhibit: int
    timer: int
    map: list

    @property
    def name(self):
        return f"{SHORT[self.direction]}{self.number}"


def read(root):
    table = root.table("pdos")
    table.only(("receive", "transmit"))
    plans = []
    for direction in ("receive", "transmit"):
        for n, item in enumerate(table.tables(direction, f"{direction} PDO")):
            item.only(KEYS[direction])
            names = item.texts("map")
            if len(names) > ENTRIES:
                raise item.error(f"{len(names)} objects are mapped, {ENTRIES} are possible", "map")
            cob_id = item.integer("cob_id")
            if not 0x180 <= cob_id <= 0x500 or cob_id % 0x80:
                raise item.error(f"cob_id {cob_id:#x} is none of the pre-defined 180h to 500h", "cob_id")
            if any(plan.cob_id == cob_id for plan in plans):
                raise item.error(f"cob_id {cob_id:#x} is used twice", "cob_id")
            inhibit = item.integer("inhibit") if direction == "transmit" else 0
            plans.append(Plan(item.place, direction, n + 1, cob_id, item.flag("enabled"),
                              item.integer("transmission"), inhibit, item.integer("timer"), names))
    return plans


def _entry(plan, index, sub, member, kind, help_text, preset, **more):
    record = plan.name if index < 0x1600 or 0x1800 <= index < 0x1A00 else f"{plan.name}_mapping"
    return Entry(place=plan.place, index=index, sub=sub, name=f"{record}.{member}", member=member, type=kind,
                 help=help_text, preset=preset, **{"lives": "node", "access": "live", "stored": True,
                                                   "group": "communication", **more})


def _communication(plan):
    index = COMMUNICATION[plan.direction] + plan.number - 1
    entries = [
        _entry(plan, index, 1, "cob_id", "u32", "identifier; bit 31: not in use; changed only while not in use",
               plan.cob_id + (0 if plan.enabled else DISABLED) + (NO_REQUEST if plan.direction == "transmit" else 0),
               node_id=True),
        _entry(plan, index, 2, "transmission", "u8", "0 to 240: with SYNC; 254, 255: at an event or by the timer",
               plan.transmission),
    ]
    if plan.direction == "transmit":
        entries.append(_entry(plan, index, 3, "inhibit_time", "u16", "least time between two", plan.inhibit,
                              unit="s", exp10=-4))
        timer = "longest time between two; 0: at events alone"
    else:
        timer = "when none comes in this time while the bridge is on: torque off and a fault; 0: not watched"
    entries.append(_entry(plan, index, 5, "event_timer", "u16", timer, plan.timer, unit="s", exp10=-3))
    count = _entry(plan, index, 0, "count", "u8", "highest sub-index", 5, lives="constant", access="const",
                   stored=False, group="none")
    return Object(plan.place, index, plan.name, f"{plan.direction} PDO {plan.number}", "record", [count] + entries)


def _mapping(plan):
    index = MAPPING[plan.direction] + plan.number - 1
    count = _entry(plan, index, 0, "count", "u8", "objects mapped; set to 0 before they are changed", len(plan.map),
                   least=0, most=ENTRIES)
    entries = [_entry(plan, index, n + 1, f"object_{n + 1}", "u32", "index, sub-index and length in bits", 0)
               for n in range(ENTRIES)]
    return Object(plan.place, index, f"{plan.name}_mapping", f"what {plan.direction} PDO {plan.number} holds",
                  "record", [count] + entries)


def objects(plans):
    return [make(plan) for plan in plans for make in (_communication, _mapping)]


def resolve(plans, dictionary):
    """Fills the mapping objects, now that all names are known."""
    pdos = []
    for plan in plans:
        entries, wire = [], "rx" if plan.direction == "receive" else "tx"
        for name in plan.map:
            entry = dictionary.named(name)
            if entry is None:
                raise plan.place.error(f"{plan.name}: no object `{name}` to be mapped")
            if not entry.maps(wire):
                raise plan.place.error(f"{plan.name}: `{name}` may not be mapped ({wire})")
            entries.append(entry)
        if sum(entry.bits for entry in entries) > 64:
            raise plan.place.error(f"{plan.name}: more than 8 bytes are mapped")
        for n, entry in enumerate(entries):
            slot = dictionary.named(f"{plan.name}_mapping.object_{n + 1}")
            slot.preset = entry.index * 0x10000 + entry.sub * 0x100 + entry.bits
        pdos.append(Pdo(plan.direction, plan.number, plan.cob_id, plan.enabled, plan.timer, entries))
    return pdos
