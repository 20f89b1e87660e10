#!/usr/bin/env python3
"""Size of the cross-built libraries: code, constants, data, state and stack, per module and object.

Reads the archives, stack-usage files and debug information of the stm32g431 build; writes size.md and size.json
to out/reports. State is what the caller provides: the sizes of the structs in the module's headers.
The deepest stack follows direct calls only; calls through pointers are not followed.
"""
import argparse
import json
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/target"))
from machine import machine_of, run  # noqa: E402 (found through the path above)

# library -> source folder
MODULES = {
    "pm_math": "firmware/math",
    "pm_control": "firmware/control",
    "pm_observers": "observers",
    "pm_injection": "injection",
    "pm_bldc": "bldc",
    "pm_drive": "firmware/drive",
    "pm_params": "firmware/params",
    "pm_app": "firmware/app",
    "pm_can": "firmware/can",
}
KINDS = ("code", "rodata", "data", "bss")
# RISC-V keeps what is small apart, in sections of their own.
SECTIONS = {".text": "code", ".rodata": "rodata", ".srodata": "rodata", ".data": "data", ".sdata": "data",
            ".bss": "bss", ".sbss": "bss"}
CALL = re.compile(r": R_(?:ARM_THM_(?:CALL|JUMP\w+)|RISCV_(?:CALL\w*|JAL|RVC_JUMP))\s+([\w.$]+)")
TYPEDEF = re.compile(r"^(?:\}|typedef struct \w+)\s*(\w+_t);", re.MULTILINE)
TAG = re.compile(r"^struct (\w+) \{", re.MULTILINE)  # struct x, whose typedef x_t may stand elsewhere


def section_sizes(archive):
    """object -> {code, rodata, data, bss} in bytes."""
    objects = {}
    current = None
    for line in run(machine_of(archive).prefix + "size", "-A", str(archive)).splitlines():
        header = re.match(r"(\S+)\s+\(ex ", line)
        if header:
            current = objects.setdefault(header.group(1), dict.fromkeys(KINDS, 0))
            continue
        section = re.match(r"(\.\w+)\S*\s+(\d+)\s", line)
        if section and section.group(1) in SECTIONS:
            current[SECTIONS[section.group(1)]] += int(section.group(2))
    return objects


def frames(folder):
    """(object, function) -> own stack frame in bytes."""
    found = {}
    for file in folder.rglob("*.su"):
        for line in file.read_text().splitlines():
            place, size, kind = line.split("\t")
            if kind != "static":
                sys.exit(f"size_report.py: {place} has a stack frame of unknown size ({kind})")
            found[(file.name[:-len(".su")] + ".obj", place.rsplit(":", 1)[1])] = int(size)
    return found


def calls(archive):
    """(object, function) -> names of the functions it calls or jumps to."""
    graph = {}
    member = function = None
    for line in run(machine_of(archive).prefix + "objdump", "-dr", str(archive)).splitlines():
        match = re.match(r"(\S+):\s+file format", line)
        if match:
            member = Path(match.group(1)).name
        match = re.match(r"[0-9a-f]+ <(.+)>:$", line)
        if match:
            function = graph.setdefault((member, match.group(1)), set())
        match = CALL.search(line)
        if match:
            function.add(match.group(1))
    return graph


def deepest(function, graph, own, by_name, seen=()):
    """Stack of a function with its deepest chain of calls."""
    if function in seen:
        sys.exit(f"size_report.py: {function[1]} calls itself, its stack has no bound")
    below = [0]
    for name in graph.get(function, ()):
        target = (function[0], name) if (function[0], name) in graph else by_name.get(name)
        if target:
            below.append(deepest(target, graph, own, by_name, (*seen, function)))
    return own.get(function, 0) + max(below)


