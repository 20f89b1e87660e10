"""Who may know whom: reads every #include of the tree and refuses the ones against the arrows.

  app -> drive -> {control, observers, injection, bldc} -> params -> math      can -> params      app -> can, hal

An arrow may be followed more than one step. Also refused: floating point in the firmware, system headers the
target's control code has no business with, shifts outside firmware/math, and including a .c file.
Usage: check_arrows.py [ROOT]
"""
import re
import sys
from pathlib import Path

SUFFIXES = {".c", ".h", ".def", ".cc", ".cpp", ".hpp"}

# Folder -> module. The longest matching folder wins.
MODULES = {
    "firmware/math": "math",
    "firmware/control": "control",
    "firmware/drive": "drive",
    "firmware/params": "params",
    "firmware/images": "images",
    "firmware/can": "can",
    "firmware/app": "app",
    "observers": "observers",
    "injection": "injection",
    "bldc": "bldc",
    "hal/linux": "hal_linux",
    "hal/sim": "hal_sim",
    "hal": "hal",
    "sim_plant": "sim_plant",
    "tools": "tools",
    "tests": "tests",
}

ARROWS = {
    "math": set(),
    "control": {"params"},
    "observers": {"params"},
    "injection": {"params"},
    "bldc": {"params"},
    "drive": {"control", "observers", "injection", "bldc"},
    "params": {"math"},
    "images": set(),
    "can": {"params"},
    "app": {"drive", "can", "params", "hal"},
    "hal": set(),
    "hal_linux": {"hal"},
    "hal_sim": {"hal", "sim_plant"},
    "sim_plant": set(),
}
FREE = {"tools", "tests"}  # may see everything: they put the parts together

# A port fills and empties the drive's structs, so it sees the drive's own headers but nothing below them.
ONE_STEP = {"hal": {"drive"}, "hal_sim": {"drive", "app"}}

FIRMWARE = ("math", "control", "drive", "params", "images", "can", "app", "observers", "injection", "bldc")
SHIFTLESS = ("control", "drive", "observers", "injection", "bldc")  # the arithmetic of formats is in math
# Headers that bring types and constants, and string.h, which a compiler may call anyway.
FIRMWARE_SYSTEM = {"stdint.h", "stdbool.h", "stddef.h", "limits.h", "string.h", "arm_acle.h"}

INCLUDE = re.compile(r'\s*#\s*include\s*([<"])([^>"]+)[>"]')
FLOATING = re.compile(r"\b(float|double|_Complex)\b")
SHIFT = re.compile(r"<<|>>")
FLAG = re.compile(r"\s*[A-Z0-9_]+ = 1U? << \d+,?\s*$")  # one bit of an enumeration
NOT_CODE = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'', re.DOTALL)


def module_of(path):
    """Module of a path relative to the root, or None."""
    for parent in [path, *path.parents]:
        if parent.as_posix() in MODULES:
            return MODULES[parent.as_posix()]
    return None


def reachable(module):
    seen, todo = {module}, [module]
    while todo:
        for below in ARROWS[todo.pop()] - seen:
            seen.add(below)
            todo.append(below)
    return seen | ONE_STEP.get(module, set())


def blank(match):
    """Comments and literals become blanks, so that line numbers stay."""
    return re.sub(r"[^\n]", " ", match.group())


def resolve(root, file, name):
    """The included file relative to the root, looked up as the compiler does; None if it is not ours."""
    for folder in (file.parent, Path()):
        candidate = (root / folder / name).resolve()
        if candidate.is_file() and candidate.is_relative_to(root):
            return candidate.relative_to(root)
    return None


def check_include(root, file, module, bracket, name):
    """The broken rule, or None."""
    if name.endswith((".c", ".cc", ".cpp")):
        return f'includes the source file "{name}"'
    target = resolve(root, file, name)
    if target is None:
        if bracket == '"' and module in ARROWS:
            return f'"{name}" is not a path from the root of the repository'
        if module in FIRMWARE and name not in FIRMWARE_SYSTEM:
            return f"firmware may not use <{name}>"
        return None
    if module in FIRMWARE and name != target.as_posix():
        return f'"{name}" must be written as "{target.as_posix()}"'
    other = module_of(target)
    if module in ARROWS and other not in reachable(module):
        return f"{module} may not know {other} ({target.as_posix()})"
    return None


def check_file(root, file):
    """(line, rule) of everything wrong in one file."""
    module = module_of(file)
    if module is None:
        return [(1, "no module of the architecture covers this folder")]
    text = (root / file).read_text()
    code = NOT_CODE.sub(blank, text)
    found = []
    for number, (line, bare) in enumerate(zip(text.split("\n"), code.split("\n")), start=1):
        include = INCLUDE.match(line) if bare.lstrip().startswith("#") else None
        if include:
            rule = check_include(root, file, module, include.group(1), include.group(2))
            if rule:
                found.append((number, rule))
        floating = FLOATING.search(bare) if module in FIRMWARE else None
        if floating:
            found.append((number, f"firmware has no floating point: {floating.group()}"))
        if module in SHIFTLESS and SHIFT.search(bare) and not FLAG.match(bare):
            found.append((number, "shifts belong into firmware/math"))
    return found


def check_tree(root):
    """Number of files read and the list of messages."""
    root = root.resolve()
    tops = sorted({folder.split("/")[0] for folder in MODULES})
    files = [path.relative_to(root) for top in tops for path in sorted((root / top).rglob("*"))
             if path.suffix in SUFFIXES and path.is_file()]
    messages = [f"{file.as_posix()}:{line}: {rule}" for file in files for line, rule in check_file(root, file)]
    return len(files), messages


def main():
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[2]
    count, messages = check_tree(root)
    for message in messages:
        print(message)
    print(f"{count} files, {len(messages)} violations")
    sys.exit(1 if messages or count == 0 else 0)


if __name__ == "__main__":
    main()
