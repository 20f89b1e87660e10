"""What a linked image is made of, from its symbols, relocations and instructions: functions, objects, who refers to
whom, stack frames. The image must be linked with --emit-relocs. Used by tools/hot_sections.py and tests/target."""
import re
import subprocess
from bisect import bisect_right
from pathlib import Path

SYMBOL = re.compile(r"\s*\d+: ([0-9a-f]{8})\s+(\d+|0x[0-9a-f]+) (\w+)\s+(\w+)\s+\w+\s+(\w+) (\S+)")
RELOCATION = re.compile(r"([0-9a-f]{8})\s+[0-9a-f]{8} (R_ARM_\w+)\s+([0-9a-f]{8})\s+(\S+)")
SECTION = re.compile(r"\s*\[\s*\d+\] (\S+)\s+\S+\s+([0-9a-f]{8}) [0-9a-f]{6} ([0-9a-f]{6})")
VENEER = re.compile(r"__(.+)_veneer$")
LOADED = (".vectors", ".ccm", ".text", ".rodata", ".data")
INSTRUCTION = re.compile(r"\s*([0-9a-f]+):\t(?:[0-9a-f]{4,8} ?)+\s*\t(\S+)\s*(.*)")


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


class Section:
    def __init__(self, address, size):
        self.address, self.size = address, size


class Item:
    """A function or an object."""

    def __init__(self, name, address, size, is_function):
        self.names, self.address, self.size, self.is_function = [name], address, size, is_function
        self.refers = set()  # addresses of items
        self.calls = set()  # those of them that are called or jumped to
        self.frame = 0
        self.indirect = []  # calls through a register, as text

    @property
    def name(self):
        return self.names[0]


class Image:
    def __init__(self, path):
        self.path = Path(path)
        self.items = {}
        self._read_symbols()
        self._starts = sorted(self.items)
        self._read_relocations()
        self._read_code()

    def _read_symbols(self):
        self.symbols = {}
        for line in run("arm-none-eabi-readelf", "-sW", self.path).splitlines():
            match = SYMBOL.match(line)
            if not match:
                continue
            address, size, kind, name = int(match[1], 16), int(match[2], 0), match[3], match[6]
            self.symbols[name] = address
            if kind not in ("FUNC", "OBJECT") or size == 0:
                continue
            address -= address % 2 if kind == "FUNC" else 0
            if address in self.items:
                self.items[address].names.append(name)
            else:
                self.items[address] = Item(name, address, size, kind == "FUNC")

    def at(self, address):
        """The item that covers an address, or None."""
        index = bisect_right(self._starts, address) - 1
        if index < 0:
            return None
        item = self.items[self._starts[index]]
        return item if address < item.address + item.size else None

    def _read_relocations(self):
        """Targets are read from the linked words where the relocation names a section, else from its symbol."""
        self.sections = {}
        for line in run("arm-none-eabi-readelf", "-SW", self.path).splitlines():
            match = SECTION.match(line)
            if match:
                self.sections[match[1]] = Section(int(match[2], 16), int(match[3], 16))
        words = self._words()
        for line in run("arm-none-eabi-readelf", "-rW", self.path).splitlines():
            match = RELOCATION.match(line)
            if not match:
                continue
            place, kind, value = int(match[1], 16), match[2], int(match[3], 16)
            user = self.at(place)
            if user is None:
                continue
            if kind == "R_ARM_ABS32":
                value = words.get(place, value)
            target = self.at(value & ~1)
            if target is not None and target is not user:
                user.refers.add(target.address)

    def _words(self):
        """address -> word, of what is loaded from flash."""
        words = {}
        for name in LOADED:
            if name not in self.sections or self.sections[name].size == 0:
                continue
            for line in run("arm-none-eabi-objdump", "-s", "-j", name, self.path).splitlines():
                match = re.match(r" ([0-9a-f]{4,8}) ((?:[0-9a-f]{8} ){1,4})", line)
                if match:
                    for n, word in enumerate(match[2].split()):
                        words[int(match[1], 16) + 4 * n] = int.from_bytes(bytes.fromhex(word), "little")
        return words

    def _read_code(self):
        for line in run("arm-none-eabi-objdump", "-d", self.path).splitlines():
            match = INSTRUCTION.match(line)
            owner = self.at(int(match[1], 16)) if match else None
            if owner is None or not owner.is_function:
                continue
            read_instruction(owner, match[2], match[3])
            branch = re.match(r"(?:r\d+, )?([0-9a-f]+) <([^+>]+)", match[3]) if match[2].startswith(("b", "cb")) else None
            target = self._behind(int(branch[1], 16), branch[2]) if branch else None
            if target is not None and (target is not owner or match[2] == "bl"):
                owner.calls.add(target.address)
                owner.refers.add(target.address)

    def _behind(self, address, name):
        """The item that a branch goes to, if need be by way of a linker's veneer."""
        veneer = VENEER.match(name)
        return self.function(veneer[1]) if veneer else self.at(address)

    def function(self, name):
        for item in self.items.values():
            if name in item.names:
                return item
        raise SystemExit(f"{self.path.name}: no function {name}")

    def reachable(self, names, without=()):
        """Every item that these functions call, or refer to, at any depth, but for some and what only they reach."""
        todo = [self.function(name) for name in names]
        found = {}
        while todo:
            item = todo.pop()
            if item.address not in found and item.name.split(".")[0] not in without:
                found[item.address] = item
                todo.extend(self.items[address] for address in item.refers)
        return [found[address] for address in sorted(found)]


def read_instruction(item, mnemonic, operands):
    """Adds up what the function pushes: an upper bound where it does so in branches that exclude each other."""
    registers = re.search(r"\{(.*)\}", operands)
    if mnemonic.startswith("push") or (mnemonic.startswith("stmdb") and operands.startswith("sp!")):
        item.frame += 4 * count_registers(registers[1])
    elif re.match(r"subw?(\.w)?$", mnemonic) and re.match(r"sp, (sp, )?#", operands):
        item.frame += int(re.search(r"#(\d+)", operands)[1])
    elif mnemonic.startswith("str") and (step := re.search(r"\[sp, #-(\d+)\]!", operands)):
        item.frame += int(step[1])
    elif re.match(r"sub\w*(\.w)?$", mnemonic) and operands.startswith("sp,"):
        raise SystemExit(f"{item.name}: stack frame of variable size: {mnemonic} {operands}")
    elif mnemonic == "blx" or (mnemonic == "bx" and not operands.startswith("lr")):
        item.indirect.append(f"{mnemonic} {operands}")


def count_registers(text):
    order = [f"r{n}" for n in range(13)] + ["sp", "lr", "pc"]
    alias = {"sl": "r10", "fp": "r11", "ip": "r12", "r9": "r9"}
    count = 0
    for part in text.split(","):
        ends = [order.index(alias.get(name.strip(), name.strip())) for name in part.split("-")]
        count += ends[-1] - ends[0] + 1
    return count
