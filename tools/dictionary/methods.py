"""The methods of the firmware: the rows PM_METHOD(name, ...) of its lists (*.def)."""
import re
from pathlib import Path

from .source import SourceError

LISTS = ("firmware", "observers", "injection", "bldc")
ROW = re.compile(r"^PM_METHOD\((\w+),", re.MULTILINE)


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
