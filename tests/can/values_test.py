"""Values, names and files of the host tool: what people write and read against what is on the bus."""
import re
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools" / "pmdrive"))
from pmdrive import dictionary, files, names  # noqa: E402
from pmdrive.errors import ABORTS, NotDone, Refused, UsageError, ValueRefused  # noqa: E402
from pmdrive.entry import NUMBERS  # noqa: E402


class Values(unittest.TestCase):
    def parsed(self, name, text, raw):
        self.assertEqual(names.find(name).parse(text), raw, f"{name} {text}")

    def refused(self, name, text, words):
        entry = names.find(name)
        with self.assertRaises(ValueRefused) as caught:
            entry.check(entry.parse(text))
        self.assertIn(entry.where, str(caught.exception))
        self.assertIn(words, str(caught.exception))

    def test_units_and_prefixes(self):
        for text in ("6.2", "6.2 ohm", "6.2ohm", "6200 mohm", "6.2e3mohm", "0.0062 kohm", "6.2 Ω"):
            self.parsed("R_s", text, 6200000)
        self.parsed("dead_time", "2.5 us", 2500)
        self.parsed("dead_time", "2.5 µs", 2500)
        self.parsed("dead_time", "2500 ns", 2500)
        self.parsed("L_d", "43 mH", 43000000)
        self.parsed("current_bandwidth", "0.5 kHz", 500000)
        self.parsed("target_velocity", "-100 rpm", -10472)
        self.parsed("theta", "90 deg", 2**30)
        self.parsed("quality", "50 %", 500)
        self.parsed("pole_pairs", "3", 3)
        self.parsed("device_type", "0x20192", 0x20192)

    def test_words(self):
        self.parsed("mode", "profile torque", 4)
        self.parsed("mode", "Open-loop current", -1)
        self.parsed("trace.edge", "falling", 1)
        self.refused("mode", "profile", "profile torque")

    def test_decimals_are_exact(self):
        for raw in (1, 3, 999999999, -4466001):
            entry = names.find("L_dqh_rated")
            self.assertEqual(entry.parse(entry.text(raw)), raw)

    def test_refusals(self):
        self.refused("R_s", "6 V", "unit `V` is not understood: its unit is ohm")
        self.refused("R_s", "6 mV", "not understood")
        self.refused("R_s", "much", "is not a number")
        self.refused("R_s", "", "is not a number")
        self.refused("R_s", "1..2", "is not a number")
        self.refused("R_s", "nan", "is not a number")
        self.refused("R_s", "1e-8", "less than its resolution")
        self.refused("R_s", "99 uohm", "below the least, 0.0001 ohm")
        self.refused("R_s", "1000.000001", "above the most, 1000 ohm")
        self.refused("R_s", "1e400", "above the most")
        self.refused("pole_pairs", "3.5", "is not an integer")
        self.refused("pole_pairs", "3 Hz", "it has no unit")

    def test_shares_without_a_percent_sign(self):
        for name, text in (("target_torque", "-50"), ("target_duty", "50"), ("target_duty", "-50")):
            sign = "-" if text[0] == "-" else ""
            self.refused(name, text, f"{sign}50 is {sign}5000 %; did you mean {sign}50%?")
        with self.assertRaises(ValueRefused) as caught:
            names.find("target_duty").check(10100)
        self.assertNotIn("did you mean", str(caught.exception))

    def test_limits_and_presets_survive(self):
        for entry in dictionary.ENTRIES:
            if not entry.number or entry.exp2:
                continue
            for raw in (entry.least, entry.most, entry.preset):
                if raw is not None:
                    self.assertEqual(entry.raw(entry.physical(raw)), raw, entry.name)
                    self.assertEqual(entry.decode(entry.encode(raw)), raw, entry.name)
                    if not entry.values:
                        self.assertEqual(entry.parse(entry.text(raw)), raw, entry.name)

    def test_bytes(self):
        entry = names.find("L_dqh_rated")
        self.assertEqual(entry.encode(-2), b"\xfe\xff\xff\xff")
        self.assertEqual(names.find("mode").decode(b"\xff"), -1)
        self.assertEqual(names.find("device_name").decode(b"pmdrive\0"), "pmdrive")
        with self.assertRaisesRegex(NotDone, "2 bytes came, 4 were expected"):
            entry.decode(b"\0\0")
        for kind, (_, _, least, most) in NUMBERS.items():
            entry = next(e for e in dictionary.ENTRIES if e.type == kind)
            for raw in (least - 1, most + 1):
                with self.assertRaises(ValueRefused):
                    entry.encode(raw)


class Names(unittest.TestCase):
    def test_found(self):
        entry = names.find("R_s")
        for text in ("2100:02", "2100:2", "0x2100:0x02", "2100h:02h", "r_s"):
            self.assertIs(names.find(text), entry)
        self.assertEqual(names.find("1000").name, "device_type")

    def test_not_found(self):
        with self.assertRaisesRegex(UsageError, "did you mean v_injection"):
            names.find("v_injecton")
        with self.assertRaisesRegex(UsageError, "2100h:FE is not in the dictionary"):
            names.find("2100:FE")

    def test_select(self):
        parameters = (ROOT / "firmware/params/parameters.def").read_text().count("\nPM_PARAM(")
        self.assertEqual(len(names.select([])), parameters)
        self.assertEqual({e.record for e in names.select(["machine", "R_s"])}, {"machine"})

    def test_identity_on_the_bus_is_not_among_the_stored(self):
        self.assertNotIn("can_node_id", [e.name for e in names.stored()])
        self.assertEqual({e.record for e in names.stored("machine")}, {"machine", "third", "windings"})


