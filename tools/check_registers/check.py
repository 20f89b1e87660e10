#!/usr/bin/env python3
"""The port's own register headers beside an independent description of the processor, the Rust crates stm32-metapac
(generated from the vendor's files) and cortex-m.

usage: check.py [--facts FILE] [--verbose]

Compared: addresses of peripherals (registers.ld), offsets of every member, position and width of every field mask,
interrupt numbers, sizes of memories, alternate functions of the pins, and the values of VALUES. The values in C are
taken by a C compiler, from _Static_assert. Not compared, and counted: what the crates do not know (bits of the core's
registers, keys, the layout of a CAN element).
Exit code 0: all agree; 1: not; 77: no cargo, or no connection to the registry.
"""
import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PORT = ROOT / "hal/stm32g431"
FOLDER = PORT / "registers"

# Names that the crate spells in its own way: struct.member -> (name, index)
REGISTERS = {
    "tim_t.CCMR1": ("ccmr_output", 0), "tim_t.CCMR2": ("ccmr_output", 1), "adc_t.SMPR1": ("smpr", None),
    "dac_t.DHR12R1": ("dhr12r", 0), "dac_t.DHR12R2": ("dhr12r", 1), "dbgmcu_t.APB1FZR1": ("apb1lfzr", None),
    "dbgmcu_t.APB1FZR2": ("apb1hfzr", None), "fdcan_t.RXF0S": ("rxfs", 0), "fdcan_t.RXF0A": ("rxfa", 0),
    "fdcan_ram_t.RXFIFO0": ("rxfifo0", 0), "fdcan_ram_t.RXFIFO1": ("rxfifo1", 0), "fdcan_ram_t.TXBUF": ("txbuf", 0),
}
# macro -> (name, index)
FIELDS = {
    "TIM_SR_BIF": ("bif", 0), "TIM_SR_SBIF": ("sbif", None), "TIM_BDTR_BKE": ("bke", 0), "TIM_BDTR_BKP": ("bkp", 0),
    "TIM_BDTR_BKF": ("bkf", 0), "TIM_AF1_BKINE": ("bkine", None), "OPAMP_CSR_OPAEN": ("opampen", None),
    "TIM_CCMR1_OC2PE": ("ocpe", 1), "TIM_CCMR2_OC3PE": ("ocpe", 0), "TIM_CCMR2_OC4PE": ("ocpe", 1),
    "ADC_SMPR1_SMP1": ("smp", 1), "ADC_SMPR1_SMP3": ("smp", 3), "ADC_SMPR1_SMP5": ("smp", 5),
    "ADC_SMPR2_SMP11": ("smp", 1), "ADC_SMPR2_SMP12": ("smp", 2), "DBGMCU_APB2FZR_TIM1": ("tim1", None),
    "FDCAN_IR_RF0N": ("rfn", 0), "FDCAN_IR_RF0L": ("rfl", 0), "FDCAN_IE_RF0NE": ("rfne", 0),
    "FDCAN_IE_RF0LE": ("rfle", 0), "FDCAN_ILE_EINT0": ("eint0", None), "FDCAN_RXF0S_F0FL": ("ffl", None),
    "FDCAN_RXF0S_F0GI": ("fgi", None), "FDCAN_RXF0A_F0AI": ("fai", None),
}
# Masks of one bit less than the crate's field: the fourth bit of OCxM stands elsewhere.
SPLIT = {"TIM_CCMR1_OC1M", "TIM_CCMR1_OC2M", "TIM_CCMR2_OC3M", "TIM_CCMR2_OC4M"}
# Where the crate is wrong: macro -> what it says, what RM0440 says (position, width).
ERRORS = {"PWR_CR5_R1MODE": ((0, 1), (8, 1))}
# enumerator -> fieldset, field, variant
VALUES = {
    "TIM_CMS_CENTRE": ("timer.v2.Cr1Gp16", "cms", "CENTER_ALIGNED1"),
    "TIM_MMS2_OC4REF": ("timer.v2.Cr2Adv", "mms2", "COMPARE_OC4"),
    "TIM_OCM_PWM1": ("timer.v2.CcmrOutputGp16", "ocm", "PWM_MODE1"),
    "TIM_OCM_PWM2": ("timer.v2.CcmrOutputGp16", "ocm", "PWM_MODE2"),
    "ADC_SMP_6_5": ("adc.g4.Smpr", "smp", "CYCLES6_5"),
    "ADC_SMP_247_5": ("adc.g4.Smpr2", "smp", "CYCLES247_5"),
    "ADC_JEXTEN_RISING": ("adc.g4.Jsqr", "jexten", "RISING_EDGE"),
    "ADC_CKMODE_DIV_4": ("adccommon.g4.Ccr", "ckmode", "SYNC_DIV4"),
    "RCC_PLLSRC_HSI": ("rcc.g4.Pllcfgr", "pllsrc", "HSI"),
    "RCC_PLLSRC_HSE": ("rcc.g4.Pllcfgr", "pllsrc", "HSE"),
    "RCC_SW_PLL": ("rcc.g4.Cfgr", "sw", "PLL1_R"),
    "RCC_HPRE_DIV_2": ("rcc.g4.Cfgr", "hpre", "DIV2"),
    "RCC_FDCANSEL_PCLK1": ("rcc.g4.Ccipr", "fdcansel", "PCLK1"),
    "OPAMP_VM_PGA": ("opamp.v5.Csr", "vm_sel", "PGA"),
    "OPAMP_GAIN_16_BIAS_VINM0": ("opamp.v5.Csr", "pga_gain", "GAIN16_INPUT_VINM0"),
    "COMP_INM_DAC3": ("comp.v2.Csr", "inmsel", "DACA"),
    "COMP_HYST_10_MV": ("comp.v2.Csr", "hyst", "HYST10M"),
    "DAC_MODE_INTERNAL": ("dac.v7.Mcr", "mode", "NORMAL_INT_BUFDIS"),
}
UNKNOWN_STRUCTS = {"fdcan_element_t"}

