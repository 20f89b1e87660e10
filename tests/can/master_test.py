"""An independent master, canopen's BaseNode402, drives the firmware's node by the delivered data sheet.

usage: master_test.py LIBRARY [unittest's words]     the shared library of firmware/can
"""
import sys
import time
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools" / "pmdrive"))
import canopen  # noqa: E402
from canopen.profiles.p402 import BaseNode402  # noqa: E402
from simulated import SimulatedNode  # noqa: E402

LIBRARY = None
NODE = 9
EDS = ROOT / "tools" / "pmdrive" / "pmdrive" / "pmdrive.eds"


class Master(unittest.TestCase):
    def setUp(self):
        channel = f"master.{self._testMethodName}"
        self.drive = SimulatedNode(LIBRARY, channel, NODE)
        self.network = canopen.Network()
        self.network.connect(interface="virtual", channel=channel)
        self.node = BaseNode402(NODE, str(EDS))
        self.network.add_node(self.node)

    def tearDown(self):
        if self.node.rpdo[1]._task is not None:
            self.node.rpdo[1].stop()
        self.network.disconnect()
        self.drive.stop()

    def enable(self, mode="PROFILED VELOCITY"):
        self.node.nmt.state = "OPERATIONAL"
        self.node.setup_402_state_machine()
        self.node.rpdo[1].start(0.1)  # the drive watches it: 1400h:05
        self.node.op_mode = mode
        self.node.state = "OPERATION ENABLED"
        self.assertEqual(self.node.state, "OPERATION ENABLED")

    def wait(self, condition, seconds=3.0):
        end = time.monotonic() + seconds
        while not condition() and time.monotonic() < end:
            time.sleep(0.01)
        self.assertTrue(condition())

    def test_runs_steps_and_stops(self):
        self.enable()
        for speed in (20.0, -35.0, 0.0):
            self.node.rpdo[1]["target_velocity"].phys = speed
            self.wait(lambda wanted=speed: abs(self.node.tpdo[1]["velocity_actual"].phys - wanted) < 0.001)
        self.node.state = "SWITCHED ON"
        self.node.state = "SWITCH ON DISABLED"
        self.assertFalse(self.drive.lib.cia402_on(self.drive.profile))

    def test_fault_is_told_and_reset(self):
        told = []
        self.node.emcy.add_callback(told.append)
        self.enable()
        with self.drive.gate:
            self.drive.trip(1)
        self.wait(lambda: self.node.is_faulted())
        self.wait(lambda: told)
        self.assertEqual((told[0].code, told[0].register & 1), (0x2310, 1))
        self.assertEqual(self.node.sdo["error_code"].raw, 0x2310)
        self.assertEqual(self.node.sdo["error_history"][1].raw & 0xFFFF, 0x2310)
        self.assertEqual(self.node.tpdo[1]["velocity_actual"].raw, 0)
        self.node.reset_from_fault()  # which enables again
        self.wait(lambda: self.node.state == "OPERATION ENABLED")
        self.assertEqual(self.drive.fault, 0)

    def test_maps_what_it_wants(self):
        self.node.nmt.state = "PRE-OPERATIONAL"
        pdo = self.node.tpdo
        pdo.read()
        pdo[2].clear()
        pdo[2].add_variable("measured", "temperature")
        pdo[2].add_variable("dc_link_voltage")
        pdo[2].trans_type, pdo[2].event_timer, pdo[2].enabled = 255, 20, True
        pdo[2].save()
        self.drive["temperature"], self.drive["dc_link_voltage"] = -123, 311000
        self.node.nmt.state = "OPERATIONAL"
        self.wait(lambda: pdo[2]["dc_link_voltage"].raw == 311000)
        self.assertAlmostEqual(pdo[2]["measured.temperature"].phys, -12.3)

    def test_profile_velocity_by_names(self):
        machine = self.node.sdo["machine"]
        self.node.sdo["parameter_set"]["parameters_open"].raw = int.from_bytes(b"open", "little")
        machine["R_s"].phys = 6.2
        self.assertEqual(machine["R_s"].raw, 6200000)
        self.assertEqual(self.node.sdo["supported_modes"].raw, 0x7000C)
        self.assertTrue(self.node.is_op_mode_supported("PROFILED VELOCITY"))
        self.node.sdo["profile_acceleration"].phys = 123.0
        self.assertEqual(self.node.sdo["control"]["acceleration"].phys, 123.0)

    def test_heartbeat(self):
        self.node.sdo["heartbeat_time"].raw = 50
        self.assertEqual(self.node.nmt.wait_for_heartbeat(2), "PRE-OPERATIONAL")

    def test_vanishes(self):
        """1016h: the heartbeat of node 127 ceases while the motor runs."""
        beat = self.network.send_periodic(0x77F, [5], 0.05)
        self.enable()
        time.sleep(0.2)
        beat.stop()
        self.wait(lambda: self.drive.fault != 0)
        self.assertEqual(self.drive.alarms[0], 0x8130)


if __name__ == "__main__":
    LIBRARY = Path(sys.argv.pop(1)).absolute()
    sys.path.insert(0, str(Path(__file__).parent))
    unittest.main()
