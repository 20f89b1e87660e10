"""The generated data sheet and DBC as others read them: canopen, eds-utils and cantools."""
import io
import logging
import re
import sys
import tempfile
import unittest
from pathlib import Path

import can
import canopen
import cantools
from eds_utils.core.file_io.read_eds import read_eds

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "tools" / "pmdrive" / "pmdrive"
sys.path.insert(0, str(PACKAGE.parent))
from pmdrive import dictionary  # noqa: E402

NODE = 5
TYPES = {"i8": 2, "i16": 3, "i32": 4, "u8": 5, "u16": 6, "u32": 7, "string": 9, "domain": 15}


class DataSheet(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        log = io.StringIO()
        handler = logging.StreamHandler(log)
        logging.getLogger("canopen").addHandler(handler)
        cls.od = canopen.import_od(str(PACKAGE / "pmdrive.eds"), node_id=NODE)
        logging.getLogger("canopen").removeHandler(handler)
        cls.log = log.getvalue()

    def test_loads_without_a_word(self):
        self.assertEqual(self.log, "")

    def variable(self, entry):
        obj = self.od[entry.index]
        return obj if isinstance(obj, canopen.objectdictionary.ODVariable) else obj[entry.sub]

    def test_every_entry_is_the_same(self):
        for entry in dictionary.ENTRIES:
            with self.subTest(entry.name):
                variable = self.variable(entry)
                self.assertEqual(variable.data_type, TYPES[entry.type])
                self.assertEqual(variable.pdo_mappable, entry.map != "none")
                self.assertEqual(variable.writable, entry.writable)
                if entry.type not in ("string", "domain"):
                    wanted = entry.preset + (NODE if entry.node_id else 0) if entry.preset is not None else None
                    self.assertEqual(variable.default, wanted)
                    self.assertEqual((variable.min, variable.max), (entry.least, entry.most))
                if entry.unit:
                    self.assertEqual(variable.unit, entry.unit)
                    self.assertAlmostEqual(variable.factor / float(entry.scale), 1.0, places=12)
                if entry.sub or entry.record == entry.name:
                    self.assertEqual(variable.description, entry.help)

    def test_nothing_else_is_in_it(self):
        count = sum(1 if isinstance(obj, canopen.objectdictionary.ODVariable) else len(obj)
                    for obj in self.od.values())
        self.assertEqual(count, len(dictionary.ENTRIES))

    def test_names_lead_to_the_parameters(self):
        self.assertEqual(self.od["machine"]["R_s"].index, 0x2100)

    def test_has_no_error(self):
        """By eds-utils, which knows neither DOMAIN as an object type nor the three keys that canopen reads beyond
        CiA 306: Factor, Unit and Description."""
        text = (PACKAGE / "pmdrive.eds").read_text(encoding="ascii")
        head, body = text.split("[1000]", 1)
        body = re.sub(r"^(Factor|Unit|Description)=.*\n", "", body, flags=re.M).replace("Type=0x2\n", "Type=0x7\n")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "pmdrive.eds"
            path.write_text(head + "[1000]" + body, encoding="ascii")
            _, errors = read_eds(str(path))
            self.assertEqual(errors, [])
            path.write_text(head + "[1000]" + body.replace("DataType=0x0007", "DataType=0x0107", 1), encoding="ascii")
            self.assertNotEqual(read_eds(str(path))[1], [], "the check finds nothing at all")


class Dbc(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.db = cantools.database.load_file(PACKAGE / "pmdrive.dbc", strict=True)

    def test_messages(self):
        wanted = {"EMCY": 0x81, "TPDO1": 0x181, "RPDO1": 0x201, "HEARTBEAT": 0x701}
        for name, frame_id in wanted.items():
            self.assertEqual(self.db.get_message_by_name(name).frame_id, frame_id)

    def test_process_data_is_packed_as_canopen_packs_it(self):
        od = canopen.import_od(str(PACKAGE / "pmdrive.eds"), node_id=1)
        node = canopen.LocalNode(1, od)
        for name, maps in (("TPDO", node.tpdo), ("RPDO", node.rpdo)):
            for number in range(1, 5):
                names = {m.name for m in self.db.messages}
                words = [od[0x1A00 - 0x400 * (name == "RPDO") + number - 1][n].default for n in range(1, 9)]
                self.assertEqual(f"{name}{number}" in names, any(words))
                if not any(words):
                    continue
                message = self.db.get_message_by_name(f"{name}{number}")
                self.assertEqual(message.length * 8, sum(word & 0xFF for word in words))
                self.check(maps[number], words, message)

    def check(self, pdo, words, message):
        pdo.clear()
        values = {}
        variables = [pdo.add_variable(word >> 16, word >> 8 & 0xFF) for word in words if word]
        for n, variable in enumerate(variables):
            variable.raw = (-1) ** n * (n + 1) if variable.od.data_type in (2, 3, 4) else 200 - n
            values[message.signals[n].name] = variable.phys
        got = message.decode(bytes(pdo.data), decode_choices=False)
        self.assertEqual(set(got), set(values))
        for key, value in values.items():
            self.assertAlmostEqual(got[key], value, places=9)

    def test_emergency(self):
        got = self.db.decode_message(0x81, bytes([0x10, 0x23, 0x03, 1, 0, 0, 0, 0]))
        self.assertEqual(str(got["emcy_error_code"]), "over-current")
        self.assertEqual(got["emcy_error_register"], 3)

    def test_heartbeat(self):
        message = can.Message(arbitration_id=0x701, data=[5], is_extended_id=False)
        self.assertEqual(str(self.db.decode_message(message.arbitration_id, message.data)["nmt_state"]), "operational")


if __name__ == "__main__":
    unittest.main()