STRUCT = re.compile(r"typedef struct \{\n(.*?)\} (\w+);", re.DOTALL)
MEMBER = re.compile(r"^ +\w+ (\w+)(\[[^\]]*\])?;", re.MULTILINE)
MACRO = re.compile(r"^#define (\w+) +(\(.*<<.*\))", re.MULTILINE)
OBJECTS = re.compile(r"^extern (\w+) (.+);", re.MULTILINE)
PIN = re.compile(r"\{&GPIO(\w), (\d+), MODE_FUNCTION, (\d+), .*?\}, +/\* (\w+?)_(\w+)")
MEMORY = re.compile(r"^ +(\w+) \(\w+\) *: ORIGIN = (0x\w+), LENGTH = (\d+)K", re.MULTILINE)


def facts_of_crates():
    cargo = shutil.which("cargo") or shutil.which("cargo", path=str(Path.home() / ".cargo/bin"))
    if cargo is None:
        print("check_registers: there is no cargo (Debian: apt-get install cargo): skipped")
        sys.exit(77)
    target = ROOT / "out/register_facts"
    command = [cargo, "run", "--release", "--quiet", "--locked", "--manifest-path", HERE / "Cargo.toml", "--target-dir", target]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode != 0:
        offline = re.search(r"failed to (get|download|fetch)|[Cc]ould not resolve|spurious network", result.stderr)
        print(result.stderr, end="")
        print(f"check_registers: {'no connection to the registry: skipped' if offline else 'cargo has failed'}")
        sys.exit(77 if offline else 1)
    return result.stdout


class Facts:
    def __init__(self, text):
        self.peripherals, self.registers, self.fields, self.values = {}, {}, {}, {}
        self.interrupts, self.pins, self.memories = {}, set(), {}
        for line in text.splitlines():
            kind, *rest = line.split()
            getattr(self, f"_{kind}")(*rest)

    def _memory(self, name, address, size):
        self.memories[int(address)] = int(size)

    def _interrupt(self, name, number):
        self.interrupts[name] = int(number)

    def _pin(self, peripheral, signal, pin, function):
        self.pins.add((peripheral, signal, pin, function))

    def _peripheral(self, name, address, block):
        self.peripherals[name] = (int(address), block)

    def _register(self, block, name, index, offset, fieldset):
        self.registers[(block, name, None if index == "-" else int(index))] = (int(offset), fieldset)

    def _field(self, fieldset, name, index, position, width):
        self.fields[(fieldset, name, None if index == "-" else int(index))] = (int(position), int(width))

    def _value(self, fieldset, field, name, value):
        self.values[(fieldset, field, name)] = int(value)


def guesses(name):
    """How the crate may call what the manual calls so: in small letters, or an array that counts from one."""
    name = name.lower()
    yield name, None
    yield name, 0
    for match in re.finditer(r"\d+", name):
        yield name[:match.start()] + name[match.end():], int(match[0]) - 1


def find(table, key, name, alias):
    for candidate in ([alias] if alias else guesses(name)):
        if (key, *candidate) in table:
            return table[(key, *candidate)]
    return None


