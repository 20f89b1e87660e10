"""Which tools read a cross-built file, which of QEMU's machines runs it, and what a call looks like there."""
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

EM_ARM, EM_RISCV = 40, 243
# Architecture as the attributes of an Arm file name it -> QEMU's board (its linker script is in support/).
ARM_BOARDS = {"v6S-M": "microbit", "v6-M": "microbit", "v7E-M": "mps2-an386", "v8-M.mainline": "mps2-an505"}
# ARMv6-M has no long branch: there bl also jumps within a function, and to helpers that return into a jump table.
ARM_CALL = re.compile(r"blx?(eq|ne|cs|hs|cc|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le|al)?(\.[nw])?\s"
                      r"(?!.*<(__gnu_thumb1_case|.*\+0x))")
# A jump that leaves its return address elsewhere than in ra does not call by the ABI.
RISCV_CALL = re.compile(r"jalr?\s+(ra,|[^,]*$)")
ARM_FPU = re.compile("v")
RISCV_FPU = re.compile(r"(c\.)?f(?!ence)")


@dataclass(frozen=True)
class Machine:
    prefix: str  # of the cross tools
    qemu: tuple  # command that runs a program, without the program
    call: re.Pattern  # matches a disassembled instruction that calls
    fpu: re.Pattern  # matches the mnemonics of the floating-point unit


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def elf_machine(path):
    """e_machine of an ELF file, or of the first object of an archive."""
    data = Path(path).read_bytes()
    start = data.index(b"\x7fELF")
    return int.from_bytes(data[start + 18:start + 20], "little")


def machine_of(path):
    kind = elf_machine(path)
    if kind == EM_RISCV:
        # A core without the extensions that the program must not need.
        return Machine("riscv64-unknown-elf-",
                       ("qemu-system-riscv32", "-M", "virt", "-cpu", "sifive-e31", "-bios", "none"),
                       RISCV_CALL, RISCV_FPU)
    if kind == EM_ARM:
        attributes = run("arm-none-eabi-readelf", "-A", str(path))
        board = ARM_BOARDS[re.search(r"Tag_CPU_arch: (\S+)", attributes).group(1)]
        return Machine("arm-none-eabi-", ("qemu-system-arm", "-M", board), ARM_CALL, ARM_FPU)
    raise ValueError(f"{path}: processor {kind} is not known here")
