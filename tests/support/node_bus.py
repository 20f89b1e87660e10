"""A live node (`pmsim node`) and its bus, for tests: standard library alone."""

import errno
import os
import pathlib
import re
import select
import signal
import socket
import struct
import subprocess
import threading
import time
import tty

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENARIO = ROOT / "tests" / "scenario" / "node.yaml"
STATES = ("off", "calibrating", "finding", "running", "stopping", "fault")
EXTENDED, REMOTE_REQUEST, ERROR = 0x80000000, 0x40000000, 0x20000000  # as in <linux/can.h>


class VirtualBus:
    """A raw socket on a SocketCAN interface; hears the given identifiers only."""

    LAYOUT = struct.Struct("=IB3x8s")

    def __init__(self, name, *identifiers):
        self.socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        filters = b"".join(struct.pack("=II", i, 0x7FF | EXTENDED | REMOTE_REQUEST) for i in identifiers)
        self.socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, filters)
        self.socket.bind((name,))

    def send(self, identifier, data):
        """False: the interface is down or full."""
        try:
            self.socket.send(self.LAYOUT.pack(identifier, len(data), bytes(data).ljust(8, b"\0")))
            return True
        except OSError as error:
            if error.errno in (errno.ENETDOWN, errno.ENOBUFS):
                return False
            raise

    def receive(self, timeout_s):
        """(identifier, data), or None after the time."""
        if not select.select([self.socket], [], [], max(0.0, timeout_s))[0]:
            return None
        try:
            identifier, length, data = self.LAYOUT.unpack(self.socket.recv(16))
        except OSError as error:
            if error.errno == errno.ENETDOWN:  # told once
                return None
            raise
        return identifier, data[:length]


class SerialBus:
    """The user's side of a serial-line CAN adapter."""

    def __init__(self, path):
        self.fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.fd)
        self.text = b""
        os.write(self.fd, b"O\r")

    def send(self, identifier, data):
        os.write(self.fd, f"t{identifier:03X}{len(data)}{bytes(data).hex().upper()}\r".encode())
        return True

    def receive(self, timeout_s):
        deadline_s = time.monotonic() + timeout_s
        while b"\r" not in self.text:
            left_s = max(0.0, deadline_s - time.monotonic())
            if not select.select([self.fd], [], [], left_s)[0]:
                return None
            self.text += os.read(self.fd, 4096)
        line, self.text = self.text.split(b"\r", 1)
        data = bytes.fromhex(line[5:].decode())
        assert line[:1] == b"t" and int(line[4:5]) == len(data), line
        return int(line[1:4], 16), data


class Remote:
    """What a CiA 402 master says to the drive with its default process data, and hears from it."""

    NMT, COMMAND, STATUS, SDO, HEARTBEAT = 0x000, 0x201, 0x181, 0x601, 0x701
    PERIOD_S = 0.5  # of the heartbeat, in the drive's time
    TIMEOUT_S = 0.5  # after which the drive goes off
    VELOCITY = 3  # mode of operation
    enabled = False  # as far as it has been said

    @classmethod
    def command(cls, enable, speed_rad_s=0.0, clear=False):
        """The frames of it: (identifier, data). The steps from off to on are said once."""
        words = [0x0F] if enable and cls.enabled else [0x06, 0x07, 0x0F] if enable else [0x07]
        if clear:
            words = [0x80, *words]
        cls.enabled = enable
        speed = round(1e3 * speed_rad_s)
        return [(cls.NMT, bytes([1, 1]))] + [
            (cls.COMMAND, struct.pack("<Hbi", word, cls.VELOCITY, speed)) for word in words]

    @classmethod
    def repeated(cls, frames):
        """Of a command that has been said: its last word alone."""
        return frames[-1:]

    @classmethod
    def state(cls, frame):
        """Name of the drive's state, None if the frame is of something else."""
        identifier, data = frame
        if identifier != cls.STATUS or len(data) < 2:
            return None
        word = data[0]
        if word & 0x08:
            return "fault"
        return "running" if word & 0x6F == 0x27 else "off"

    @classmethod
    def heartbeat(cls, period_s):
        """Writes 1017h."""
        return cls.SDO, struct.pack("<BHBI", 0x2B, 0x1017, 0, round(1e3 * period_s))

    @classmethod
    def is_beat(cls, frame):
        return frame[0] == cls.HEARTBEAT

    @classmethod
    def is_command(cls, identifier, data):
        """Such a frame would be obeyed, by whomever it is sent."""
        return identifier in (0x000, 0x201, 0x301, 0x401, 0x501, 0x601, 0x7E5)


