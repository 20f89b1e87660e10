"""An object of the dictionary as the host sees it: integers on the bus, exact decimals in units for people."""
import re
import struct
from dataclasses import dataclass, field
from decimal import ROUND_HALF_EVEN, Decimal, InvalidOperation
from typing import Optional

from .errors import NotDone, ValueRefused

# type: (struct format, bits, least, most)
LONGEST = 40  # decimal exponent of a number that is looked at
NUMBERS = {
    "i8": ("<b", 8, -(2**7), 2**7 - 1),
    "i16": ("<h", 16, -(2**15), 2**15 - 1),
    "i32": ("<i", 32, -(2**31), 2**31 - 1),
    "u8": ("<B", 8, 0, 2**8 - 1),
    "u16": ("<H", 16, 0, 2**16 - 1),
    "u32": ("<I", 32, 0, 2**32 - 1),
}
PREFIXES = {"n": -9, "u": -6, "µ": -6, "m": -3, "k": 3, "M": 6}
# Other units that are understood: (unit of the dictionary, factor to it)
UNITS = {
    ("rad/s", "rpm"): Decimal("0.104719755119659774615421446109316763"),
    ("rad/s", "r/min"): Decimal("0.104719755119659774615421446109316763"),
    ("turn", "deg"): 1 / Decimal(360),
    ("1", "%"): Decimal("0.01"),
    ("rated torque", "%"): Decimal("0.01"),
    ("rated current", "%"): Decimal("0.01"),
    ("v_dc", "%"): Decimal("0.01"),
    ("ohm", "Ω"): Decimal(1),
    ("degC", "°C"): Decimal(1),
}
SHARES = "rated torque", "rated current", "v_dc"  # of the units
QUANTITY = re.compile(r"\s*([+-]?(?:0x[0-9A-Fa-f]+|\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?))\s*([^\d.\s].*?)?\s*")


