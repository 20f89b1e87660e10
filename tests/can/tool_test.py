"""The host tool against the firmware's node (simulated.py): commands and the Python interface.

usage: tool_test.py LIBRARY [unittest's words]     the shared library of firmware/can
"""
import contextlib
import csv
import io
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path
from unittest import mock

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools" / "pmdrive"))
import can  # noqa: E402
import canopen  # noqa: E402
import pmdrive  # noqa: E402
from pmdrive import bus, cli, dictionary, files, identify, motion, names  # noqa: E402
from simulated import SimulatedNode  # noqa: E402

LIBRARY = None
NODE = 5
SILENT = 127  # nobody has this id
TOO_HIGH, TOO_LOW, NOT_NOW, READ_ONLY, NO_SUCH = 0x06090031, 0x06090032, 0x08000022, 0x06010002, 0x06020000
LOCKED = 0x08000021


class Bench(unittest.TestCase):
    def setUp(self):
        self.channel = f"{type(self).__name__}.{self._testMethodName}"
        self.node = SimulatedNode(LIBRARY, self.channel, NODE)
        self.folder = tempfile.TemporaryDirectory()

    def tearDown(self):
        self.node.stop()
        self.folder.cleanup()

    def path(self, name):
        return str(Path(self.folder.name) / name)

    def connect(self, node=NODE):
        return pmdrive.connect(f"virtual:{self.channel}", node)

    def command(self, *words, code=0, node=NODE):
        """Output and error text of a command, whose exit code must be that."""
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            got = cli.main(["--can", f"virtual:{self.channel}", "--node", str(node), *words])
        self.assertEqual(got, code, out.getvalue() + err.getvalue())
        return out.getvalue(), err.getvalue()

    def json(self, *words, code=0):
        out, _ = self.command("--json", *words, code=code)
        return [json.loads(line) for line in out.splitlines()]

    def refused(self, code, function, *arguments):
        with self.assertRaises(pmdrive.Refused) as caught:
            function(*arguments)
        self.assertEqual(caught.exception.code, code, str(caught.exception))


class WholeDictionary(Bench):
    """Every object, past the tool's own checks."""

    def test_read(self):
        with self.connect() as drive:
            for entry in dictionary.ENTRIES:
                with self.subTest(entry.name):
                    if entry.name == "trace_data":
                        self.refused(0x08000024, drive.read, entry)  # nothing has been recorded
                    else:
                        drive.read(entry)

    def stuck(self, entry):
        """Not for values: their writing does something else than keep a number."""
        return entry.record in ("store", "restore", "trace", "rpdo1", "rpdo1_mapping") or entry.name in (
            "controlword", "parameter_batch", "identification.command") or entry.record.startswith(("tpdo", "rpdo"))

    def test_limits(self):
        tried = 0
        with self.connect() as drive:
            for entry in dictionary.ENTRIES:
                if entry.least is None or not entry.writable or self.stuck(entry):
                    continue
                with self.subTest(entry.name):
                    tried += 1
                    self.check_limits(drive, entry)
        self.assertGreater(tried, len(names.select([])))

    def check_limits(self, drive, entry):
        before = drive.read(entry)
        # the toy's cross check; two consumers of one node
        together = entry.name in ("i_max", "i_trip", "heartbeat_consumer.consumer_2")
        for raw in (entry.least, entry.most):
            if not together:
                drive.write(entry, raw)
                self.assertEqual(drive.read(entry), raw)
        _, _, lowest, highest = pmdrive.entry.NUMBERS[entry.type]
        if entry.most < highest:
            self.refused(TOO_HIGH, drive.write, entry, entry.most + 1)
            self.refused(TOO_HIGH, drive.write, entry, highest)
        if entry.least > lowest:
            self.refused(TOO_LOW, drive.write, entry, entry.least - 1)
            self.refused(TOO_LOW, drive.write, entry, lowest)
        drive.write(entry, before)

    def test_read_only(self):
        with self.connect() as drive:
            for entry in dictionary.ENTRIES:
                if not entry.writable and entry.number:
                    with self.subTest(entry.name):
                        self.refused(READ_ONLY, drive.download, entry.index, entry.sub, entry.encode(0))

    def test_while_running(self):
        with self.connect() as drive, motion.Motion(drive, "speed", speed=1000):
            for entry in dictionary.ENTRIES:
                if entry.writable and entry.access in ("off", "locked"):
                    with self.subTest(entry.name):
                        self.refused(NOT_NOW, drive.write, entry, entry.preset)
            drive.set("speed_bandwidth", "6")
            self.assertEqual(drive.state(), "operation enabled")

    def test_what_is_locked_is_opened_and_closed_again(self):
        with self.connect() as drive:
            self.refused(LOCKED, drive.download, 0x2100, 2, (6_100_000).to_bytes(4, "little"))
            drive.set("R_s", "6.1")
            drive.load({names.find("R_s"): 6_200_000, names.find("L_d"): 42_000_000})
            drive.save()
            self.assertEqual(drive.read("R_s"), 6_200_000)
            self.assertEqual(drive.read("parameters_open"), 0)
            with drive.open():
                self.refused(TOO_HIGH, drive.write, "R_s", 2**31 - 1)
                self.assertEqual(drive.read("parameters_open"), 1)
            self.assertEqual(drive.read("parameters_open"), 0)
            self.refused(LOCKED, drive.download, 0x1011, 1, b"load")

    def test_no_such_object(self):
        with self.connect() as drive:
            self.refused(NO_SUCH, drive.upload, 0x5FFF, 0)
            self.refused(0x06090011, drive.upload, 0x2100, 99)


