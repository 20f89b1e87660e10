"""The analysis of an image must see what it is for: small programs whose calls and frames are known."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[2] / "tools")]
import limits  # noqa: E402
from image_graph import Image  # noqa: E402

FLAGS = ["-mcpu=cortex-m4", "-mthumb", "-O1", "-fno-inline", "-fno-optimize-sibling-calls", "-ffunction-sections",
         "-fdata-sections", "-nostdlib", "-Wl,--emit-relocs", "-Wl,-e,top"]
CALLS = """
const int table[4] = {1, 2, 3, 4};
static volatile int sink;
void leaf(int n) { sink = table[n & 3]; }
void middle(int n) { volatile char room[100]; room[n] = 1; leaf(n + room[n]); }
void other(void) { sink = 2; }
void top(void) { middle(1); other(); }
void apart(void) { sink = 3; }
"""
RECURSION = "void top(int n) { if (n) { top(n - 1); *(volatile int *)0 = n; } }"
POINTER = "extern void (*volatile f)(void); void (*volatile f)(void); void top(void) { f(); *(volatile int *)0 = 1; }"


class Analysis(unittest.TestCase):
    def image(self, source):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        c, elf = Path(self.folder.name) / "x.c", Path(self.folder.name) / "x.elf"
        c.write_text(source)
        script = Path(self.folder.name) / "x.ld"
        script.write_text("SECTIONS { .text 0x8000000 : { *(.text*) } .rodata : { *(.rodata*) } "
                          ".vectors : {} .ccm : {} .data : { *(.data*) } .bss : { *(.bss*) } }\n")
        subprocess.run(["arm-none-eabi-gcc", *FLAGS, "-T", script, c, "-o", elf], check=True)
        return Image(elf)

    def test_reached(self):
        names = {item.name for item in self.image(CALLS).reachable(["top"])}
        self.assertEqual(names & {"top", "middle", "leaf", "other", "apart", "table"},
                         {"top", "middle", "leaf", "other", "table"})

    def test_reached_without(self):
        names = {item.name for item in self.image(CALLS).reachable(["top"], ["middle"])}
        self.assertEqual(names & {"top", "middle", "leaf", "other", "table"}, {"top", "other"})

    def test_deepest(self):
        image = self.image(CALLS)
        size, chain = limits.deepest(image, image.function("top"), {}, False)
        self.assertEqual(chain, ("top", "middle", "leaf"))
        self.assertGreaterEqual(size, 100 + 4)
        self.assertLess(size, 100 + 40)
        self.assertEqual(limits.deepest(image, image.function("leaf"), {"leaf": 50}, False)[0], 50)

    def test_no_bound(self):
        for source in (RECURSION, POINTER):
            with self.subTest(source):
                image = self.image(source)
                top = image.function("top")
                if source is RECURSION:
                    self.assertIn("top", [image.items[a].name for a in top.calls])
                with self.assertRaises(SystemExit):
                    limits.deepest(image, top, {}, False)

    def test_unknown_function(self):
        with self.assertRaises(SystemExit):
            self.image(CALLS).reachable(["nowhere"])


if __name__ == "__main__":
    unittest.main()