class Files(unittest.TestCase):
    def test_there_and_back(self):
        for group in ("machine", "application", "communication"):
            values = {entry: entry.preset for entry in names.stored(group)}
            self.assertEqual(files.parse(files.render(values, group), "x"), values)

    def test_as_a_machine_file_has_it(self):
        values = files.parse("drive:\n  R_s: 6.0      # measured\n\n  # L\n  L_d: 43.0e-3  # D: #1\n", "x")
        self.assertEqual({e.name: raw for e, raw in values.items()}, {"R_s": 6000000, "L_d": 43000000})

    def test_of_a_machine_file_the_section_drive(self):
        text = ("---\nname: My motor  # of a friend\nelectrical: {R_s_ohm: 5.9}\nwinding: {connection: star}\n\nrated:\n  i_rated_A: 4\n"
                "drive:    # told\n  R_s: 6.0\n\n# L\n  L_d: 43.0e-3\nsensor:\n  bits: 12\nwinding:\n  emf:\n  - {order: 3}\n- x\n")
        notes = []
        values = files.parse(text, "motor.yaml", notes.append)
        self.assertEqual({e.name: raw for e, raw in values.items()}, {"R_s": 6000000, "L_d": 43000000})
        self.assertIn("motor.yaml is a machine file: `drive:` alone is read", notes[0])
        files.parse("R_s: 6\n", "a.yaml", notes.append)
        self.assertEqual(len(notes), 1)
        for path in sorted((ROOT / "sim_plant/machines").glob("*.yaml")):
            section = path.read_text(encoding="utf-8").split("\ndrive:")[1]
            known = dict(re.findall(r"^  (\w+): *(\S+)", section, re.M))
            found = {e.name: float(e.physical(raw)) for e, raw in files.read(path).items()}
            self.assertEqual(found.keys(), known.keys(), path.name)
            for name, value in found.items():
                self.assertAlmostEqual(value, float(known[name]), delta=0.01 * abs(value), msg=f"{path.name} {name}")

    def test_mistakes_in_a_machine_file(self):
        self.refused("name: M\ndrive:\n  R_z: 3\n", "a.yaml:3: no object is called `R_z`")
        self.refused("name: M\nelectrical: {R_s_ohm: 5.9}\n", "a.yaml: a machine file without a section `drive:`\n  `pmsim tune`")
        self.refused("name: M\ndrive: {R_s: 3}\n", "a.yaml:2: drive: its values stand below it")
        self.refused("R_s: 3\ndrive:\n  L_d: 3e-3\n", "a.yaml:1: R_s stands outside `drive:`")
        self.refused("drive:\n  L_d: 3e-3\nR_s: 3\n", "a.yaml:3: R_s stands outside `drive:`")

    def refused(self, text, words):
        with self.assertRaises(UsageError) as caught:
            files.parse(text, "a.yaml")
        self.assertIn(words, str(caught.exception))

    def test_refusals(self):
        self.refused("R_s: 6\nL_d 3\n", "a.yaml:2: not a line")
        self.refused("R_s: 6\n\nR_z: 3\n", "a.yaml:3: no object is called `R_z`")
        self.refused("R_s: 6\nR_s: 7\n", "a.yaml:2: R_s stands here and in line 1")
        self.refused("R_s: 6 kg\n", "a.yaml:1: R_s (2100h:02): unit `kg`")
        self.refused("R_s: 1e9\n", "a.yaml:1: R_s (2100h:02): 1000000000 ohm is above the most")
        self.refused("statusword: 1\n", "cannot be set")
        self.refused("trace_data: 1\n", "cannot be set")

    def test_missing_file(self):
        with self.assertRaisesRegex(UsageError, "^/nowhere/x.yaml: No such file or directory$"):
            files.read("/nowhere/x.yaml")

    def test_from_another_editor(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "a.yaml"
            path.write_bytes(b"\xef\xbb\xbfR_s: 6 ohm\r\n")
            self.assertEqual(files.read(path), {names.find("R_s"): 6000000})
            for text in ("", "# R_s: 6 ohm\n", "drive:\n"):
                path.write_text(text, encoding="utf-8")
                with self.assertRaisesRegex(UsageError, "there is no value in it"):
                    files.read(path)


class Words(unittest.TestCase):
    def test_abort_codes_say_what_to_do(self):
        for code, (meaning, do) in ABORTS.items():
            self.assertTrue(meaning and do, hex(code))
        text = str(Refused("R_s (2100h:02)", 0x08000022))
        self.assertIn("R_s (2100h:02)", text)
        self.assertIn("0800 0022h", text)
        self.assertIn("pmdrive stop", text)
        self.assertIn("does not know", str(Refused("x", 0x12345678)))


if __name__ == "__main__":
    unittest.main()