class Values(Bench):
    def test_scan(self):
        self.assertEqual(self.json("scan"), [{"nodes": [NODE]}])

    def test_get_and_set(self):
        out, _ = self.command("set", "R_s=6200mohm", "mode=profile torque")
        self.assertIn("6.2 ohm", out)
        self.assertIn("4 (profile torque)", out)
        self.assertEqual(self.json("get", "R_s"), [{"R_s": {"value": 6.2, "unit": "ohm", "raw": 6200000}}])
        out, _ = self.command("get", "machine", "6060")
        members = [e for e in names.RECORDS["machine"] if not e.name.endswith(".count")]
        self.assertEqual(len(out.splitlines()), len(members) + 1)

    def test_nothing_is_sent_when_one_is_wrong(self):
        _, err = self.command("set", "R_s=6.2", "L_d=1kH", code=2)
        self.assertIn("L_d (2100h:03): 1000 H is above the most, 1 H", err)
        self.assertEqual(self.node["R_s"], 6000000)
        self.assertIn("NAME=VALUE", self.command("set", "R_s", code=2)[1])
        self.assertIn("is not a number", self.command("set", "R_s=abc", code=2)[1])
        self.assertIn("R_s is set twice", self.command("set", "R_s=5", "2100:02=6", code=2)[1])
        self.assertEqual(self.node["R_s"], 6000000)

    def test_the_parameter_in_the_way_is_named(self):
        _, err = self.command("set", "i_max=9.5", code=1)
        self.assertIn("i_max (2200h:01), by i_trip (2600h:01): does not go", err)
        self.assertIn("0604 0043h", err)
        self.assertIn("change i_trip in the same `pmdrive set`; the bus does not carry the reason: `pmsim run", err)

    def test_a_parameter_is_not_in_its_own_way(self):
        _, err = self.command("set", "i_trip=4", code=1)
        self.assertIn("i_trip (2600h:01): does not go with other values", err)
        self.assertIn("change what it has to fit in the same `pmdrive set`; the bus does not carry the reason: `pmsim run", err)

    def test_what_is_still_to_be_done(self):
        self.node["parameters_ready"] = 3
        out, _ = self.command("set", "R_s=6.2")
        self.assertIn("`pmdrive save`, then `pmdrive reset`", out)

    def test_a_record_by_its_index(self):
        self.assertEqual(self.command("get", "2100"), self.command("get", "machine"))

    def test_list(self):
        out, _ = self.command("list", "machine")
        self.assertIn("0.0001 ohm to 1000 ohm", out)
        self.assertNotIn("store.machine", out)
        self.assertIn("v_injection", self.command("list", "inject")[0])
        self.assertEqual(len(self.json("list")), len(dictionary.ENTRIES))
        self.assertIn("no name has `nix` in it", self.command("list", "nix", code=2)[1])

    def test_codes_have_words(self):
        with self.node.gate:
            self.node.trip(1)
        out, _ = self.command("get", "drive_fault", "error_code")
        self.assertIn("1 (over-current)", out)
        self.assertIn("2310h (over-current)", out)

    def test_help(self):
        self.assertIn("NAME=VALUE", self.command("help", "set")[0])
        self.assertIn("examples:", self.command("help")[0])

    def test_nobody_there(self):
        _, err = self.command("get", "R_s", code=1, node=SILENT)
        self.assertIn(f"node {SILENT} does not answer to identity.product_code (1018h:02)", err)
        self.assertIn("pmdrive scan", err)

    def test_errors_as_json(self):
        found = self.json("get", "R_z", code=2)[0]
        self.assertEqual(found, {"error": "no object is called `R_z`", "do": "did you mean R_s?"})
        found = self.json("set", "i_max=9.5", code=1)[0]
        self.assertEqual((found["abort"], found["index"], found["sub"]), (0x06040043, 0x2200, 1))

    def test_version(self):
        out = io.StringIO()
        with contextlib.redirect_stdout(out), self.assertRaises(SystemExit):
            cli.main(["--version"])
        self.assertRegex(out.getvalue(), r"pmdrive [\d.]+, object dictionary revision [\d.]+")

    def test_a_node_with_another_dictionary_is_named(self):
        self.assertEqual(self.command("get", "i_q")[1], "")
        with mock.patch.object(dictionary, "REVISION", 0x00020003):
            _, err = self.command("get", "i_q")
            self.assertIn("revision 1.0 of the object dictionary, this tool 2.3", err)
            self.assertEqual(self.command("stop")[1], "")  # which loses no time
        with mock.patch.object(dictionary, "PRODUCT_CODE", 0x1234):
            self.assertIn("no pmdrive", self.command("get", "i_q")[1])

    def test_another_node_id(self):
        out, _ = self.command("bus", "--node-id", "9")
        self.assertIn("node 9 answers", out)
        self.assertEqual(self.json("scan")[0]["nodes"], [9])
        self.command("bus", "--bit-rate", "250kbit/s", node=9)
        self.assertEqual(self.node.kept[(0x2080, 2)], 250)
        self.assertIn("neither", self.command("bus", code=2)[1])
        self.assertIn("above the most", self.command("bus", "--node-id", "128", code=2)[1])

    def test_a_node_that_nobody_knows(self):
        """By LSS, alone on the bus."""
        out, _ = self.command("bus", "--lss", "--node-id", "12", node=77)
        self.assertIn("node 12 answers", out)
        self.assertEqual(self.json("scan")[0]["nodes"], [12])

    def test_info(self):
        self.assertEqual(self.json("info")[0]["identity.product_code"]["value"], dictionary.PRODUCT_CODE)
        self.assertIn("0.0001 ohm to 1000 ohm", self.command("info", "R_s")[0])

    def test_monitor(self):
        self.assertEqual(len(self.json("monitor", "velocity_actual", "--count", "3", "--interval", "0")), 3)

        for words in (["monitor", "--interval", "-1"], ["watch", "--for", "nan"], ["watch", "--interval", "1e9"],
                      ["trace", "i_d", "--wait", "-1"]):
            with contextlib.redirect_stderr(io.StringIO()) as err, self.assertRaises(SystemExit):
                cli.main(words)
            self.assertIn(" s is not 0 to 1e+06 s", err.getvalue())
        out, _ = self.command("monitor", "velocity_actual", "i_q", "--count", "1")
        self.assertEqual(out.splitlines()[-1].split(), ["-", "0", "A"])  # the bridge is off: nothing is known of the speed

    def test_bits_and_shaft_speeds_in_words(self):
        self.node["drive_limits"] = 0x11
        self.command("set", "target_velocity=300rpm")
        out, _ = self.command("get", "drive_limits", "error_register", "target_velocity")
        self.assertIn("0x11 (current, speed)", out)
        self.assertIn("0x0 (none)", out)
        self.assertIn("31.416 rad/s (300.0 rpm)", out)

    def test_two_programs_at_one_node(self):
        """Each hears what the other has asked for."""
        ended = threading.Event()

        def other():
            with self.connect() as drive:
                while not ended.is_set():
                    drive.read("psi_m")
                    time.sleep(0.002)

        thread = threading.Thread(target=other)
        thread.start()
        try:
            with self.connect() as drive:
                for _ in range(200):
                    self.assertEqual(drive.read("R_s"), 6000000)
        finally:
            ended.set()
            thread.join()

    def test_data_sheet_in_the_device(self):
        path = self.path("device.eds")
        self.command("eds", "--out", path)
        od = canopen.import_od(path, node_id=NODE)
        self.assertEqual(od["machine"]["R_s"].unit, "ohm")
        self.assertEqual(sum(len(o) if hasattr(o, "subindices") else 1 for o in od.values()), len(dictionary.ENTRIES))


