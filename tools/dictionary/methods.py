"""The methods of the firmware: the rows PM_METHOD(name, ...) of its lists (*.def), and the channels that they need."""
import re
from pathlib import Path

from .source import SourceError

LISTS = ("firmware", "observers", "injection", "bldc")
ROW = re.compile(r"^PM_METHOD\((\w+),", re.MULTILINE)
ROW_WITH_NEEDS = re.compile(r"^PM_METHOD\((\w+),(.*)\)$", re.MULTILINE)
OPTIONS = "firmware/images/options.def"
CHANNELS = "firmware/math/measure.h"
CHANNEL = re.compile(r"^#define NEEDS_(\w+)\s+0x", re.MULTILINE)
NEED = re.compile(r"\bNEEDS_(\w+)")


def channels(root):
    """Names of the channels that a board may have beside currents and DC link, as in a manifest."""
    return [name.lower() for name in CHANNEL.findall((Path(root) / CHANNELS).read_text(encoding="utf-8"))]


def needs(root):
    """Method -> channels of its row."""
    return {name: [need.lower() for need in NEED.findall(rest)]
            for path in {Path(root) / path for path in known(root).values()}
            for name, rest in ROW_WITH_NEEDS.findall(path.read_text(encoding="utf-8"))}


def options(root):
    """What an image may do without beside the methods, of which no header need be there."""
    path = Path(root) / OPTIONS
    return ROW.findall(path.read_text(encoding="utf-8")) if path.is_file() else []


def known(root):
    """Name -> list (path) of every method."""
    found = {}
    for folder in LISTS:
        for path in sorted((Path(root) / folder).glob("**/*.def")):
            shown = str(path.relative_to(root))
            for name in ROW.findall(path.read_text(encoding="utf-8")):
                if name in found:
                    raise SourceError(f"{shown}: method `{name}` stands in {found[name]} already")
                found[name] = shown
    return found
