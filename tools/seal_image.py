#!/usr/bin/env python3
"""Write the CRC of an image behind it: section .seal, its last eight bytes, from which the start-up sees whether flash
holds what was built. CRC-32 as zlib's, of all bytes before; then its complement.

usage: seal_image.py IMAGE.elf [--objcopy PROGRAM]
"""
import argparse
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

SEAL_BYTES = 8


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("image", type=Path)
    parser.add_argument("--objcopy", default="arm-none-eabi-objcopy")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        flat, seal = Path(folder, "image.bin"), Path(folder, "seal.bin")
        subprocess.run([options.objcopy, "-O", "binary", options.image, flat], check=True)
        content = flat.read_bytes()[:-SEAL_BYTES]
        if len(content) % SEAL_BYTES != 0:
            sys.exit(f"{options.image}: {len(content)} bytes before .seal, no multiple of {SEAL_BYTES}: gaps between sections?")
        crc = zlib.crc32(content)
        seal.write_bytes(struct.pack("<II", crc, crc ^ 0xFFFFFFFF))
        subprocess.run([options.objcopy, "--update-section", f".seal={seal}", options.image], check=True)


if __name__ == "__main__":
    main()