class Sets(Bench):
    def write(self, text):
        path = self.path("a.yaml")
        Path(path).write_text(text, encoding="utf-8")
        return path

    def test_dump_and_load(self):
        path = self.path("dump.yaml")
        self.command("set", "R_s=6.5", "psi_m=0.2")
        self.command("dump", "--out", path)
        self.assertEqual(len(files.read(path)), len(names.stored()))
        self.command("set", "R_s=6", "psi_m=0.236")
        self.assertEqual({x["name"] for x in self.json("diff", path)[0]}, {"R_s", "psi_m"})
        self.assertEqual(self.json("dump", "R_s", "--out", self.path("one.yaml"))[0]["R_s"]["raw"], 6000000)
        self.assertEqual(files.read(self.path("one.yaml")), {names.find("R_s"): 6000000})
        self.json("load", path, "--yes")
        self.assertEqual(self.json("diff", path), [[]])
        self.assertEqual((self.node["R_s"], self.node["psi_m"]), (6500000, 200000000))

    def test_dry_run_writes_nothing(self):
        out, _ = self.command("load", self.write("R_s: 7 ohm\n"), "--dry-run")
        self.assertIn("6 ohm -> 7 ohm", out)
        self.assertEqual(self.node["R_s"], 6000000)

    def test_no_terminal_to_ask_at(self):
        with mock.patch.object(sys, "stdin", io.StringIO()):
            _, err = self.command("load", self.write("R_s: 7 ohm\n"), code=2)
        self.assertIn("--yes", err)
        self.assertEqual(self.node["R_s"], 6000000)

    def test_those_that_belong_together(self):
        """In the order of the file, i_max alone would be refused."""
        self.command("load", self.write("i_max: 20 A\ni_trip: 30 A\n"), "--yes")
        self.assertEqual((self.node["i_max"], self.node["i_trip"]), (20000, 30000))

        self.command("set", "i_max=21 A", "i_trip=31 A")
        self.assertEqual((self.node["i_max"], self.node["i_trip"]), (21000, 31000))

    def test_a_whole_machine_file(self):
        path = self.write("name: My motor\nelectrical: {R_s_ohm: 5.9}\ndrive:\n  R_s: 7.0\ninverter:\n  f_pwm_Hz: 20000\n")
        out, _ = self.command("load", path, "--yes")
        self.assertIn("a.yaml is a machine file: `drive:` alone is read", out)
        self.assertEqual(self.node["R_s"], 7000000)
        self.assertIn("is a machine file", self.command("diff", path)[0])
        self.assertEqual(self.json("diff", path), [[]])

    def test_refused_together_is_undone(self):
        _, err = self.command("load", self.write("R_s: 7 ohm\ni_max: 40 A\ni_trip: 30 A\n"), "--yes", code=1)
        self.assertIn("i_trip (2600h:01), of all together", err)
        self.assertIn("nothing was changed: mend i_trip, or what it has to fit among R_s, i_max", err)
        self.assertEqual((self.node["R_s"], self.node["i_max"], self.node["i_trip"]), (6000000, 5000, 9000))
        self.assertEqual(self.node["parameter_batch"], 0)
        _, err = self.command("load", self.write("i_max: 40 A\n"), "--yes", code=1)
        self.assertIn("nothing was changed: i_trip was not among the changes; it does not go with i_max; the bus does not carry the reason: `pmsim run", err)
        many = "".join(f"{name}: {value}\n" for name, value in (
            ("R_s", 7), ("L_d", 0.04), ("L_q", 0.07), ("psi_m", 0.1), ("J", 1e-3), ("pole_pairs", 2), ("i_max", 40)))
        _, err = self.command("load", self.write(many), "--yes", code=1)
        self.assertIn("it does not go with one of the 7 changes;", err)
        _, err = self.command("load", self.write(many + "i_trip: 30 A\n"), "--yes", code=1)
        self.assertIn("mend i_trip, or what it has to fit among the other 7 changes;", err)

    def test_read_back(self):
        """A drive that takes a value without keeping it does not go unnoticed."""
        path = self.write("R_s: 7 ohm\n")
        with self.connect() as drive, mock.patch.object(type(drive), "write"):
            with self.assertRaisesRegex(pmdrive.NotDone, "R_s is 6 ohm"):
                drive.load(files.read(path))

    def test_file_and_line(self):
        self.assertIn("a.yaml:2: no object is called", self.command("diff", self.write("R_s: 6\nR_x: 3\n"), code=2)[1])

    def test_defaults(self):
        self.assertEqual(self.json("diff"), [[]])
        self.command("set", "R_s=7")
        self.assertEqual([x["name"] for x in self.json("diff")[0]], ["R_s"])

    def test_save_restore_reset(self):
        self.command("set", "R_s=7", "i_max=6", "heartbeat_time=0.2")
        self.command("save")
        self.command("reset")
        self.assertEqual([self.node[x] for x in ("R_s", "i_max")], [7000000, 6000])
        self.assertEqual(self.json("get", "heartbeat_time")[0]["heartbeat_time"]["raw"], 200)
        with mock.patch.object(sys, "stdin", io.StringIO()):
            self.assertIn("restore the defaults of `machine`?", self.command("restore", "machine", code=2)[1])
        with mock.patch("pmdrive.attend.confirm", return_value=False):
            self.command("restore", "machine", code=1)
        self.command("reset")
        self.assertEqual(self.node["R_s"], 7000000)
        self.command("restore", "machine", "--yes")
        self.assertEqual(self.node["R_s"], 7000000)
        self.command("reset")
        self.assertEqual([self.node[x] for x in ("R_s", "i_max")], [6000000, 6000])
        self.command("restore", "--yes")
        self.command("reset")
        self.assertEqual(self.node["i_max"], 5000)

    def test_not_saved_is_lost(self):
        self.command("set", "R_s=7")
        self.command("reset")
        self.assertEqual(self.node["R_s"], 6000000)