class Node:
    """The program and what it prints."""

    def __init__(self, pmsim, bus, *options, scenario=SCENARIO, image=None):
        what = ["node"] if image is None else ["board", image, "--similar"]  # the latter on the emulated board
        self.process = subprocess.Popen(
            [pmsim, *what, scenario, "--can", bus, *map(str, options)],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.lines, self.came, self.news, self.mark = [], [], threading.Condition(), 0
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()
        self.where = self.wait_for(r"node on (.*); Ctrl-C ends").group(1)

    def _read(self):
        for line in self.process.stdout:
            with self.news:
                self.lines.append(line.rstrip())
                self.came.append(time.monotonic())
                self.news.notify_all()
        with self.news:
            self.lines.append(None)
            self.came.append(time.monotonic())
            self.news.notify_all()

    def wait_for(self, pattern, timeout_s=60.0):
        """The first line since the last one found that has the pattern."""
        deadline_s = time.monotonic() + timeout_s
        with self.news:
            while True:
                for n in range(self.mark, len(self.lines)):
                    found = re.search(pattern, self.lines[n]) if self.lines[n] is not None else None
                    if found:
                        self.mark = n + 1
                        return found
                ended = bool(self.lines) and self.lines[-1] is None
                if ended or not self.news.wait(deadline_s - time.monotonic()):
                    raise AssertionError(f"no line with {pattern!r} in:\n{self.text()}")

    def time_of(self, what, timeout_s=60.0):
        """Simulated time of the next such line."""
        return float(self.wait_for(rf"([0-9.]+) s  {what}", timeout_s).group(1))

    def now_s(self):
        """Simulated time, from the last line that told one: it follows the clock of the wall but for what is lost."""
        with self.news:
            for line, came in zip(reversed(self.lines), reversed(self.came)):
                told = re.match(r" *([0-9.]+) s  ", line or "")
                if told:
                    return float(told.group(1)) + time.monotonic() - came
        raise AssertionError(f"no line with a time in:\n{self.text()}")

    def since(self, mark):
        """What has happened since that many lines."""
        with self.news:
            return [re.sub(r"^ *[0-9.]+ s  ", "", line) for line in self.lines[mark:] if line is not None]

    def text(self):
        return "\n".join(line for line in self.lines if line is not None)

    def stop(self, number=signal.SIGINT):
        """Exit code; the last line tells of time and frames."""
        self.process.send_signal(number)
        code = self.process.wait(30)
        self.reader.join(10)
        return code


class Master:
    """Repeats a command until it is closed, as a master does, and follows the drive's state."""

    EVERY_S = 0.02

    def __init__(self, bus):
        self.bus = bus
        Remote.enabled = False
        self.frames, self.silent = Remote.command(False), False
        self.state = None
        self.news, self.done = threading.Condition(), False
        self.threads = [threading.Thread(target=run, daemon=True) for run in (self._speak, self._listen)]
        for thread in self.threads:
            thread.start()

    def _speak(self):
        while not self.done:
            if not self.silent:
                frames = self.frames
                for frame in frames:
                    self.bus.send(*frame)
                if self.frames is frames:
                    self.frames = Remote.repeated(frames)
            time.sleep(self.EVERY_S)

    def _listen(self):
        while not self.done:
            frame = self.bus.receive(0.1)
            state = Remote.state(frame) if frame else None
            if state:
                with self.news:
                    self.state = state
                    self.news.notify_all()

    def say(self, enable, speed_rad_s=0.0, clear=False):
        self.frames = Remote.command(enable, speed_rad_s, clear)

    def wait_for(self, *states, timeout_s=60.0):
        with self.news:
            if not self.news.wait_for(lambda: self.state in states, timeout_s):
                raise AssertionError(f"the drive's state is {self.state}, not one of {states}")

    def clear(self):
        """Off, and the fault cleared."""
        self.say(False)
        time.sleep(0.1)
        self.say(False, clear=True)
        self.wait_for("off")
        self.say(False)

    def close(self):
        self.done = True
        for thread in self.threads:
            thread.join()