@dataclass(frozen=True)
class Entry:
    index: int
    sub: int
    name: str
    record: str
    type: str
    access: str
    unit: str
    exp10: int
    exp2: int
    least: Optional[int]
    most: Optional[int]
    preset: Optional[int]
    node_id: bool
    stored: bool
    group: str
    map: str
    values: dict = field(hash=False)
    help: str
    book: str

    @property
    def where(self):
        return f"{self.index:04X}h:{self.sub:02X}"

    @property
    def label(self):
        return f"{self.name} ({self.where})"

    @property
    def number(self):
        return self.type in NUMBERS

    @property
    def bits(self):
        return NUMBERS[self.type][1] if self.number else 0

    @property
    def writable(self):
        return self.access in ("live", "off", "locked", "write")

    @property
    def scale(self):
        """Physical value of 1."""
        return Decimal(1).scaleb(self.exp10) * (Decimal(2) ** self.exp2)

    def decode(self, data):
        """From the bus to an integer, text or bytes."""
        if self.type == "string":
            return data.decode("ascii", "replace").rstrip("\0")
        if not self.number:
            return bytes(data)
        code, bits, _, _ = NUMBERS[self.type]
        if len(data) < bits // 8:
            raise NotDone(f"{self.label}: {len(data)} bytes came, {bits // 8} were expected",
                          "the firmware is of another version than this tool")
        return struct.unpack(code, data[: bits // 8])[0]

    def encode(self, raw):
        code, _, least, most = NUMBERS[self.type]
        if not least <= raw <= most:
            raise ValueRefused(self, f"{self.text(raw)} does not fit into {self.type}{self._in_percent(raw)}")
        return struct.pack(code, raw)

    def check(self, raw):
        """The range, before anything is sent."""
        if self.least is not None and raw < self.least:
            raise ValueRefused(self, f"{self.text(raw)} is below the least, {self.text(self.least)}{self._in_percent(raw)}")
        if self.most is not None and raw > self.most:
            raise ValueRefused(self, f"{self.text(raw)} is above the most, {self.text(self.most)}{self._in_percent(raw)}")
        self.encode(raw)

    def _in_percent(self, raw):
        """Of a share that is too large: it was meant in percent."""
        if self.unit not in SHARES or abs(self.physical(raw)) < 2:
            return ""
        return f": {self.plain(raw)} is {self.plain(100 * raw)} %; did you mean {self.plain(raw)}%?"

    def physical(self, raw):
        return Decimal(raw) * self.scale

    def raw(self, value):
        """The integer nearest to a number in the entry's unit."""
        return int((Decimal(value) / self.scale).to_integral_value(ROUND_HALF_EVEN))

    def text(self, raw):
        """For people, with unit."""
        if not self.number:
            return raw if isinstance(raw, str) else f"{len(raw)} bytes"
        if raw in self.values:
            return f"{raw} ({self.values[raw]})"
        if "bit 0 " in self.help:
            return f"0x{raw:X} ({', '.join(self.flags(raw)) or 'none'})"
        if not self.unit:
            return f"0x{raw:X}" if self.type == "u32" and raw > 0xFFFF or self.name.endswith("word") else str(raw)
        return f"{self.plain(raw)}{'' if self.unit == '1' else ' ' + self.unit}"

    def flags(self, raw):
        """Of bits that the help text names: `bit 0 this, 1 that`."""
        named = re.findall(r"(\d+) ([^,]+)", self.help[self.help.index("bit 0 "):])
        return [word for bit, word in named if raw >> int(bit) & 1]

    def plain(self, raw):
        """The number alone, exact; of angles, six digits."""
        value = self.physical(raw)
        if self.exp2:
            value = value.quantize(Decimal("1e-6"))
        text = f"{value:f}"
        return text.rstrip("0").rstrip(".") if "." in text else text

    def _convert(self, number, unit):
        """A number in a unit that the user wrote, in the entry's own."""
        if unit in ("", self.unit):
            return number
        if (self.unit, unit) in UNITS:
            return number * UNITS[self.unit, unit]
        if unit[0] in PREFIXES and unit[1:] == self.unit and self.unit != "1":
            return number.scaleb(PREFIXES[unit[0]])
        known = sorted([u for own, u in UNITS if own == self.unit])
        also = f" or {', '.join(known)}" if known else ""
        own = f"its unit is {self.unit}{also}" if self.unit not in ("", "1") else "it has no unit"
        raise ValueRefused(self, f"unit `{unit}` is not understood: {own}")

    def parse(self, text):
        """The integer of what the user wrote: a number, perhaps with a unit or prefix, or one of the values' words."""
        text = str(text).strip()
        for raw, word in self.values.items():
            if text.lower() == word.lower():
                return raw
        match = QUANTITY.fullmatch(text)
        if not self.number or not match:
            words = f"; or one of: {', '.join(self.values.values())}" if self.values else ""
            raise ValueRefused(self, f"`{text}` is not a number{words}")
        if match[1].lower().lstrip("+-").startswith("0x"):
            number = Decimal(int(match[1], 16))
        else:
            try:
                number = Decimal(match[1])
            except InvalidOperation:
                raise ValueRefused(self, f"`{text}` is not a number") from None
        if number.adjusted() > LONGEST:  # more digits would take for ever
            number = Decimal(1).scaleb(LONGEST).copy_sign(number)
        number = self._convert(number, match[2] or "")
        exact = number / self.scale
        raw = int(exact.to_integral_value(ROUND_HALF_EVEN))
        if not (self.exp10 or self.exp2) and exact != raw:
            raise ValueRefused(self, f"`{text}` is not an integer")
        if number != 0 and raw == 0:
            raise ValueRefused(self, f"{text} is less than its resolution, {self.text(1)}")
        return raw


@dataclass(frozen=True)
class Fault:
    code: int
    name: str
    text: str
    error_code: int
    do: str