class Motion(Bench):
    def wait(self, condition, seconds=3.0):
        end = time.monotonic() + seconds
        while not condition() and time.monotonic() < end:
            time.sleep(0.01)
        self.assertTrue(condition())

    def test_speed(self):
        with self.connect() as drive:
            with motion.Motion(drive, "speed", speed=20000) as running:
                self.wait(lambda: drive.read("velocity_actual") == 20000)
                running.set_speed(-10000)
                self.wait(lambda: drive.read("velocity_actual") == -10000)
            self.assertNotIn(drive.state(), ("operation enabled", "switched on"))
            self.wait(lambda: drive.read("velocity_actual") == 0)

    def test_run_for_a_time(self):
        seen = [x["velocity_actual"]["value"] for x in self.json("run", "speed", "200rpm", "--for", "1")]
        self.assertAlmostEqual(max(seen), 20.944, places=3)
        self.wait(lambda: self.node["velocity_actual"] == 0)
        self.assertIsNone(self.node.enabled_at)

    def test_run_by_duty(self):
        with self.connect() as drive, motion.Motion(drive, "duty", duty=-2500):
            self.assertEqual((drive.read("mode_display"), drive.read("target_duty")), (-3, -2500))
        self.json("run", "duty", "30%", "--for", "0.3")
        with self.connect() as drive:
            self.assertEqual(drive.read("target_duty"), 3000)
        _, err = self.command("run", "duty", "101%", "--for", "0.3", code=2)
        self.assertIn("above the most", err)

    def test_never_unattended(self):
        with mock.patch.object(sys, "stdin", io.StringIO()):
            _, err = self.command("run", "speed", "200rpm", code=2)
        self.assertIn("--for SECONDS", err)
        self.command("run", "speed", "200rpm", "--for", "1e9", code=2)
        self.assertEqual(self.node.lib.cia402_on(self.node.profile), 0)

    def held(self, *keys, code=0):
        """Of `run` at a terminal where these come, one every 50 ms: what was seen, and how long it ran after the last."""
        master, slave = os.openpty()
        last_s = []

        def press():
            for key in keys:
                time.sleep(0.05)
                os.write(master, key)
                last_s.append(time.monotonic())

        thread = threading.Thread(target=press)
        with open(slave, encoding="ascii") as terminal, mock.patch.object(sys, "stdin", terminal):
            thread.start()
            seen = self.json("run", "speed", "200rpm", code=code)
            ended_s = time.monotonic()
            thread.join()
        os.close(master)
        return seen, ended_s - last_s[-1]

    def test_while_a_key_is_held(self):
        seen, after_s = self.held(*[b" "] * 30)
        self.assertAlmostEqual(max(x["velocity_actual"]["value"] for x in seen), 20.944, places=3)
        self.assertGreater(after_s, 0.5)  # a keyboard needs so long until it repeats
        self.wait(lambda: self.node["velocity_actual"] == 0)
        self.assertIsNone(self.node.enabled_at)

    def test_another_key_ends_it(self):
        _, after_s = self.held(*[b" "] * 10, b"q", *[b" "] * 100)
        self.assertIsNone(self.node.enabled_at)
        self.assertLess(after_s, 0.0)

    def test_no_other_key_begins(self):
        seen, _ = self.held(b"x", code=1)
        self.assertIn("was not pressed", seen[0]["error"])
        self.assertEqual(self.node.lib.cia402_on(self.node.profile), 0)

    def test_stops_on_interrupt(self):
        with self.connect() as drive:
            with self.assertRaises(KeyboardInterrupt):
                with motion.Motion(drive, "speed", speed=20000):
                    self.wait(lambda: drive.read("velocity_actual") == 20000)
                    raise KeyboardInterrupt
            self.wait(lambda: self.node["velocity_actual"] == 0)
            self.assertEqual(self.node.fault, 0)

    def test_interrupted_once_more_it_is_off_at_once(self):
        """Stopping takes its time; who interrupts that too does not leave a motor that runs."""
        with self.connect() as drive:
            words = []
            def heard(motion_, controlword, original=motion.Motion._send):
                words.append(controlword)
                original(motion_, controlword)
            with mock.patch.object(motion.Motion, "_send", heard), self.assertRaises(KeyboardInterrupt):
                with motion.Motion(drive, "speed", speed=20000):
                    self.wait(lambda: drive.read("velocity_actual") == 20000)
                    drive.state = mock.Mock(side_effect=KeyboardInterrupt)  # the second, while it slows down
                    raise KeyboardInterrupt
            self.assertEqual(words[-2:], [motion.SWITCH_ON, 0])
            self.wait(lambda: not self.node.lib.cia402_on(self.node.profile))

    def test_backwards_without_dashes(self):
        seen = self.json("run", "speed", "-200rpm", "--for", "1.5")
        self.assertLess(seen[-1]["velocity_actual"]["value"], -10)

    def test_what_limits_the_motor_is_said(self):
        self.node["drive_limits"] = 9
        out, _ = self.command("run", "speed", "200rpm", "--for", "0.3")
        self.assertIn("limited by: DC-link voltage, current", out)
        self.node["drive_limits"] = 0
        self.assertNotIn("limited by", self.command("run", "speed", "200rpm", "--for", "0.3")[0])

    def test_watch(self):
        rows = self.json("watch", "i_q", "--for", "0.3", "--interval", "0.05")
        self.assertGreater(len(rows), 3)
        self.assertEqual(rows[0]["i_q"]["unit"], "A")
        self.assertIn("velocity_actual", self.command("watch", "--for", "0.1")[0])
        _, err = self.command("watch", "--out", "x.txt", code=2)
        self.assertIn(".png", err)
        with mock.patch.dict(sys.modules, matplotlib=None):
            self.assertIn("matplotlib is not installed", self.command("watch", "--for", "9", "--out", "x.png", code=2)[1])

    def test_commands_cease(self):
        """The program is killed: the drive's own timer switches the torque off."""
        with self.connect() as drive:
            running = motion.Motion(drive, "speed", speed=20000)
            running.start()
            running.task.stop()
            began = time.monotonic()
            self.wait(lambda: self.node.fault != 0)
            self.assertLess(time.monotonic() - began, 1.5)  # 0.5 s of 1400h:05
            self.assertEqual(self.node.alarms[0], 0x8250)

    def test_timer_that_was_switched_off(self):
        with self.connect() as drive:
            drive.write("rpdo1.event_timer", 0)
            with motion.Motion(drive, "speed", speed=0):
                self.assertEqual(drive.read("rpdo1.event_timer"), motion.WATCH_MS)

    def test_fault_while_running(self):
        threading.Timer(0.5, lambda: self.node.trip(1)).start()
        _, err = self.command("run", "speed", "200rpm", "--for", "10", code=1)
        self.assertIn("over-current", err)
        self.assertIn("pmdrive faults --clear", err)

    def test_fault_before(self):
        with self.node.gate:
            self.node.trip(3)
        self.assertIn("DC-link over-voltage", self.command("run", "speed", "200rpm", "--for", "1", code=1)[1])

    def test_another_has_the_same_id(self):
        other = can.Bus(interface="virtual", channel=self.channel)
        self.addCleanup(other.shutdown)
        other.send(can.Message(arbitration_id=0x700 + NODE, data=[5], is_extended_id=False))
        with self.connect() as drive:
            self.wait(lambda: drive.read("error_register"))
            running = motion.Motion(drive, "speed", speed=1000)
            with self.assertRaisesRegex(pmdrive.NotDone, "two nodes use the same identifier"):
                running.start(seconds=1.0)
            running.stop()

    def test_mapping_of_another(self):
        with self.connect() as drive:
            drive.write("rpdo1.cob_id", 0x80000200 + NODE)
            drive.write("rpdo1_mapping.count", 0)
        _, err = self.command("run", "speed", "200rpm", "--for", "1", code=2)
        self.assertIn("receive PDO 1 is not as delivered", err)

    def test_faults(self):
        with self.node.gate:
            self.node.trip(8)
        out, _ = self.command("faults")
        self.assertIn("position lost", out)
        self.assertIn("7305h", out)
        self.assertEqual(self.json("faults")[0]["code"], 8)
        self.command("faults", "--clear")
        self.assertEqual(self.json("faults")[0]["fault"], None)

    def test_stop(self):
        with self.connect() as drive, motion.Motion(drive, "speed", speed=20000) as running:
            self.wait(lambda: drive.state() == "operation enabled")
            running.task.stop()
            self.command("stop")
            self.assertNotEqual(drive.state(), "operation enabled")


