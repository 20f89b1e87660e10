"""A copy of the project in out/mutate/tree with mutants in it, and its build."""
import os
import re
import shutil
import subprocess
from pathlib import Path

import sites

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "out" / "mutate"
TREE = OUT / "tree"
BUILD = TREE / "out" / "build" / "host-release"
HERE = Path(__file__).resolve().parent
# Programs that are built: those of tests, and the simulator.
PROGRAMS = re.compile(r"^(tests/(unit|contract)/|tools/pmsim/)[^:]*(?=: CXX_EXECUTABLE_LINKER)", re.M)


def arguments(file):
    plus_plus = Path(file).suffix == ".cpp"
    return ["-x", "c++" if plus_plus else "c", "-std=c++17" if plus_plus else "-std=c11", f"-I{ROOT}"]


def _write(path, text):
    """Only if it changes, as ninja looks at the time of files."""
    data = text if isinstance(text, bytes) else text.encode()
    if not path.exists() or path.read_bytes() != data:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def with_mutants(file, chosen):
    """The file with these mutants: (site, numbers) each. Those that do not compile are left out; returns the numbers
    left."""
    raw = (ROOT / file).read_bytes()
    # A mutant need not be good style.
    quiet = "#pragma GCC system_header\n" if file.endswith(".h") else ""
    declared = "#define PM_MUTANT(x) (pm_mutant_alive == (x))\nextern int pm_mutant_alive;\n"
    while True:
        text = sites.render(raw, chosen)
        wrong = sites.errors(ROOT / file, declared + text, arguments(file))
        if not wrong:
            break
        lines = (declared + text).split("\n")
        bad = {int(n) for line in wrong if line for n in re.findall(r"PM_MUTANT\((\d+)\)", lines[line - 1])}
        kept = [(site, numbers) for site, numbers in chosen if not bad & set(numbers)]
        if len(kept) == len(chosen):
            raise SystemExit(f"{file}: does not compile with mutants, line {wrong[0]} of the changed text")
        chosen = kept
    return f'{quiet}#include "mutation_chosen.h"\n#line 1\n{text}', [number for _, numbers in chosen for number in numbers]


def write(changed):
    """changed: file -> text."""
    listing = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT,
                             capture_output=True, check=True).stdout.decode()
    for name in filter(None, listing.split("\0")):
        source = ROOT / name
        if name == "CMakeLists.txt" or not source.is_file():
            continue
        target = TREE / name
        _write(target, changed.get(name, source.read_bytes()))
        shutil.copymode(source, target)
    _write(TREE / "mutation_chosen.h", (HERE / "chosen.h").read_text())
    _write(TREE / "CMakeLists.txt", (ROOT / "CMakeLists.txt").read_text() + _quiet(changed))


def _quiet(changed):
    """No warnings of the changed sources, in each folder that may compile them."""
    lines = []
    for name in sorted(changed):
        folders = [str(folder) for folder in Path(name).parents if (ROOT / folder / "CMakeLists.txt").exists()]
        folders = [folder for folder in [*folders, "tests/unit/drive"] if folder != "."]
        if not name.endswith(".h"):
            lines.append(f"set_source_files_properties(${{PROJECT_SOURCE_DIR}}/{name} DIRECTORY {' '.join(folders)}"
                         " PROPERTIES COMPILE_OPTIONS -w)\n")
    return "".join(lines)


def build(jobs):
    environment = dict(os.environ, CCACHE_BASEDIR=str(TREE))
    chosen = OUT / "chosen.o"
    log = OUT / "build.log"
    subprocess.run(["gcc", "-O2", "-c", str(HERE / "chosen.c"), "-o", str(chosen)], check=True)
    with log.open("w") as output:
        def run(command):
            result = subprocess.run(command, cwd=TREE, env=environment, stdout=output, stderr=output, check=False)
            if result.returncode:
                raise SystemExit(f"tools/mutate: the build failed: {log}")
        run(["cmake", "--preset", "host-release", f"-DCMAKE_EXE_LINKER_FLAGS={chosen}"])
        targets = subprocess.run(["ninja", "-C", str(BUILD), "-t", "targets", "all"], capture_output=True, text=True,
                                 check=True).stdout
        programs = [match[0] for match in PROGRAMS.finditer(targets)]
        run(["ninja", "-C", str(BUILD), f"-j{jobs}", *programs])
