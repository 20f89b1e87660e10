#!/usr/bin/env python3
"""The part of a link script that names the sections of all that a function reaches: code and constant tables.

usage: hot_sections.py IMAGE.elf --root FUNCTION... [--without FUNCTION...] --out hot.ld

The image has to be linked with --emit-relocs. What is reached through data that changes is not seen. Functions
whose address is taken count as reached, text for people (string literals) does not.
"""
import argparse
import sys
from pathlib import Path

sys.dont_write_bytecode = True
from image_graph import Image  # noqa: E402


def sections(image, roots, without):
    """Patterns of input sections, each once."""
    low, high = image.symbols["port_flash"], image.symbols["port_store"]
    patterns = []
    for item in image.reachable(roots, without):
        if not low <= item.address < high:
            continue  # variables and registers
        for name in item.names:
            if item.is_function:
                patterns += [f"*(.text.{name})", f"*(.text.*.{name})"]
            else:
                patterns.append(f"*(.rodata.{name} .rodata.cst*.{name})")
    return list(dict.fromkeys(patterns))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("image", type=Path)
    parser.add_argument("--root", nargs="+", required=True)
    parser.add_argument("--without", nargs="*", default=[], help="stay in flash, with what only they reach")
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    lines = sections(Image(options.image), options.root, options.without)
    options.out.write_text("".join(f"{line}\n" for line in lines))


if __name__ == "__main__":
    main()