class Identification(Bench):
    FOUND = {"R_s": 5900000, "dead_voltage": 7100, "leg_capacitance": 480, "L_d": 42000000, "L_q": 74000000, "L_q_rated": 70000000,
             "L_dh_rated": 42000000, "L_qh_rated": 62000000, "L_dqh_rated": -4000000, "cross_half": -30000,
             "psi_m": 235000000, "J": 9000000, "friction": 1000000, "coulomb": 20000}

    def setUp(self):
        super().setUp()
        for name, raw in self.FOUND.items():
            self.node[f"identification.{name}"] = raw
        self.node["dc_link_voltage"] = 300000

    def test_shows_and_writes(self):
        out, _ = self.command("identify", "--yes")
        self.assertIn("0.235 Wb", out)
        self.assertEqual(self.node["identification.command"], 15)
        for name in ("R_s", "L_d", "L_q", "L_q_rated", "L_dqh_rated", "cross_half", "psi_m", "J"):
            self.assertEqual(self.node[name], self.FOUND[name], name)
        self.assertEqual(self.node["device_drop"], 7100 - 6000)  # 2 us of 100 us at 300 V are the dead time's
        self.assertIn("nothing to change", self.command("identify", "--yes")[0])

    def test_only_some(self):
        before = self.node["psi_m"]
        found = self.json("identify", "--only", "resistance,mechanics", "--yes")[:2]
        self.assertEqual([sorted(x) for x in found], [["identification.R_s", "identification.dead_voltage",
                                                       "identification.leg_capacitance"],
                                                      ["identification.J", "identification.coulomb",
                                                       "identification.friction"]])
        self.assertEqual(self.node["identification.command"], 9)
        self.assertEqual((self.node["R_s"], self.node["J"], self.node["psi_m"]), (5900000, 9000000, before))
        self.assertEqual(self.node["leg_capacitance"], 480)
        _, err = self.command("identify", "--only", "colour", "--yes", code=2)
        self.assertIn("resistance, inductance, flux, mechanics", err)

    def test_json_does_not_answer_for_the_user(self):
        for words in ["identify"], ["tune", "--bandwidth", "300"]:
            with mock.patch.object(sys, "stdin", io.StringIO()):
                answer = self.json(*words, code=2)[-1]
            self.assertEqual(answer["do"], "--yes")
        self.assertIsNone(self.node.enabled_at)
        self.assertNotEqual(self.node["current_bandwidth"], 300000)

    def test_asks_before_the_motor_turns(self):
        with mock.patch.object(sys, "stdin", io.StringIO()):
            _, err = self.command("identify", code=2)
        self.assertIn("THE MOTOR TURNS", err)
        self.assertIn("--yes", err)
        self.assertIsNone(self.node.enabled_at)
        self.assertEqual(self.node["R_s"], names.find("R_s").preset)

    def test_asks_before_it_writes(self):
        with mock.patch("pmdrive.attend.confirm", side_effect=[True, False]):
            self.command("identify", code=1)
        self.assertEqual(self.node["R_s"], names.find("R_s").preset)

    def test_says_why_it_failed(self):
        self.node.identify_reason = 4
        _, err = self.command("identify", "--yes", code=1)
        self.assertIn("the rotor does not follow", err)
        self.assertIn("free the shaft", err)
        self.assertIn("of a motor with saliency less, where it is above psi_m/(2 (L_q - L_d))", err)
        self.node.identify_reason = 1
        _, err = self.command("identify", "--yes", code=1)
        self.assertIn("no current at the highest voltage", err)
        self.assertIn("a phase may be open, or the link cannot drive the current, R_s i above 0.45 v_dc: less --current", err)
        self.assertEqual(self.node["R_s"], names.find("R_s").preset)
        self.assertEqual(self.node.lib.cia402_on(self.node.profile), 0)

    def test_a_fault_ends_it(self):
        self.node.identify_s = 30
        threading.Timer(0.5, self.node.trip, (1,)).start()
        _, err = self.command("identify", "--yes", code=1)
        self.assertIn("faults --clear", err)

    def test_interrupt_is_a_quick_stop(self):
        self.node.identify_s = 30
        words = []
        def heard(motion_, controlword, original=motion.Motion._send):
            words.append(controlword)
            original(motion_, controlword)
        with mock.patch.object(motion.Motion, "_send", heard), \
             mock.patch("pmdrive.identify._wait", side_effect=KeyboardInterrupt):
            self.command("identify", "--yes", code=130)
        self.assertIn(motion.QUICK_STOP, words)
        self.assertEqual(self.node.lib.cia402_on(self.node.profile), 0)

    def test_no_saliency_is_none(self):
        self.node["identification.L_q"] = 41500000  # below L_d, which the drive would refuse
        self.node["identification.L_q_rated"] = 41400000
        self.command("identify", "--only", "inductance", "--yes")
        self.assertEqual((self.node["L_d"], self.node["L_q"], self.node["L_dqh_rated"]), (41750000, 41750000, 0))
        self.assertEqual((self.node["L_q_rated"], self.node["L_qh_rated"]), (41750000, 41750000))

    def test_name_plate(self):
        _, err = self.command("identify", "--yes", "--rated-current", "4A", code=2)
        self.assertIn("all four", err)
        plate = ("--pole-pairs", "4", "--max-speed", "3000rpm", "--dc-link", "300V")
        _, err = self.command("identify", "--yes", "--rated-current", "40A", *plate, code=2)
        self.assertIn("cannot measure", err)
        for words, reason in ((("4A", "--pole-pairs", "4", "--max-speed", "1400", "--dc-link", "300V"), "1400rpm or 1400rad/s"),
                              (("-4A", *plate), "below the least"), (("4A", *plate, "--speed", "20"), "without a unit"),
                              (("4A", *plate, "--speed", "1e9rpm"), "above the most")):
            self.assertIn(reason, self.command("identify", "--yes", "--rated-current", *words, code=2)[1])
        self.assertIsNone(self.node.enabled_at)
        self.command("identify", "--yes", "--rated-current", "4A", *plate)
        self.assertEqual((self.node["pole_pairs"], self.node["i_rated"], self.node["speed_max"]), (4, 4000, 314200))
        self.assertEqual(self.node["psi_m"], self.FOUND["psi_m"])  # a guess first, found then

    def test_tune(self):
        out, _ = self.command("tune", "--yes", "--bandwidth", "400")
        self.assertIn("400 Hz", out)
        self.assertEqual(self.node["current_bandwidth"], 400000)
        self.assertIn("nothing to change", self.command("tune", "--yes", "--bandwidth", "400")[0])
        _, err = self.command("tune", "--yes", "--bandwidth", "4000", code=2)
        self.assertIn("a tenth of f_pwm", err)

    def test_tunes_the_amplitude_feedback_by_saliency(self):
        for L_q_uH, gain in ((75000, 500), (46000, 1000)):  # beside L_d of 43 mH; neither is said to saturate
            for name in ("L_q", "L_q_rated", "L_qh_rated"):
                self.node[name] = L_q_uH * 1000
            self.command("tune", "--yes")
            self.assertEqual(self.node["flux_gain"], gain)

    def test_from_python(self):
        with self.connect() as drive:
            found = identify.run(drive, ["flux"])
            self.assertEqual(found, {"flux": {"psi_m": self.FOUND["psi_m"]}})
            self.assertEqual([(e.name, raw) for e, raw in identify.parameters(drive, found).items()],
                             [("psi_m", self.FOUND["psi_m"])])


