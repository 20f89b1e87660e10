"""What the flashed image may take: flash, memory, stack in the worst nesting of interrupts; no heap; and that what the
control interrupt reaches is in CCM SRAM.

usage: limits.py IMAGE.elf MANIFEST.yaml     exit code 0: all within the budgets of the manifest (firmware/images)

What may stay in flash, with what only it reaches, the manifest names by `in_flash`.

The stack is the sum over the priorities: the deepest of thread and of the handlers of each, plus the frame that the
processor stacks; before hal_start() there are no interrupts but faults. Frames are read from the instructions; where the compiler wrote one down (-fstack-usage), the larger
of the two counts.
"""
import argparse
import sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tools"))
import gen_images  # noqa: E402
from image_graph import Image  # noqa: E402

EXCEPTION_FRAME = 36  # eight words, and one to align
THREAD = "port_reset"
# by priority; handlers of one priority do not interrupt each other
INTERRUPTS = [["port_slow"], ["port_can_received", "port_console_sent"], ["port_monitor"], ["port_control"]]
FAULTS = [["port_nmi"], ["fault_entry"]]
# The start, at whose end hal_start() lets interrupts come, and how the names of that part of the port begin.
START = "app_boot"
STARTED = ("hal_start", "system_", "measure_run", "bridge_run", "clock_")
HEAP = ("malloc", "calloc", "realloc", "free", "_sbrk", "_malloc_r", "_free_r")


def compiler_frames(path):
    frames = {}
    for file in path.parent.glob(path.name + ".*.su"):
        for line in file.read_text().splitlines():
            place, size, _ = line.split("\t")
            name = place.rsplit(":", 1)[1]
            frames[name] = max(int(size), frames.get(name, 0))
    return frames


def deepest(image, item, frames, running, above=()):
    """(bytes, names) of the deepest chain of calls."""
    if item in above:
        sys.exit(f"limits.py: {item.name} calls itself: its stack has no bound")
    if item.indirect:
        sys.exit(f"limits.py: {item.name} calls through a pointer ({item.indirect[0]}): its stack has no bound")
    own = max([item.frame] + [frames.get(name, 0) for name in item.names])
    called = [image.items[address] for address in sorted(item.calls)]
    if running and item.name.split(".")[0] == START:
        called = [other for other in called if other.name.startswith(STARTED)]
    below = [deepest(image, other, frames, running, (*above, item)) for other in called]
    size, names = max(below, default=(0, ()))
    return own + size, (item.name, *names)


def stack(image, frames, running):
    levels = (INTERRUPTS if running else []) + FAULTS
    total = 0
    for extra, names in [(0, [THREAD])] + [(EXCEPTION_FRAME, names) for names in levels]:
        size, chain = max(deepest(image, image.function(name), frames, running) for name in names)
        total += size + extra
        print(f"  {size + extra:5} bytes: {' > '.join(chain)}")
    return total


def outside_ccm(image, without):
    low, high = image.symbols["port_flash"], image.symbols["port_store"]
    return sorted(item.name for item in image.reachable(["port_control"], without) if low <= item.address < high)


def check(what, figure, most):
    print(f"{'ok  ' if figure <= most else 'FAIL'} {what}: {figure} of {most} bytes")
    return figure <= most


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("image", type=Path)
    parser.add_argument("manifest", type=Path)
    options = parser.parse_args()
    path = options.image
    manifest = gen_images.read(options.manifest)
    most = manifest.budgets
    image = Image(path)
    sizes = {name: section.size for name, section in image.sections.items()}
    flash = sum(sizes[name] for name in (".vectors", ".ccm", ".text", ".rodata", ".data"))
    ram = sum(sizes[name] for name in (".vectors_ccm", ".data", ".bss", ".noinit"))
    good = check("flash", flash, most["flash"])
    good &= check("static memory without stack", ram, most["ram"])
    good &= check("CCM SRAM", sizes[".vectors_ccm"] + sizes[".ccm"], most["ccm"])
    frames = compiler_frames(path)
    print("stack by rising priority, until interrupts come:")
    good &= check("stack of the start", stack(image, frames, False), most["stack"])
    print("stack by rising priority, with interrupts:")
    good &= check("stack", stack(image, frames, True), most["stack"])
    reserved = image.symbols["port_stack_top"] - image.symbols["port_stack_bottom"]
    good &= check("stack beside what is reserved", most["stack"], reserved)
    for name in outside_ccm(image, manifest.in_flash):
        print(f"FAIL the control interrupt reaches {name} in flash")
        good = False
    for name in sorted(set(HEAP) & set(image.symbols)):
        print(f"FAIL heap: {name}")
        good = False
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
