"""No floating point in cross-built libraries and images: refuses soft-float helpers and FPU instructions.

Usage: no_float.py LIBRARY_OBJECT_OR_IMAGE...   Prints member, function and what was found; exit status 1 if anything was.
Also lists, as information, who divides 64-bit numbers: __aeabi_ldivmod takes hundreds of instructions.
"""
import re
import sys
from pathlib import Path

from machine import machine_of, run

# Run-time ABI for Arm 4.1: f* and d* are float and double, *2f and *2d make them; libgcc's own names follow GCC's
# modes (sf, df, hf). libm's functions are floating point too.
HELPER = re.compile(
    r"__aeabi_([fd]\w+|h2f\w*|(?:i|ui|l|ul)2[fd]|cf\w+|cd\w+)$"
    r"|__gnu_[hfd]2[hfd]\w*$"
    r"|__(?:add|sub|mul|div|neg|eq|ne|lt|le|gt|ge|cmp|unord|fix|fixuns|float|floatun|extend|trunc|pow)\w*[sdh]f\w*$"
    r"|(?:sin|cos|tan|asin|acos|atan|atan2|sqrt|fabs|floor|ceil|round|lround|fmod|pow|exp|log|hypot|fma)f?$")
DIVISION = re.compile(r"__aeabi_u?ldivmod$|__u?(?:div|mod|divmod)di[34]$")
MEMBER = re.compile(r"(\S+):\s+file format")
FUNCTION = re.compile(r"[0-9a-f]+ <(.+)>:$")
RELOCATION = re.compile(r"\s+[0-9a-f]+: R_(?:ARM|RISCV)_\S+\s+([\w.$]+)")
INSTRUCTION = re.compile(r"\s*[0-9a-f]+:\t(?:[0-9a-f]{4,8} ?)+\s*\t(\S+)")


def findings(archive):
    """Yields (member, function, kind, what); kind is 'float', 'divides' or 'function' once for each function."""
    machine = machine_of(archive)
    member = function = "?"
    for line in run(machine.prefix + "objdump", "-dr", archive).splitlines():
        match = MEMBER.search(line)
        if match:
            member = Path(match.group(1)).name
            continue
        match = FUNCTION.match(line)
        if match:
            function = match.group(1)
            yield member, function, "function", ""
            if HELPER.match(function):  # linked in
                yield member, function, "float", function
            continue
        match = RELOCATION.match(line)
        if match:
            name = match.group(1)
            if HELPER.match(name):
                yield member, function, "float", name
            elif DIVISION.match(name):
                yield member, function, "divides", name
            continue
        match = INSTRUCTION.match(line)
        if match and machine.fpu.match(match.group(1)):
            yield member, function, "float", match.group(1)


def main():
    bad = set()
    divides = set()
    functions = 0
    for archive in sys.argv[1:]:
        for member, function, kind, what in findings(archive):
            functions += kind == "function"
            if kind == "float":
                bad.add(f"{member}: {function}: {what}")
            elif kind == "divides":
                divides.add(f"{member}: {function}: {what}")
    for text in sorted(divides):
        print("note: 64-bit division:", text)
    for text in sorted(bad):
        print("floating point:", text)
    print(f"{functions} functions, {len(bad)} uses of floating point")
    # Nothing looked at is not a pass.
    sys.exit(1 if bad or functions == 0 else 0)


if __name__ == "__main__":
    main()