class Trace(Bench):
    def test_csv(self):
        path = self.path("t.csv")
        found = self.json("trace", "i_d", "theta", "--trigger", "i_d", "--level", "1.5A", "--edge", "falling", "--pre",
                          "0.25", "--divider", "2", "--out", path)
        self.assertEqual(found, [{"file": path, "samples": 300, "signals": ["i_d", "theta"]}])
        self.assertEqual([self.node[f"trace.{x}"] for x in ("trigger", "level", "edge", "pretrigger", "divider")],
                         [1, 1500, 1, 250, 2])
        self.assertEqual([self.node[f"trace_signal.{n}"] for n in (1, 2, 3)], [0x29000100, 0x29000A00, 0])
        with open(path, encoding="ascii") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(list(rows[0]), ["t_s", "i_d_A", "theta_turn"])
        for k in (0, 2, 299):
            self.assertAlmostEqual(float(rows[k]["t_s"]), (k - 2) * 2e-4, places=9)
            self.assertAlmostEqual(float(rows[k]["i_d_A"]), 0.001 * (100 + k - 2), places=9)
            self.assertAlmostEqual(float(rows[k]["theta_turn"]), (200 + k - 2) / 65536, places=8)

    def test_refusals(self):
        self.assertIn("cannot be recorded", self.command("trace", "R_s", code=2)[1])
        self.assertIn("not among the signals", self.command("trace", "i_d", "--trigger", "i_q", code=2)[1])
        self.assertIn("1 to 8", self.command("trace", *["i_d"] * 9, code=2)[1])
        self.assertIn("neither .csv, .png nor .mf4", self.command("trace", "i_d", "--out", "x.mat", code=2)[1])
        self.assertIn("--trigger", self.command("trace", "i_d", "--level", "2A", code=2)[1])

    def test_a_file_that_cannot_be_written(self):
        """It is known before anything is recorded or read."""
        self.node["trace.state"] = 1
        for words, name in ((["trace", "i_d"], "no/x.csv"), (["watch", "--for", "9"], "no/x.png"), (["dump"], "no/x.yaml"),
                            (["eds"], "no/x.eds")):
            path = self.path(name)
            with mock.patch("pmdrive.names.stored", side_effect=AssertionError), \
                 mock.patch("pmdrive.watch.check_path"), mock.patch("pmdrive.trace.check_path"):
                self.assertEqual(self.command(*words, "--out", path, code=2)[1], f"pmdrive: {path}: No such file or directory\n")
        self.assertEqual(self.node["trace.state"], 1)
        self.assertIn("Is a directory", self.command("dump", "--out", self.folder.name, code=2)[1])
        path = self.path("kept.yaml")
        Path(path).write_text("kept", encoding="ascii")
        self.command("dump", "R_x", "--out", path, code=2)
        self.assertEqual(Path(path).read_text(encoding="ascii"), "kept")
        self.command("dump", "R_x", "--out", self.path("none.yaml"), code=2)
        self.assertFalse(Path(self.path("none.yaml")).exists())

    def test_never_triggered(self):
        self.node._trace = lambda command: None
        _, err = self.command("trace", "i_d", "--wait", "0.1", code=1)
        self.assertIn("nothing was recorded in 0.1 s", err)


