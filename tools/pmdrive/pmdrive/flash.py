"""Writes an image, or a page of parameters, into the drive board through its debug port with OpenOCD, and verifies it.

For `pmdrive flash` and tools/flash, which runs this file alone: standard library only.
"""
import argparse
import os
import shlex
import shutil
import struct
import subprocess
import sys
import zlib
from pathlib import Path

PAGE_ADDRESS, PAGE_SIZE = 0x0801F000, 2048
PAGE_HEADER, PAIR, PAGE_MAGIC = 16, 8, 0x33504D50  # firmware/params/store.h
ELF = b"\x7fELF"
FAILED, USAGE, NO_OPENOCD, NO_PROBE, NO_PROCESSOR = 1, 2, 3, 4, 5
EPILOG = """\
Exit codes: 0 written and verified; 2 usage; 3 OpenOCD is missing; 4 no probe; 5 no processor answers; 1 else.
The motor has to stand still and the bridge to be off: the processor is halted while flash is written."""
NO_PROBE_WORDS = ("open failed", "no device found", "unable to open", "couldn't open", "libusb_open")
NO_PROCESSOR_WORDS = ("init mode failed", "unable to connect", "cannot read idr", "no target", "error connecting dp")


class FlashError(Exception):
    def __init__(self, status, text, do=""):
        super().__init__(text)
        self.status, self.text, self.do = status, text, do


def add_options(parser):
    parser.add_argument("image", nargs="?", metavar="IMAGE.elf", help="the cross build makes it")
    parser.add_argument("--gpio", metavar="CHIP,SWCLK,SWDIO[,NRST]",
                        help="through the GPIO lines of a Linux host instead of an ST-LINK: number of the gpiochip, then "
                             "of its lines; wire ground as well")
    parser.add_argument("--parameters", metavar="PAGE.bin",
                        help=f"only the first page of the parameter store, at 0x{PAGE_ADDRESS:08X}; the image stays")
    parser.add_argument("--openocd", metavar="PROGRAM", default="openocd", help="default: openocd")
    parser.add_argument("--dry-run", action="store_true", help="print the command, do nothing")


def _is_page(data):
    """Whether the firmware would take it: store_check() of firmware/params/store.c."""
    if len(data) < PAGE_HEADER:
        return False
    magic, _, _, count = struct.unpack_from("<4I", data)
    end = PAGE_HEADER + PAIR * count
    if magic != PAGE_MAGIC or len(data) < end + 8:
        return False
    crc = zlib.crc32(data[:end])
    return struct.unpack_from("<2I", data, end) == (crc, crc ^ 0xFFFFFFFF)


def _program(options):
    """OpenOCD's own words: braces keep blanks in a path."""
    if bool(options.image) == bool(options.parameters):
        raise FlashError(USAGE, "an image is wanted, or --parameters with a page, not both")
    path = Path(options.parameters or options.image)
    if not path.is_file() or not os.access(path, os.R_OK):
        raise FlashError(USAGE, f"cannot read {path}")
    data = path.read_bytes()
    if not options.parameters:
        if not data.startswith(ELF):
            raise FlashError(USAGE, f"{path} is no ELF file", "a page of parameters is written with --parameters")
        return f"program {{{path}}} verify reset exit"
    if len(data) > PAGE_SIZE:
        raise FlashError(USAGE, f"{path} has {len(data)} bytes; a page has {PAGE_SIZE}")
    if not _is_page(data):
        raise FlashError(USAGE, f"{path} is no page of parameters, or it is damaged",
                         "`pmsim params --machine MACHINE.yaml --page PAGE.bin` makes one")
    return f"program {{{path}}} 0x{PAGE_ADDRESS:08X} verify reset exit"


def _lines(gpio):
    """Numbers of the chip, of SWCLK, of SWDIO, and perhaps of NRST."""
    numbers = gpio.split(",")
    if len(numbers) not in (3, 4) or not all(n.isascii() and n.isdigit() for n in numbers):
        raise FlashError(USAGE, f"--gpio wants CHIP,SWCLK,SWDIO[,NRST] as numbers, not {gpio}")
    return numbers


def _adapter(gpio):
    if gpio is None:
        return ["-f", "interface/stlink.cfg"]
    chip, swclk, swdio, *nrst = _lines(gpio)
    words = ["adapter driver linuxgpiod", f"adapter gpio swclk {swclk} -chip {chip}",
             f"adapter gpio swdio {swdio} -chip {chip}"]
    if nrst:
        words += [f"adapter gpio srst {nrst[0]} -chip {chip}", "reset_config srst_only srst_open_drain"]
    return [x for word in (*words, "transport select swd", "adapter speed 500") for x in ("-c", word)]


def command(options):
    """The words that start OpenOCD."""
    program = _program(options)
    return [options.openocd, *_adapter(options.gpio), "-f", "target/stm32g4x.cfg", "-c", program]


def _failure(status, log):
    said = log.lower()
    if any(words in said for words in NO_PROBE_WORDS):
        return FlashError(
            NO_PROBE, "no debug probe was found.",
            "Connect the board's USB socket (its ST-LINK), or name GPIO lines with --gpio.\n"
            "A probe that lsusb shows (0483:374b, 0483:374e ...) but this user may not open needs udev rules:\n"
            "/usr/lib/udev/rules.d/60-openocd.rules comes with openocd; plug in again after installing it.")
    if any(words in said for words in NO_PROCESSOR_WORDS):
        return FlashError(NO_PROCESSOR, "the probe works, but no processor answers:",
                          "is the board powered, and are SWCLK, SWDIO and ground wired?")
    return FlashError(FAILED, f"OpenOCD has failed with status {status}; its words are above")


def write(options, say=print):
    """Writes and verifies; what OpenOCD says goes to `say`. With --dry-run the command alone."""
    words = command(options)
    if options.dry_run:
        say(shlex.join(words))
        return
    if shutil.which(options.openocd) is None:
        raise FlashError(NO_OPENOCD, f"{options.openocd} is not installed:",
                         "tools/setup installs it, or: apt-get install openocd")
    if options.gpio is not None and not Path(f"/dev/gpiochip{_lines(options.gpio)[0]}").is_char_device():
        raise FlashError(NO_PROBE, f"there is no /dev/gpiochip{_lines(options.gpio)[0]};",
                         "gpiodetect lists the chips of this host")
    result = subprocess.run(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                            check=False)
    log = result.stdout.decode(errors="replace")
    if log:
        say(log.rstrip())
    if result.returncode != 0:
        raise _failure(result.returncode, log)


def main():
    parser = argparse.ArgumentParser(
        prog="tools/flash", epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Writes an image, or a page of parameters, into the drive board through its debug port.")
    add_options(parser)
    options = parser.parse_args()
    try:
        write(options)
    except FlashError as error:
        sys.stdout.flush()
        for line in (error.text, *error.do.splitlines()):
            print(f"tools/flash: {line}", file=sys.stderr)
        return error.status
    return 0


if __name__ == "__main__":
    sys.exit(main())
