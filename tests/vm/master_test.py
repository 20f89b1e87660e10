"""An independent master, canopen's BaseNode402, runs a drive over a real SocketCAN bus by the delivered data sheet:
enable, run, step the speed, stop; then the fault of a master that falls silent: told, read, reset.

usage: tests/vm/run python3 tools/python_environment.py can out/python tests/vm/master_test.py PMSIM [--runs N] [--image ELF]

The drive is `pmsim node`, with --image the flashed image on the emulated board. Each run starts it anew. Exit code 77:
there is no such image.
"""
import argparse
import sys
import time
import traceback
from pathlib import Path

import canopen
from canopen.profiles.p402 import BaseNode402

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
from node_bus import Node  # noqa: E402

BUS, NODE = "vcan0", 1
EDS = ROOT / "tools" / "pmdrive" / "pmdrive" / "pmdrive.eds"
SPEEDS_RAD_S = (30.0, 60.0, -40.0)
SPEED_RAD_S = 1.5  # that the estimate may be off: 2 % of rated speed, and its ripple
SETTLED_S = 8.0  # most until it is there; also where the computer is slower than the drive's time
PATIENCE_S = 5.0
COMMAND_S = 0.1  # between two RPDOs
SILENCE_S = 0.5  # 1400h:5, as delivered
RPDO_LOST = 0x8250


def wait(what, condition, seconds):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"not within {seconds} s: {what}"
        time.sleep(0.01)


class Bench:
    """A drive that has just been switched on, and its master."""

    def __init__(self, pmsim, image):
        self.network = canopen.Network()
        self.network.connect(interface="socketcan", channel=BUS)
        self.master = BaseNode402(NODE, str(EDS))
        # Patience of the master's, for a drive that slows down first, and for a computer slower than the drive's time.
        self.master.TIMEOUT_SWITCH_STATE_FINAL = self.master.TIMEOUT_SWITCH_STATE_SINGLE = PATIENCE_S
        self.master.TIMEOUT_SWITCH_OP_MODE = self.master.TIMEOUT_CHECK_TPDO = PATIENCE_S
        self.master.sdo.RESPONSE_TIMEOUT = PATIENCE_S
        self.network.add_node(self.master)
        self.told = []
        self.master.emcy.add_callback(self.told.append)
        try:
            self.drive = Node(pmsim, BUS, image=image)
        except BaseException:
            self.network.disconnect()
            raise

    def close(self):
        if self.master.rpdo[1]._task is not None:
            self.master.rpdo[1].stop()
        self.network.disconnect()
        code = self.drive.stop()
        assert code == 0, f"exit code {code}"

    def command(self, speed_rad_s):
        self.master.rpdo[1]["target_velocity"].phys = speed_rad_s

    def speed(self):
        return self.master.tpdo[1]["velocity_actual"].phys

    def runs_at(self, speed_rad_s):
        self.command(speed_rad_s)
        wait(f"{speed_rad_s} rad/s", lambda: abs(self.speed() - speed_rad_s) < SPEED_RAD_S, SETTLED_S)


def run(bench):
    master = bench.master
    assert master.nmt.wait_for_heartbeat(10.0) == "PRE-OPERATIONAL"
    assert master.sdo["identity"]["product_code"].raw != 0
    master.setup_402_state_machine()
    master.nmt.state = "OPERATIONAL"
    master.rpdo[1].start(COMMAND_S)  # the drive watches it
    master.op_mode = "PROFILED VELOCITY"
    bench.command(0.0)
    master.state = "OPERATION ENABLED"
    for speed_rad_s in SPEEDS_RAD_S:
        bench.runs_at(speed_rad_s)
    assert master.sdo["measured"]["drive_fault"].raw == 0
    assert not bench.told, bench.told
    bench.command(0.0)
    wait("standstill", lambda: abs(bench.speed()) < SPEED_RAD_S, SETTLED_S)
    master.state = "SWITCHED ON"
    master.state = "SWITCH ON DISABLED"

    master.state = "OPERATION ENABLED"
    bench.runs_at(SPEEDS_RAD_S[0])
    master.rpdo[1].stop()
    wait("the fault", master.is_faulted, SILENCE_S + 5.0)
    wait("the message of it", lambda: bench.told, 1.0)
    assert bench.told[0].code == RPDO_LOST, bench.told
    assert master.sdo["error_code"].raw == RPDO_LOST
    assert master.sdo["error_history"][1].raw & 0xFFFF == RPDO_LOST
    assert master.sdo["measured"]["drive_fault"].raw != 0
    master.rpdo[1].start(COMMAND_S)
    master.reset_from_fault()  # which enables again
    assert master.state == "OPERATION ENABLED", master.state
    assert master.sdo["measured"]["drive_fault"].raw == 0
    bench.runs_at(SPEEDS_RAD_S[0])
    master.state = "SWITCH ON DISABLED"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pmsim")
    parser.add_argument("--runs", type=int, default=1)
    parser.add_argument("--image", help="pmdrive.elf of the cross build")
    arguments = parser.parse_args()
    if arguments.image and not Path(arguments.image).is_file():
        print(f"skipped: no {arguments.image}: the cross build makes it")
        return 77
    passed = 0
    for n in range(1, arguments.runs + 1):
        began = time.monotonic()
        bench = Bench(arguments.pmsim, arguments.image)
        try:
            run(bench)
            passed += 1
            print(f"PASS  run {n}, {time.monotonic() - began:.1f} s", flush=True)
        except (AssertionError, RuntimeError, canopen.SdoCommunicationError, canopen.SdoAbortedError) as error:
            traceback.print_exception(error)
            print(f"FAIL  run {n}\n{bench.drive.text()}", flush=True)
        finally:
            bench.close()
    print(f"{passed} of {arguments.runs} runs passed")
    return 0 if passed == arguments.runs else 1


sys.exit(main())