def struct_sizes(archive):
    """typedef name -> bytes, from the debug information."""
    sizes, typedefs = {}, {}
    unit, tag, offset, name, size = "", "", "", None, None
    for line in run(machine_of(archive).prefix + "readelf", "--debug-dump=info", str(archive)).splitlines():
        match = re.match(r"\s*<\w+><(\w+)>: Abbrev Number: \d+ \((\w+)\)", line)
        if match:
            offset, tag, name = match.group(1), match.group(2), None
            continue
        if "Compilation Unit @" in line or line.startswith("File: "):
            unit += "."  # offsets repeat from object to object
        match = re.match(r"\s*<\w+>\s+(DW_AT_\w+)\s*:\s*(.*)", line)
        if not match:
            continue
        attribute, value = match.groups()
        if attribute == "DW_AT_name":
            name = value.rsplit(": ", 1)[-1].strip()
        elif attribute == "DW_AT_byte_size" and tag == "DW_TAG_structure_type":
            size = int(value.split()[0], 0)
            sizes[(len(unit), offset)] = size
        elif attribute == "DW_AT_type" and tag == "DW_TAG_typedef" and name:
            typedefs[name] = (len(unit), value.strip("<>").replace("0x", ""))
    return {name: sizes[target] for name, target in typedefs.items() if target in sizes}


def collect(build):
    archives = {name: build / folder / f"lib{name}.a" for name, folder in MODULES.items()}
    archives = {name: path for name, path in archives.items() if path.exists()}
    if not archives:
        sys.exit(f"size_report.py: no libraries in {build}; build its preset first")
    graph, own, structs = {}, {}, {}
    for path in archives.values():
        graph.update(calls(path))
        own.update(frames(path.parent))
        structs.update(struct_sizes(path))
    by_name = {function[1]: function for function in graph}
    report = {}
    for name, path in archives.items():
        objects = section_sizes(path)
        for member, row in objects.items():
            row["functions"] = {
                function[1]: {"frame": own.get(function, 0), "stack": deepest(function, graph, own, by_name)}
                for function in sorted(graph) if function[0] == member}
            row["frame"] = max((f["frame"] for f in row["functions"].values()), default=0)
            row["stack"] = max((f["stack"] for f in row["functions"].values()), default=0)
        report[name] = {"objects": objects, "total": total(objects)}
    for name, folder in MODULES.items():
        texts = [h.read_text() for h in sorted((ROOT / folder).glob("*.h"))]
        names = {n for text in texts for n in TYPEDEF.findall(text) + [f"{tag}_t" for tag in TAG.findall(text)]}
        state = {n: structs[n] for n in sorted(names) if n in structs}
        if state or name in report:
            report.setdefault(name, {"objects": {}, "total": total({})})["structs"] = state
    return report


def total(objects):
    rows = objects.values()
    return {**{kind: sum(row[kind] for row in rows) for kind in KINDS},
            **{kind: max((row[kind] for row in rows), default=0) for kind in ("frame", "stack")}}


def markdown(report):
    columns = [*KINDS, "frame", "stack"]
    lines = ["# Size on Cortex-M4", "", "Bytes, -O2. Frame is the largest of one function, stack the deepest chain of calls.",
             "", "| module | object | " + " | ".join(columns) + " | deepest |",
             "|---|---|" + "---:|" * len(columns) + "---|"]
    everything = {}
    for name, module in report.items():
        for member, row in module["objects"].items():
            everything[(name, member)] = row
            deep = max(row["functions"].items(), key=lambda f: f[1]["stack"], default=("", None))[0]
            lines.append(f"| {name} | {member.removesuffix('.obj')} | "
                         + " | ".join(str(row[c]) for c in columns) + f" | {deep} |")
        lines.append(f"| **{name}** | | " + " | ".join(f"**{module['total'][c]}**" for c in columns) + " | |")
    lines.append("| **all** | | " + " | ".join(f"**{total(everything)[c]}**" for c in columns) + " | |")
    lines += ["", "| module | struct | bytes |", "|---|---|---:|"]
    for name, module in report.items():
        lines += [f"| {name} | {struct} | {size} |" for struct, size in module.get("structs", {}).items()]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=ROOT / "out/build/stm32g431", help="build folder to read")
    parser.add_argument("--out", type=Path, default=ROOT / "out/reports", help="folder for size.md and size.json")
    options = parser.parse_args()
    report = collect(options.build)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "size.md").write_text(markdown(report))
    (options.out / "size.json").write_text(json.dumps(report, indent=1) + "\n")
    columns = [*KINDS, "frame", "stack"]
    print(f"{'module':<14}" + "".join(f"{c:>8}" for c in columns))
    for name, module in report.items():
        print(f"{name:<14}" + "".join(f"{module['total'][c]:>8}" for c in columns))
    print(f"by object and struct: {options.out / 'size.md'}")


if __name__ == "__main__":
    main()
