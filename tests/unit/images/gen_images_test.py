"""tools/gen_images.py on trees of a few files: what it makes, and that each mistake is named with file and line."""
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tools"))
import gen_images  # noqa: E402
from dictionary.source import SourceError  # noqa: E402

MANIFEST = """\
help: a few
board: bench
program: few
channels: [held]
methods: [first, third]
trace_numbers: 100
in_flash: [slow_path]
budgets:
  flash: 1000
  ram: 200
  stack: 100
  ccm: 10
  interrupt: {mean: 42, worst: 48}
  drive_step: {flux: 27, injection: 31}
"""
LIST = '/* PM_METHOD(name, help) */\nPM_METHOD(first, "one", 0, 0)\nPM_METHOD(second, "two", 0, 0)\n'
OTHER = 'PM_METHOD(third, "three", 0, 0)\n'
NEEDY = 'PM_METHOD(fourth, "four", 0, NEEDS_HELD)\nPM_METHOD(fifth, "five", 0, NEEDS_HELD | NEEDS_NEUTRAL)\n'
CHANNELS = "#define NEEDS_NEUTRAL 0x0004U /* star point */\n#define NEEDS_HELD    0x0200U\n"


class Images(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        self.put("observers/some.def", LIST)
        self.put("firmware/drive/parts/other.def", OTHER)
        self.put("firmware/math/measure.h", CHANNELS)
        self.put("hal/bench/port.h", "")
        self.put("firmware/images/few.yaml", MANIFEST)

    def put(self, path, text):
        (self.root / path).parent.mkdir(parents=True, exist_ok=True)
        (self.root / path).write_text(text)

    def refused(self, old, new):
        self.assertIn(old, MANIFEST)
        self.put("firmware/images/few.yaml", MANIFEST.replace(old, new))
        with self.assertRaises(SourceError) as caught:
            gen_images.files(self.root)
        return str(caught.exception)

    def test_channels_stand_in_the_header(self):
        self.assertIn("#define PM_CHANNELS (NEEDS_HELD)\n", gen_images.files(self.root)["firmware/images/few.h"])
        self.put("firmware/images/few.yaml", MANIFEST.replace("[held]", "[held, neutral]"))
        self.assertIn("#define PM_CHANNELS (NEEDS_HELD | NEEDS_NEUTRAL)\n",
                      gen_images.files(self.root)["firmware/images/few.h"])
        self.put("firmware/images/few.yaml", MANIFEST.replace("[held]", "[]"))
        self.assertIn("#define PM_CHANNELS 0x0000U\n", gen_images.files(self.root)["firmware/images/few.h"])

    def test_all_methods_are_those_with_enough_channels(self):
        self.put("injection/needy.def", NEEDY)
        for channels, absent in (("[]", ["fourth", "fifth"]), ("[held]", ["fifth"]), ("[held, neutral]", [])):
            manifest = MANIFEST.replace("[held]", channels).replace("[first, third]", "all")
            self.put("firmware/images/few.yaml", manifest)
            text = gen_images.files(self.root)["firmware/images/few.h"]
            left_out = [line for line in text.splitlines() if "WITHOUT" in line]
            self.assertEqual(left_out, [f"#define PM_WITHOUT_{name} 1" for name in absent])

    def test_all_methods_but_some(self):
        self.put("firmware/images/few.yaml", MANIFEST.replace("[first, third]", "all\nwithout: [second]"))
        self.assertEqual([line for line in gen_images.files(self.root)["firmware/images/few.h"].splitlines() if "WITHOUT" in line],
                         ["#define PM_WITHOUT_second 1"])
        self.assertIn("unknown method `fifth`", self.refused("[first, third]", "all\nwithout: [fifth]"))
        self.assertIn("`without` is for images with all methods", self.refused("[first, third]", "[first, third]\nwithout: [second]"))

    def test_method_without_its_channel_is_refused(self):
        self.put("injection/needy.def", NEEDY)
        self.assertEqual(self.refused("[first, third]", "[first, fifth]"),
                         "firmware/images/few.yaml:5: method `fifth` needs the channel `neutral`, which `channels` does not name")
        self.assertEqual(self.refused("[held]", "[held, tilt]"),
                         "firmware/images/few.yaml:4: unknown channel `tilt`; known are: held, neutral")
        self.assertEqual(self.refused("[held]", "[held, held]"), "firmware/images/few.yaml:4: channel `held` stands twice")

    def test_header_leaves_out_what_is_not_named(self):
        text = gen_images.files(self.root)["firmware/images/few.h"]
        self.assertIn('#define PM_IMAGE_NAME "few"\n#define PM_IMAGE_TRACE_NUMBERS 100U\n', text)
        self.assertEqual([line for line in text.splitlines() if "WITHOUT" in line], ["#define PM_WITHOUT_second 1"])

    def test_budgets_and_methods_for_cmake(self):
        lines = gen_images.files(self.root)["firmware/images/images.cmake"].splitlines()
        for line in ("set(PM_IMAGES few)", "set(PM_IMAGE_few_PROGRAM few)", "set(PM_IMAGE_few_METHODS first third)",
                     "set(PM_IMAGE_few_IN_FLASH slow_path)", "set(PM_IMAGE_few_FLASH 1000)",
                     "set(PM_IMAGE_few_INTERRUPT_WORST 48)", "set(PM_IMAGE_few_DRIVE_STEP_INJECTION 31)"):
            self.assertIn(line, lines)

    def test_a_new_row_is_known_at_once(self):
        self.put("injection/new.def", 'PM_METHOD(fourth, "four", 0, 0)\n')
        self.assertIn("#define PM_WITHOUT_fourth 1", gen_images.files(self.root)["firmware/images/few.h"])
        self.put("firmware/images/few.yaml", MANIFEST.replace("[first, third]", "all"))
        self.assertNotIn("WITHOUT", gen_images.files(self.root)["firmware/images/few.h"])

    def test_mistakes_are_named_with_file_and_line(self):
        for old, new, place, text in (
                ("[first, third]", "\n  - first\n  - fifth", "few.yaml:7:", "unknown method `fifth`; known are: first"),
                ("[first, third]", "\n  - first\n  - first", "few.yaml:6:", "`first` stands twice"),
                ("in_flash:", "in_ram:", "few.yaml:7:", "unknown key `in_ram`"),
                ("  ccm: 10\n", "", "few.yaml:", "key `ccm` is missing"),
                ("mean: 42", "median: 42", "few.yaml:13:", "unknown key `median`"),
                ("flash: 1000", "flash: much", "few.yaml:9:", "`much` is not an integer"),
                ("flash: 1000", "flash: 0", "few.yaml:", "flash must be above 0"),
                ("trace_numbers: 100", "trace_numbers: 7", "few.yaml:6:", "trace_numbers must be"),
                ("board: bench", "board: bank", "few.yaml:2:", "there is no board hal/bank"),
                ("program: few", "program: a b", "few.yaml:3:", "`a b` is not a name")):
            with self.subTest(new):
                message = self.refused(old, new)
                self.assertIn(place, message)
                self.assertIn(text, message)

    def test_one_name_is_one_method(self):
        self.put("injection/new.def", 'PM_METHOD(second, "again", 0, 0)\n')
        with self.assertRaisesRegex(SourceError, "injection/new.def: method `second` stands in observers/some.def already"):
            gen_images.files(self.root)

    def test_one_program_is_one_image(self):
        self.put("firmware/images/more.yaml", MANIFEST)
        with self.assertRaisesRegex(SourceError, "`few` is the program of another image"):
            gen_images.files(self.root)


if __name__ == "__main__":
    unittest.main()