class Flash(Bench):
    """OpenOCD is a stand-in on PATH; the drive that it is said to have written is on the bus."""

    def setUp(self):
        super().setUp()
        with self.connect() as drive:
            self.image = Path(self.path("an image.elf"))
            self.image.write_bytes(b"\x7fELF" + drive.read("stored_eds") + b"rest")
        self.openocd("exit 0")
        path = mock.patch.dict("os.environ", {"PATH": f"{self.folder.name}:/usr/bin:/bin"})
        path.start()
        self.addCleanup(path.stop)

    def openocd(self, script):
        path = Path(self.path("openocd"))
        path.write_text(f'#!/bin/sh\necho "$@" >>{self.folder.name}/said\n{script}\n', encoding="ascii")
        path.chmod(0o755)

    def said(self):
        path = Path(self.path("said"))
        return path.read_text(encoding="ascii") if path.exists() else ""

    def test_writes_and_verifies_on_the_bus(self):
        out, _ = self.command("flash", str(self.image))
        self.assertIn(f"program {{{self.image}}} verify reset exit", self.said())
        self.assertIn("interface/stlink.cfg", self.said())
        self.assertIn("software_version", out)
        self.assertIn(f"node {NODE} runs it", out)

    def test_another_runs(self):
        self.image.write_bytes(b"\x7fELF")
        _, err = self.command("flash", str(self.image), code=1)
        self.assertIn("its data sheet is another", err)

    def test_without_a_bus(self):
        out = io.StringIO()
        with mock.patch.dict("os.environ"), contextlib.redirect_stdout(out):
            os.environ.pop("PMDRIVE_CAN", None)
            self.assertEqual(cli.main(["flash", str(self.image)]), 0)
        self.assertIn("written and verified; with --can", out.getvalue())

    def test_no_probe(self):
        self.openocd("echo 'Error: open failed' >&2; exit 1")
        out, err = self.command("flash", str(self.image), code=1)
        self.assertIn("Error: open failed", out)
        self.assertIn("no debug probe was found", err)
        self.assertIn("ST-LINK", err)
        self.assertNotIn("runs it", out)

    def test_no_openocd(self):
        _, err = self.command("flash", "--openocd", "no-such-program", str(self.image), code=1)
        self.assertIn("apt-get install openocd", err)

    def test_not_while_the_motor_runs(self):
        with self.connect() as drive, motion.Motion(drive, "speed", speed=20000):
            _, err = self.command("flash", str(self.image), code=1)
        self.assertIn("the motor runs: nothing was written", err)
        self.assertEqual(self.said(), "")

    def test_usage(self):
        self.assertIn("cannot read", self.command("flash", "missing.elf", code=2)[1])
        self.assertIn("not both", self.command("flash", code=2)[1])
        out, _ = self.command("flash", str(self.image), "--dry-run")
        self.assertIn("target/stm32g4x.cfg", out)
        self.assertEqual(self.said(), "")


