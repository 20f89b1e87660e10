"""tools/flash where it cannot work: every way to fail has its text and exit code, and the commands are as meant.

usage: flash_test.py TOOLS_FLASH

No board is written, even if one is connected: OpenOCD is a stand-in with prepared words, or the real one that is told
to look for a probe with a serial number that no probe has.
"""
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib
from pathlib import Path

FLASH = None
SAYS = {
    4: "Error: open failed",
    5: "Error: init mode failed (unable to connect to the target)",
    1: "Error: flash write failed",
}


def page(*pairs):
    """Of the parameter store, as firmware/params/store.h describes it."""
    words = struct.pack("<4I", 0x33504D50, 1, 0, len(pairs)) + b"".join(struct.pack("<Ii", *pair) for pair in pairs)
    crc = zlib.crc32(words)
    return words + struct.pack("<4I", crc, crc ^ 0xFFFFFFFF, 0x4C414553, 0x4C414553 ^ 0xFFFFFFFF)


class Flash(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = Path(self.folder.name)
        self.image = self.path / "an image.elf"
        self.image.write_bytes(b"\x7fELF" + b"\0" * 12)

    def tearDown(self):
        self.folder.cleanup()

    def run_flash(self, *arguments):
        result = subprocess.run([FLASH, *map(str, arguments)], capture_output=True, text=True, timeout=60)
        return result.returncode, result.stdout + result.stderr

    def program(self, text):
        path = self.path / "openocd"
        path.write_text("#!/bin/sh\n" + text)
        path.chmod(0o755)
        return path

    def test_missing_openocd(self):
        code, text = self.run_flash("--openocd", "no-such-program", self.image)
        self.assertEqual(code, 3, text)
        self.assertIn("tools/setup installs it", text)

    def test_words_of_openocd(self):
        for expected, words in SAYS.items():
            with self.subTest(words):
                code, text = self.run_flash("--openocd", self.program(f"echo '{words}' >&2\nexit 1\n"), self.image)
                self.assertEqual(code, expected, text)
                self.assertIn(words, text)
        self.assertEqual(self.run_flash("--openocd", self.program("exit 0\n"), self.image)[0], 0)

    @unittest.skipUnless(shutil.which("openocd"), "OpenOCD is not installed")
    def test_no_probe(self):
        real = self.program('exec openocd -c "adapter serial no-such-probe" "$@"\n')
        code, text = self.run_flash("--openocd", real, self.image)
        self.assertEqual(code, 4, text)
        self.assertIn("no debug probe was found", text)

    def test_no_gpio_chip(self):
        code, text = self.run_flash("--openocd", self.program("exit 0\n"), "--gpio", "987,1,2", self.image)
        self.assertEqual(code, 4, text)
        self.assertIn("/dev/gpiochip987", text)

    def test_refused(self):
        for arguments in ([], [self.path / "missing.elf"], ["--gpio", "0,1", self.image], ["--what"], [self.image, "b"],
                          ["--gpio", "0,1,2,3,4", self.image], ["--gpio"]):
            with self.subTest(arguments):
                self.assertEqual(self.run_flash(*arguments)[0], 2)

    def test_what_is_no_page_and_no_image(self):
        """OpenOCD would write it, over the set that the drive has."""
        good, path = page((0x210002, 6000000), (0x210003, 43000000)), self.path / "page.bin"
        damaged = good[:20] + bytes([good[20] ^ 1]) + good[21:]
        for words in (b"R_s: 6 ohm\n" * 20, b"", good[:15], good[:36], damaged, b"\0" * 2048, good + b"\xff" * 2048,
                      good[:12] + b"\xff\xff\xff\xff" + good[16:]):
            path.write_bytes(words)
            code, text = self.run_flash("--dry-run", "--parameters", path)
            self.assertEqual((code, "page" in text.splitlines()[0]), (2, True), text)
        for words in (good, good + b"\xff" * (2048 - len(good))):
            path.write_bytes(words)
            self.assertEqual(self.run_flash("--dry-run", "--parameters", path)[0], 0)
        path.write_bytes(b"name: My motor\n")
        code, text = self.run_flash("--dry-run", path)
        self.assertEqual(code, 2, text)
        self.assertIn("is no ELF file", text)

    def test_commands(self):
        code, text = self.run_flash("--dry-run", self.image)
        self.assertEqual(code, 0, text)
        for words in ("interface/stlink.cfg", "target/stm32g4x.cfg", "verify", "reset"):
            self.assertIn(words, text)
        path = self.path / "page.bin"
        path.write_bytes(page((0x210002, 6000000)))
        code, text = self.run_flash("--dry-run", "--gpio", "0,11,25,24", "--parameters", path)
        self.assertEqual(code, 0, text)
        for words in ("linuxgpiod", "swclk 11", "swdio 25", "srst 24", "0x0801F000"):
            self.assertIn(words, text)


if __name__ == "__main__":
    FLASH = sys.argv.pop(1)
    unittest.main()
