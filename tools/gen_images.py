#!/usr/bin/env python3
"""Writes what is made from the manifests firmware/images/*.yaml: a header per image, and the lists of images for CMake and C.

usage: tools/gen_images.py [--check]

A manifest names the channels that an image carries beside currents and DC-link voltage (firmware/math/measure.h), and the
methods that it has, or `all`: those for which these channels are enough, but for those that it names as `without`. Methods are the rows PM_METHOD(name, ...) of the lists (*.def)
of the firmware: a row more is known here without another word. The generated files are committed, so that building needs
no PyYAML; --check writes nothing and fails when one of them is not what the manifests say.
"""
import argparse
import re
import sys
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from dictionary import methods, source  # noqa: E402
from dictionary.source import SourceError  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
FOLDER = "firmware/images"
CMAKE = f"{FOLDER}/images.cmake"
NAMES = f"{FOLDER}/images.def"
KEYS = ("help", "board", "program", "channels", "methods", "without", "trace_numbers", "in_flash", "budgets")
WORD = re.compile(r"[A-Za-z]\w*")
# key of `budgets` -> its own keys
BUDGETS = {"flash": (), "ram": (), "stack": (), "ccm": (), "interrupt": ("mean", "worst"),
           "drive_step": ("flux", "injection")}
TRACE_LEAST, TRACE_MOST = 8, 1 << 20


@dataclass
class Image:
    name: str
    help: str
    board: str
    program: str
    channels: list
    methods: list
    trace_numbers: int
    in_flash: list
    budgets: dict  # flat: flash, ..., interrupt_mean


def _budgets(table):
    table.only(BUDGETS)
    out = {}
    for key, parts in BUDGETS.items():
        if not parts:
            out[key] = table.integer(key)
            continue
        own = table.table(key)
        own.only(parts)
        out.update((f"{key}_{part}", own.integer(part)) for part in parts)
    for key, value in out.items():
        if value <= 0:
            raise table.error(f"{key} must be above 0")
    return out


def _named(table, key, what, known):
    """A list of names, each known and standing once: [(place, name)]."""
    wanted = table.texts(key)
    found = []
    for item, name in zip(table.items(key), wanted):
        place = source.Place(table.place.file, item)
        if name not in known:
            raise place.error(f"unknown {what} `{name}`; known are: {', '.join(sorted(known))}")
        if wanted.count(name) > 1:
            raise place.error(f"{what} `{name}` stands twice")
        found.append((place, name))
    return found


def _methods(table, root, channels):
    needs = methods.needs(root)
    missing = {name: [need for need in needs.get(name, []) if need not in channels] for name in methods.known(root)}
    if getattr(table.node("methods"), "value", None) == "all":
        without = [name for _, name in _named(table, "without", "method", missing)] if "without" in table.nodes else []
        return [name for name, lacks in missing.items() if not lacks and name not in without]
    if "without" in table.nodes:
        raise table.error("`without` is for images with all methods", "without")
    wanted = _named(table, "methods", "method", missing)
    for place, name in wanted:
        if missing[name]:
            raise place.error(f"method `{name}` needs the channel `{missing[name][0]}`, which `channels` does not name")
    return [name for _, name in wanted]


def read(path, root=ROOT):
    """The image of a manifest; SourceError with file and line if anything is wrong."""
    path, root = Path(path).resolve(), Path(root)
    table = source.load(path, path.relative_to(root))
    table.only(KEYS)
    for key in ("board", "program"):
        if not WORD.fullmatch(table.text(key)):
            raise table.error(f"`{table.text(key)}` is not a name", key)
    if not (root / "hal" / table.text("board")).is_dir():
        raise table.error(f"there is no board hal/{table.text('board')}", "board")
    trace_numbers = table.integer("trace_numbers")
    if not TRACE_LEAST <= trace_numbers <= TRACE_MOST:
        raise table.error(f"trace_numbers must be {TRACE_LEAST} to {TRACE_MOST}", "trace_numbers")
    in_flash = table.texts("in_flash")
    channels = [name for _, name in _named(table, "channels", "channel", methods.channels(root))]
    return Image(path.stem, table.text("help"), table.text("board"), table.text("program"), channels,
                 _methods(table, root, channels), trace_numbers, in_flash, _budgets(table.table("budgets")))


def images(root=ROOT):
    """All of them, the default first."""
    found = [read(path, root) for path in sorted((Path(root) / FOLDER).glob("*.yaml"))]
    programs = [image.program for image in found]
    for image in found:
        if programs.count(image.program) > 1:
            raise SourceError(f"{FOLDER}/{image.name}.yaml: `{image.program}` is the program of another image too")
    return found


def sum_of(channels):
    """As C; the names are those of measure.h, which is read after the header."""
    return f"({' | '.join('NEEDS_' + name.upper() for name in channels)})" if channels else "0x0000U"


def header(image, known):
    absent = [name for name in known if name not in image.methods]
    guard = f"IMAGES_{image.name.upper()}_H"
    lines = [f"/* Generated by tools/gen_images.py from {FOLDER}/{image.name}.yaml: {image.help}.",
             " * Named by PM_IMAGE_HEADER where the image is compiled (firmware/math/image.h). */",
             f"#ifndef {guard}", f"#define {guard}", "", "/* clang-format off */",
             f'#define PM_IMAGE_NAME "{image.name}"', f"#define PM_IMAGE_TRACE_NUMBERS {image.trace_numbers}U",
             f"#define PM_CHANNELS {sum_of(image.channels)}", ""]
    lines += [f"#define PM_WITHOUT_{name} 1" for name in absent]
    lines += [""] if absent else []
    return "\n".join(lines + ["#endif", ""])


def cmake(found):
    lines = ["# Generated by tools/gen_images.py from the manifests of this folder.",
             f"set(PM_IMAGES {' '.join(image.name for image in found)})"]
    for image in found:
        lines += ["", f"# {image.help}", f"set(PM_IMAGE_{image.name}_BOARD {image.board})",
                  f"set(PM_IMAGE_{image.name}_PROGRAM {image.program})",
                  f"set(PM_IMAGE_{image.name}_METHODS {' '.join(image.methods)})",
                  f"set(PM_IMAGE_{image.name}_IN_FLASH {' '.join(image.in_flash)})".replace(" )", ")")]
        lines += [f"set(PM_IMAGE_{image.name}_{key.upper()} {value})" for key, value in image.budgets.items()]
    return "\n".join(lines) + "\n"


def names(found):
    rows = [f'PM_IMAGE({image.name}) /* {image.help} */' for image in found]
    return "\n".join(["/* Generated by tools/gen_images.py from the manifests of this folder: PM_IMAGE(name). */", *rows, ""])


def files(root=ROOT):
    """{path: text} of all that is generated."""
    known, found = methods.known(Path(root)), images(root)
    out = {f"{FOLDER}/{image.name}.h": header(image, known) for image in found}
    out[CMAKE] = cmake(found)
    out[NAMES] = names(found)
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="only compare")
    arguments = parser.parse_args()
    try:
        made = files()
    except SourceError as error:
        print(error, file=sys.stderr)
        return 1
    stale = [path for path, text in made.items()
             if not (ROOT / path).is_file() or (ROOT / path).read_text(encoding="utf-8") != text]
    for path in stale:
        if arguments.check:
            print(f"{path} is not what the manifests say; run tools/gen_images.py", file=sys.stderr)
        else:
            (ROOT / path).write_text(made[path], encoding="utf-8")
            print(f"wrote {path}")
    return 1 if arguments.check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