class Check:
    def __init__(self, facts):
        self.facts = facts
        self.asserts, self.messages, self.unknown = [], [], []
        self.compared = 0
        text = {path.name: path.read_text() for path in sorted(FOLDER.glob("*.h"))}
        self.source = "\n".join(text.values())
        self.headers = list(text)
        self.structs = {name: MEMBER.findall(body) for body, name in STRUCT.findall(self.source)}
        self.blocks = {}  # struct -> block of the facts

    def expect(self, expression, value, what):
        self.compared += 1
        self.asserts.append(f'_Static_assert(({expression}) == {value}U, "{what} is not {value:#x}");')

    def same(self, mine, theirs, what):
        self.compared += 1
        if mine != theirs:
            self.messages.append(f"{what}: {mine:#x}, the crate says {theirs:#x}")

    def addresses(self):
        script = dict(re.findall(r"^(\w+) = (0x\w+);", (FOLDER / "registers.ld").read_text(), re.MULTILINE))
        declared = {}
        for struct, names in OBJECTS.findall(self.source):
            declared.update({name.strip(): struct for name in names.split(",")})
        for name in sorted(set(script) ^ set(declared)):
            self.messages.append(f"{name}: declared or placed, but not both")
        for name, struct in declared.items():
            if name not in self.facts.peripherals:
                self.messages.append(f"{name}: the crate has no such peripheral")
                continue
            address, block = self.facts.peripherals[name]
            self.same(int(script.get(name, "0"), 16), address, name)
            # a struct may serve a smaller sibling: TIM2 has all but the members that only TIM1 has
            self.blocks.setdefault(struct, block)

    def members(self):
        for struct, members in self.structs.items():
            for name, array in members:
                if name.startswith("reserved") or struct in UNKNOWN_STRUCTS or name in ("filters", "events"):
                    continue
                found = find(self.facts.registers, self.blocks.get(struct), name, REGISTERS.get(f"{struct}.{name}"))
                if found is None:
                    self.unknown.append(f"{struct}.{name}")
                    continue
                self.expect(f"offsetof({struct}, {name})", found[0], f"offset of {struct}.{name}")

    def fieldset(self, macro):
        """Fieldset and field of a macro PERIPHERAL_REGISTER_FIELD."""
        for struct, members in self.structs.items():
            prefix = struct[:-2].upper().removesuffix("_COMMON") + "_"
            for name, _ in sorted(members, key=lambda m: -len(m[0])):
                if macro.startswith(f"{prefix}{name}_"):
                    found = find(self.facts.registers, self.blocks.get(struct), name, REGISTERS.get(f"{struct}.{name}"))
                    return (found[1] if found else None), macro[len(prefix) + len(name) + 1:]
        return None, macro

    def fields(self):
        for macro, _ in MACRO.findall(self.source):
            fieldset, field = self.fieldset(macro)
            if macro in SPLIT:
                self.split_field(macro, fieldset)
                continue
            found = find(self.facts.fields, fieldset, field, FIELDS.get(macro))
            if found is None:
                self.unknown.append(macro)
                continue
            if macro in ERRORS:
                says, found = ERRORS[macro][0], ERRORS[macro][1]
                if says != find(self.facts.fields, fieldset, field, None):
                    self.messages.append(f"{macro}: the crate has changed, look again")
            position, width = found
            self.expect(macro, ((1 << width) - 1) << position, macro)

    def split_field(self, macro, fieldset):
        """OCxM is in two parts, whose place the facts do not give; the preload bit stands right below the lower one."""
        half = 1 if macro[-2] in "24" else 0
        position, _ = self.facts.fields[(fieldset, "ocpe", half)]
        self.expect(macro, 7 << (position + 1), macro)

    def others(self):
        for name, number in re.findall(r"IRQ_(\w+) = (\d+)", self.source):
            self.same(int(number), self.facts.interrupts[name], f"IRQ_{name}")
        for name, (fieldset, field, variant) in VALUES.items():
            value = self.facts.values.get((fieldset, field, variant))
            if value is None:
                self.unknown.append(name)
            else:
                self.expect(name, value, name)
        for port, pin, function, peripheral, signal in PIN.findall((PORT / "pins.c").read_text()):
            self.compared += 1
            if (peripheral, signal, f"P{port}{pin}", function) not in self.facts.pins:
                self.messages.append(f"P{port}{pin}: function {function} is not {peripheral}_{signal}")
        sizes = {int(address, 16): int(size) * 1024 for _, address, size in MEMORY.findall((PORT / "stm32g431.ld").read_text())}
        flash, ram, ccm = sizes[0x08000000] + sizes[0x0801F000], sizes[0x20000000], sizes[0x10000000]
        self.same(flash, self.facts.memories[0x08000000], "flash")
        self.same(ram, self.facts.memories[0x20000000] + self.facts.memories[0x20004000], "SRAM1 and SRAM2")
        self.same(ccm, self.facts.memories[0x10000000], "CCM SRAM")

    def compile(self):
        includes = [f'#include "hal/stm32g431/registers/{name}"' for name in self.headers]
        with tempfile.TemporaryDirectory() as folder:
            source = Path(folder) / "registers.c"
            source.write_text("\n".join(["#include <stddef.h>", *includes, *self.asserts, ""]))
            result = subprocess.run(["cc", "-std=c11", "-fsyntax-only", "-I", ROOT, source], capture_output=True, text=True)
        found = re.findall(r'static assertion failed: "(.*)"', result.stderr)
        self.messages += found
        if result.returncode != 0 and not found:
            self.messages.append(result.stderr)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--facts", type=Path, help="what the crates have said before")
    parser.add_argument("--verbose", action="store_true", help="name what could not be compared")
    options = parser.parse_args()
    check = Check(Facts(options.facts.read_text() if options.facts else facts_of_crates()))
    check.addresses()
    check.members()
    check.fields()
    check.others()
    check.compile()
    if options.verbose:
        print("not compared:", *check.unknown)
    for message in check.messages:
        print(message)
    print(f"{check.compared} definitions compared, {len(check.unknown)} unknown to the crates, {len(check.messages)} differ")
    sys.exit(1 if check.messages or check.compared < 250 else 0)


if __name__ == "__main__":
    main()
