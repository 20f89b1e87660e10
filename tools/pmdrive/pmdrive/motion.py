"""Runs the motor, as long as someone attends: a time that was given, or a key that is held.

The commands go out ten times a second in receive PDO 1, whose timer in the drive (1400h:05) switches the torque off
when they cease: pulling the cable, closing the laptop or killing the program stops the motor.
"""
import struct
import time

from . import dictionary
from .drive import error_text, state_of
from .errors import FaultError, NotDone, UsageError

PERIOD_S = 0.1
WATCH_MS = 500
MODES = {"speed": 3, "torque": 4, "current": -1, "identify": -2, "duty": -3}
MAPPED = (0x60400010, 0x60600008, 0x60FF0020)
SHUTDOWN, SWITCH_ON, ENABLE, QUICK_STOP = 0x06, 0x07, 0x0F, 0x0B


class Motion:
    """Between start() and stop() the drive follows; use it with `with`, which stops it whatever happens."""

    def __init__(self, drive, mode, speed=0, torque=0, current=0, duty=0):
        """Speed in mrad/s, torque in thousandths of rated, current in mA, duty in 1e-4: the integers of the dictionary."""
        if mode not in MODES:
            raise UsageError(f"`{mode}` is no mode", ", ".join(MODES))
        self.drive, self.mode = drive, MODES[mode]
        self.speed, self.torque, self.current, self.duty = speed, torque, current, duty
        self.task = None

    def __enter__(self):
        try:
            self.start()
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(self, *_):
        self.stop()

    def _data(self, controlword):
        return struct.pack("<Hbi", controlword, self.mode, self.speed)

    def _send(self, controlword):
        self.controlword = controlword
        self.task.update(self._data(controlword))

    def _prepare(self):
        drive = self.drive
        words = [drive.read(f"rpdo1_mapping.object_{n}") for n in range(1, drive.read("rpdo1_mapping.count") + 1)]
        cob_id = drive.read("rpdo1.cob_id")
        if tuple(words) != MAPPED or cob_id & 0x80000000:
            raise UsageError("receive PDO 1 is not as delivered: it carries the commands",
                             "`pmdrive restore communication`, then `pmdrive reset`")
        if not 0 < drive.read("rpdo1.event_timer") <= 1000:
            drive.write("rpdo1.event_timer", WATCH_MS)
        self.check_fault()
        drive.write("target_torque", self.torque)
        drive.write("target_current", self.current)
        if self.mode == MODES["duty"]:  # not in each image
            drive.write("target_duty", self.duty)
        drive.send(0, bytes([1, drive.node_id]))  # NMT: start
        return cob_id & 0x7FF

    def start(self, seconds=10.0):
        cob_id = self._prepare()
        self.task = self.drive.network.send_periodic(cob_id, self._data(0), PERIOD_S)
        for controlword, wanted in ((SHUTDOWN, "ready to switch on"), (SWITCH_ON, "switched on"),
                                    (ENABLE, "operation enabled")):
            self._send(controlword)
            self._wait(wanted, seconds)

    def _wait(self, wanted, seconds):
        end = time.monotonic() + seconds
        while self.drive.state() != wanted:
            self.check_fault()
            if time.monotonic() > end:
                raise NotDone(f"the drive does not go to `{wanted}`, it is `{self.drive.state()}`", self._hindrance())
            time.sleep(0.02)

    def _hindrance(self):
        """An error of the communication that is there, or what the parameters lack."""
        if self.drive.read("error_register") and self.drive.read("error_history.count"):
            return f"the newest error says: {error_text(self.drive.read('error_history.1'))}"
        ready = self.drive.entry("parameters_ready")
        return f"parameters_ready says: {ready.text(self.drive.read(ready))}"

    def check_fault(self):
        if "fault" in state_of(self.drive.read("statusword")):
            code = self.drive.read("drive_fault")
            known = dictionary.FAULTS[code - 1] if 0 < code <= len(dictionary.FAULTS) else None
            raise FaultError(f"the drive is in a fault: {known.text if known else 'of the communication'}",
                             f"{known.do + '; then ' if known else ''}`pmdrive faults --clear`")

    def set_speed(self, speed):
        self.speed = speed
        self._send(self.controlword)

    def quick_stop(self):
        self._send(QUICK_STOP)

    def stop(self, seconds=30.0):
        """Slows down, then off; the commands go on until it is off. Who interrupts that wants the bridge off at once."""
        if self.task is None:
            return
        try:
            self._send(SWITCH_ON)  # disable operation, as 605Ch says
            end = time.monotonic() + seconds
            while self.drive.state() == "operation enabled" and time.monotonic() < end:
                time.sleep(0.02)
            self._send(0)
            time.sleep(2 * PERIOD_S)
        except KeyboardInterrupt:
            self._send(0)
            raise
        finally:
            self.task.stop()
            self.task = None
            self.drive.send(0, bytes([128, self.drive.node_id]))  # NMT: pre-operational


def switch_off(drive):
    """From anywhere, at once: the torque goes off, the motor coasts."""
    drive.write("controlword", 0)
