"""The host tool against the node of an image without some methods: their parameters are not there, and it says so.

usage: image_test.py LIBRARY [unittest's words]     the shared library of firmware/can, made for firmware/images/small.h
"""
import re
import sys
import unittest
from pathlib import Path

import tool_test
from pmdrive import dictionary, names
from pmdrive.errors import NotInImage
from tool_test import Bench

ROOT = Path(__file__).resolve().parents[2]

WITHOUT_MEMBER, WITHOUT_OBJECT = "mismatch_frequency", "ekf_speed_noise"
NO_OBJECT, NO_SUB = 0x06020000, 0x06090011


def absent():
    """Parameters of methods that the image is all without, by its header and the conditions of the drive's parameters."""
    without = set(re.findall(r"PM_WITHOUT_(\w+) 1", (ROOT / "firmware/images/small.h").read_text(encoding="utf-8")))
    found, lacking = set(), False
    for line in (ROOT / "firmware/params/parameters.def").read_text(encoding="utf-8").splitlines():
        if line.startswith("#if PM_HAS"):
            lacking = without.issuperset(re.findall(r"PM_HAS\((\w+)\)", line))
        elif line.startswith(("#else", "#endif")):
            lacking = False
        elif lacking and line.startswith("PM_PARAM("):
            found.add(line[len("PM_PARAM("):].partition(",")[0])
    return found


class Image(Bench):
    def test_a_parameter_of_an_absent_method_is_refused_by_name(self):
        with self.connect() as drive:
            for name, code in ((WITHOUT_MEMBER, NO_SUB), (WITHOUT_OBJECT, NO_OBJECT)):
                for access in (lambda: drive.read(name), lambda: drive.write(name, names.find(name).preset)):
                    with self.assertRaises(NotInImage) as caught:
                        access()
                    self.assertEqual(caught.exception.code, code)
                    self.assertIn("not in this image", str(caught.exception))

    def test_the_command_says_so(self):
        _, err = self.command("get", WITHOUT_OBJECT, code=1)
        self.assertIn("not in this image", err)

    def test_places_of_the_others_are_unchanged(self):
        missing = set()
        with self.connect() as drive:
            for entry in names.select([]):
                try:
                    self.assertEqual(drive.read(entry), self.node.values[(entry.index, entry.sub)], entry.name)
                except NotInImage:
                    missing.add(entry.name)
        self.assertEqual(missing, absent())
        self.assertGreater(len(missing), 10)

    def test_a_dump_leaves_it_out_and_loads_again(self):
        out, _ = self.command("dump", "--out", self.path("all.yaml"))
        text = Path(self.path("all.yaml")).read_text(encoding="utf-8")
        self.assertIn("open_loop_damping", text)
        self.assertNotIn(WITHOUT_OBJECT, text)
        self.assertIn("nothing to change", self.command("load", self.path("all.yaml"))[0])

    def test_a_value_that_cannot_be_set_is_named(self):
        values = {names.find(WITHOUT_MEMBER): names.find(WITHOUT_MEMBER).preset}
        with self.connect() as drive:
            self.assertEqual(drive.diff(values), [])
            with self.assertRaises(NotInImage):
                drive.diff({entry: raw + 1 for entry, raw in values.items()})

    def test_the_tool_knows_more_than_the_image(self):
        self.assertIn(WITHOUT_OBJECT, {entry.name for entry in dictionary.ENTRIES})


if __name__ == "__main__":
    tool_test.LIBRARY = sys.argv.pop(1)
    unittest.main()
