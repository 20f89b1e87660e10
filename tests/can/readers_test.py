"""What the host tool reads of others, files of values and the data sheet in a device, changed at random: every input is read
or refused with a reason, and what is read is in range.

usage: readers_test.py [RUNS [SEED]]
"""
import lzma
import random
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "tools" / "pmdrive" / "pmdrive"
sys.path.insert(0, str(PACKAGE.parent))
from pmdrive import dictionary, files, names, trace  # noqa: E402
from pmdrive.errors import PmdriveError  # noqa: E402

PIECES = [":", ": ", " #", "\n", "drive:", "---", "{", "}", "'", '"', "0x", "1e", "1e999", "e99999999", "-", ".", "%", "rpm", "mohm", "k",
          "\0", "\x85", "\u2028", "\u0660", "\u00b2", "\u00b5", " ", "nan", "inf", "9" * 40, "2100:02", "2100h", "FFFF:FF"]


def changed(text, rng):
    """A few places of it: cut, doubled, swapped for something that means something, or for anything."""
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(text) + 1)
        end = min(len(text), at + rng.choice((0, 1, 1, 2, 5, 40)))
        new = rng.choice((rng.choice(PIECES), chr(rng.randrange(0x250)), text[at:end] * 2, "", rng.choice(LINES)))
        text = text[:at] + new + text[end:]
    return text


def lines():
    values = {e: e.preset for e in names.stored()}
    machines = [p.read_text(encoding="utf-8") for p in sorted((ROOT / "sim_plant" / "machines").glob("*.yaml"))]
    sections = [m[m.index("\ndrive:") :] for m in machines if "\ndrive:" in m]
    return [line for text in (files.render(values), *sections) for line in text.splitlines()]


LINES = lines()


def read_file(rng):
    """Whether it was accepted."""
    text = changed("\n".join(rng.sample(LINES, rng.randint(1, 4))), rng)
    try:
        values = files.parse(text, "file")
    except PmdriveError as error:
        assert str(error), repr(text)
        return False
    except Exception as error:
        raise AssertionError(f"{error!r} of {text!r}") from error
    for entry, raw in values.items():
        assert entry.writable and entry.encode(raw) and (entry.least is None or entry.least <= raw <= entry.most), repr(text)
    return bool(values)


class Device:
    def __init__(self, sheet):
        self.sheet = sheet

    def read(self, name):
        return {"stored_eds": self.sheet, "stored_eds_format": dictionary.EDS_FORMAT}[name]


def read_sheet(sheet, rng):
    data = bytearray(sheet)
    for _ in range(rng.randint(1, 3)):
        data[rng.choice((rng.randrange(16), rng.randrange(len(data))))] = rng.randrange(256)
    data = data[: rng.randint(0, len(data))] if rng.random() < 0.3 else data
    try:
        trace.data_sheet(Device(bytes(data)))
        return True
    except PmdriveError:
        return False
    except Exception as error:
        raise AssertionError(f"{error!r} of {bytes(data)[:40].hex()}...") from error


def main():
    runs, seed = [int(word) for word in (sys.argv[1:] + ["20000", "1"][len(sys.argv) - 1 :])]
    rng = random.Random(seed)
    good = sum(read_file(rng) for _ in range(runs))
    assert 0.02 * runs < good < 0.98 * runs, f"{good} of {runs} accepted: the changes are of the wrong size"
    sheet = lzma.compress((PACKAGE / "pmdrive.eds").read_bytes(), format=lzma.FORMAT_ALONE)
    sheets = max(runs // 100, 1)
    readable = sum(read_sheet(sheet, rng) for _ in range(sheets))
    print(f"{runs} files of values, {good} accepted; {sheets} data sheets, {readable} readable")


main()
