"""An object of the dictionary as the host sees it: integers on the bus, SI numbers for people."""
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from typing import Optional

# type: (struct format, bits, least, most)
NUMBERS = {
    "i8": ("<b", 8, -(2**7), 2**7 - 1),
    "i16": ("<h", 16, -(2**15), 2**15 - 1),
    "i32": ("<i", 32, -(2**31), 2**31 - 1),
    "u8": ("<B", 8, 0, 2**8 - 1),
    "u16": ("<H", 16, 0, 2**16 - 1),
    "u32": ("<I", 32, 0, 2**32 - 1),
}