class Shell(Bench):
    def test_commands(self):
        from pmdrive.shell import Shell as Prompt

        with self.connect() as drive:
            prompt = Prompt(cli.parser().parse_args(["shell"]), drive)
            out = io.StringIO()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
                for line in ("set R_s=6.3", "get R_s", "get R_z", "nonsense", "", "set 'R_s", "help set"):
                    self.assertFalse(prompt.onecmd(line))
            self.assertTrue(prompt.onecmd("quit"))
        self.assertEqual(out.getvalue().count("6.3 ohm"), 2)
        self.assertIn("did you mean R_s?", out.getvalue())
        self.assertIn("NAME=VALUE", out.getvalue())
        self.assertEqual(prompt.completedefault("psi_m"), ["psi_m"])
        self.assertEqual(prompt.completenames("fau"), ["faults"])

    def test_completion(self):
        script, _ = self.command("completion")

        def completed(*words):
            typed = " ".join(f"'{word}'" for word in ("pmdrive", *words))
            line = f"{script}\nCOMP_WORDS=({typed}); COMP_CWORD={len(words)}; _pmdrive 2>/dev/null; echo ${{COMPREPLY[*]}}"
            return subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=True).stdout.split()

        self.assertEqual(completed("fau"), ["faults"])
        self.assertEqual(completed("--node", "5", "get", "psi_m"), ["psi_m"])
        self.assertEqual(completed("set", "psi_m"), ["psi_m="])
        self.assertEqual(completed("trace", "i_d", "--ed"), ["--edge"])
        self.assertEqual(completed("save", "mach"), ["machine"])

    def test_interface(self):
        self.assertIn("is no CAN interface", str(self.error("socketcand:host")))
        self.assertIn("cannot open", str(self.error("nosuchcan0")))

    def test_a_server_that_does_not_greet(self):
        """It is stopped, or has another client."""
        with socket.create_server(("localhost", 0)) as server:
            began = time.monotonic()
            error = str(self.error(f"socketcand:localhost:{server.getsockname()[1]}"))
        self.assertLess(time.monotonic() - began, 2 * bus.CONNECT_S)
        self.assertIn("timed out", error)
        self.assertIn("It takes one client at a time", error)
        self.assertIsNone(socket.getdefaulttimeout())

    def test_a_bus_that_goes_while_a_thread_sends(self):
        said = io.StringIO()
        self.command("help")  # which has its own word for it
        self.addCleanup(setattr, threading, "excepthook", threading.__excepthook__)
        for error, silent in ((can.CanOperationError("gone"), True), (BrokenPipeError(), True), (ValueError("a defect"), False)):
            def fails():
                raise error
            thread = threading.Thread(target=fails)
            with contextlib.redirect_stderr(said):
                thread.start()
                thread.join()
            self.assertEqual(said.getvalue() == "", silent, said.getvalue())

    def error(self, spec):
        with self.assertRaises(pmdrive.PmdriveError) as caught:
            pmdrive.connect(spec)
        return caught.exception


if __name__ == "__main__":
    LIBRARY = Path(sys.argv.pop(1)).absolute()
    sys.path.insert(0, str(Path(__file__).parent))
    unittest.main()
