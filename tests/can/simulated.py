"""The firmware's own CANopen node and CiA 402 state machine on python-can's virtual bus, with a toy for a drive.

The node is the C code of firmware/can in a shared library; what the application would answer, values by slot, cross
check, store, motion, is answered here. Good enough to test the host tool against the real protocol.
"""
import ctypes as c
import threading
import time

import can
from pmdrive import dictionary, names

LE = 0x100000000


class Frame(c.Structure):
    _fields_ = [("id", c.c_uint16), ("length", c.c_uint8), ("data", c.c_uint8 * 8)]


class OdEntry(c.Structure):
    _fields_ = [("index", c.c_uint16), ("sub", c.c_uint8), ("flags", c.c_uint8), ("type", c.c_uint, 4),
                ("kind", c.c_uint, 2), ("group", c.c_uint, 2), ("slot", c.c_uint, 10), ("values", c.c_uint, 10), ("locked", c.c_uint, 1)]


ENTRY = c.POINTER(OdEntry)
CALLS = (
    ("send", c.CFUNCTYPE(c.c_bool, c.c_void_p, c.POINTER(Frame))),
    ("on", c.CFUNCTYPE(c.c_bool, c.c_void_p)),
    ("get", c.CFUNCTYPE(c.c_int32, c.c_void_p, ENTRY)),
    ("put", c.CFUNCTYPE(c.c_uint32, c.c_void_p, ENTRY, c.c_int32)),
    ("size", c.CFUNCTYPE(c.c_uint32, c.c_void_p, ENTRY)),
    ("read", c.CFUNCTYPE(None, c.c_void_p, ENTRY, c.c_uint32, c.POINTER(c.c_uint8), c.c_uint32)),
    ("write", c.CFUNCTYPE(c.c_uint32, c.c_void_p, ENTRY, c.c_uint32, c.POINTER(c.c_uint8), c.c_uint32, c.c_bool)),
    ("store", c.CFUNCTYPE(c.c_uint32, c.c_void_p, c.c_uint32)),
    ("restore", c.CFUNCTYPE(c.c_uint32, c.c_void_p, c.c_uint32)),
    ("recall", c.CFUNCTYPE(None, c.c_void_p)),
    ("alarm", c.CFUNCTYPE(None, c.c_void_p, c.c_uint16)),
    ("reset", c.CFUNCTYPE(None, c.c_void_p)),
)


class Host(c.Structure):
    _fields_ = list(CALLS)


class Cia402In(c.Structure):
    _fields_ = [(n, c.c_bool) for n in ("ready", "fault", "off", "following", "voltage", "limited", "warning")]
    _fields_ += [("velocity", c.c_int32)]


class Cia402Out(c.Structure):
    _fields_ = [("enable", c.c_bool), ("coast", c.c_bool), ("clear_fault", c.c_bool), ("mode", c.c_int8),
                ("velocity", c.c_int32), ("torque", c.c_int32), ("current", c.c_int32), ("duty", c.c_int32)]


PARAMETER, LIVE = 2, 3
IDENTIFY = -2
ALL, MACHINE, LSS = 0, 3, 4
INCOMPATIBLE = 0x06040043


class SimulatedNode(threading.Thread):
    """Runs until stop(). `values` is by name; everything that is not moved by the toy keeps what was put."""

    def __init__(self, library, channel, node_id=1):
        super().__init__(daemon=True)
        self.lib = c.CDLL(str(library))
        self.lib.od_find.restype = ENTRY
        self.lib.od_find.argtypes = [c.c_uint16, c.c_uint8, c.POINTER(c.c_bool)]
        self.lib.cia402_step.restype = Cia402Out
        self.lib.cia402_statusword.restype = c.c_uint16
        self.lib.cia402_on.restype = c.c_bool
        self.lib.cia402_put.restype = c.c_bool
        self.lib.cia402_put.argtypes = [c.c_void_p, c.c_uint16, c.c_int32, c.POINTER(c.c_uint32)]
        self.lib.cia402_get.restype = c.c_bool
        self.lib.cia402_get.argtypes = [c.c_void_p, c.c_uint16, c.POINTER(c.c_int32)]
        self.lib.node_stored.restype = c.c_int32
        self.bus = can.Bus(interface="virtual", channel=channel)
        self.node, self.profile = c.create_string_buffer(16384), c.create_string_buffer(512)
        self.parameters = self._places(names.select([]))
        self.values = {(e.index, e.sub): e.preset or 0 for e in dictionary.ENTRIES if e.number}
        self.kept = {(0x2080, 1): node_id}
        self.backup, self.fault, self.alarms, self.enabled_at, self.speed = None, 0, [], None, 0
        self.identify_reason, self.identify_s = 0, 0.2
        self.texts = {0x1009: b"simulated", 0x3103: b""}
        self.gate, self.mute = threading.Lock(), False
        self.ending = threading.Event()
        self.host = Host(**{name: kind(getattr(self, "_" + name)) for name, kind in CALLS})
        self.boot()
        self.start()

    def _places(self, entries):
        """Slot -> place of those that the library has."""
        rows = ((e, self.lib.od_find(e.index, e.sub, c.byref(c.c_bool()))) for e in entries)
        return {row.contents.slot: (e.index, e.sub) for e, row in rows if row}

    def place(self, name):
        entry = names.find(name)
        return (entry.index, entry.sub)

    def __getitem__(self, name):
        return self.values[self.place(name)]

    def __setitem__(self, name, value):
        with self.gate:
            self.values[self.place(name)] = value

    def at(self, row):
        """Of a parameter, where it stands under its own name: the profile has a second name for one."""
        return self.parameters[row.slot] if row.kind == PARAMETER else (row.index, row.sub)

    # --- what the node asks -------------------------------------------------------------------------------------

    def _send(self, _, frame):
        f = frame.contents
        if not self.mute:
            self.bus.send(can.Message(arbitration_id=f.id, data=bytes(f.data[: f.length]), is_extended_id=False))
        return True

    def _on(self, _):
        return bool(self.lib.cia402_on(self.profile))

    def _get(self, _, entry):
        e = entry.contents
        value = c.c_int32()
        if e.kind == LIVE and self.lib.cia402_get(self.profile, e.slot, c.byref(value)):
            return value.value
        raw = self.values[self.at(e)]
        return raw - LE if raw >= LE // 2 else raw

    def _put(self, _, entry, value):
        e = entry.contents
        code = c.c_uint32()
        if e.kind == LIVE and self.lib.cia402_put(self.profile, e.slot, value, c.byref(code)):
            return code.value
        at = self.at(e)
        if at == (0x2010, 1):
            return self._batch(value)
        before = self.values[at]
        self.values[at] = value
        if e.kind == PARAMETER and not self.values[(0x2010, 1)] and self._check():
            self.values[at] = before
            return INCOMPATIBLE
        if at == self.place("trace.command"):
            self._trace(value)
        return 0

    def _check(self):
        """The one rule between parameters that this toy knows; true: refused."""
        wrong = self.values[self.place("i_trip")] <= self.values[self.place("i_max")]
        index, sub = self.place("i_trip")
        self.values[(0x2010, 2)] = index * 256 + sub if wrong else 0
        return wrong

    def _batch(self, value):
        if value == 1 and not self.values[(0x2010, 1)]:
            self.backup = dict(self.values)
        if value == 0 and self.values[(0x2010, 1)] and self._check():
            refused = self.values[(0x2010, 2)]
            self.values.update(self.backup)
            self.values[(0x2010, 2)] = refused
            return INCOMPATIBLE
        self.values[(0x2010, 1)] = value
        return 0

    def _trace(self, command):
        """Two samples before the trigger, then a ramp, in all signals that are set."""
        signals = [n for n in range(1, 9) if self.values[(0x3101, n)]]
        if command == 0:
            self.values[self.place("trace.state")] = 0
            return
        length = 300
        data = b"".join((100 * n + k - 2).to_bytes(2, "little", signed=True) for k in range(length) for n in signals)
        self.texts[0x3103] = data
        for n in signals:
            self.values[(0x3102, n)] = 32768
        self.values[self.place("trace.state")] = 4
        self.values[self.place("trace.length")] = length
        self.values[self.place("trace.at")] = 2

    def _size(self, _, entry):
        return len(self.texts[entry.contents.index])  # 0: the node says that there is no data

    def _read(self, _, entry, offset, target, count):
        for n, byte in enumerate(self.texts[entry.contents.index][offset : offset + count]):
            target[n] = byte

    def _write(self, *_):
        return 0x06010000

    def _store(self, _, group):
        """Whatever kind it is of: what is stored is what the dictionary says is stored."""
        for e in dictionary.ENTRIES:
            row = self.row(e)
            wanted = group == ALL or row.contents.group == group or (group == LSS and e.record == "bus")
            if e.stored and wanted:
                is_node = row.contents.kind == 1
                self.kept[(e.index, e.sub)] = (self.lib.node_stored(self.node, row) if is_node
                                               else self._get(None, row))
        return 0

    def _restore(self, _, group):
        for e in dictionary.ENTRIES:
            if e.stored and e.record != "bus" and group in (ALL, self.row(e).contents.group):
                self.kept.pop((e.index, e.sub), None)
        return 0

    def _recall(self, _):
        for at, value in self.kept.items():
            row = self.row(names.BY_PLACE[at])
            if row.contents.kind == 1:
                self.lib.node_recall(self.node, row, c.c_int32(value))

    def _alarm(self, _, code):
        self.alarms.append(code)
        if self._on(None):
            self.trip(14)

    def _reset(self, _):
        self.boot()

    # --- life -----------------------------------------------------------------------------------------------------

    def row(self, entry):
        return self.lib.od_find(entry.index, entry.sub, c.byref(c.c_bool()))

    def now_us(self):
        return c.c_uint32(int(time.monotonic() * 1e6) % LE)

    def boot(self):
        for e in dictionary.ENTRIES:
            if e.stored:
                self.values[(e.index, e.sub)] = self.kept.get((e.index, e.sub), e.preset)
        self.fault, self.speed = 0, 0
        self.lib.cia402_init(self.profile)
        self.lib.node_init(self.node, c.byref(self.host), 0x1234, self.now_us())

    def trip(self, code):
        self.fault = self.fault or code
        self.values[self.place("drive_fault")] = self.fault
        self.values[self.place("fault_record.code")] = self.fault
        self.values[self.place("error_code")] = dictionary.FAULTS[self.fault - 1].error_code
        self.lib.node_error(self.node, 0, dictionary.FAULTS[self.fault - 1].error_code, self.fault)

    def _clear(self):
        self.fault = 0
        self.values[self.place("drive_fault")] = 0
        self.lib.node_error(self.node, 0, 0, 0)

    def _drive(self, dt):
        """Follows the speed within a tenth of a second; the bridge is off when it stands and is not enabled."""
        inside = Cia402In(ready=True, fault=self.fault != 0, off=self.speed == 0 and self.enabled_at is None,
                          following=True, voltage=True, limited=False, warning=False, velocity=int(self.speed))
        out = self.lib.cia402_step(self.profile, c.byref(inside))
        if out.clear_fault:
            self._clear()
        enable = out.enable and not self.fault
        self.enabled_at = (self.enabled_at or time.monotonic()) if enable else None
        if enable and out.mode == IDENTIFY:
            self._identify()
        target = out.velocity if enable and out.mode != IDENTIFY else 0
        step = 2e6 * dt
        self.speed += max(-step, min(step, target - self.speed))
        if self.fault:
            self.speed = 0
        self.values[self.place("velocity_actual")] = int(self.speed)
        self.values[self.place("statusword")] = self.lib.cia402_statusword(self.profile, c.byref(inside))

    def _identify(self):
        """Takes its time, then it is done, or failed for the reason it was given."""
        gone = (time.monotonic() - self.enabled_at) / self.identify_s
        done = 3 if self.identify_reason else 2
        self.values[self.place("identification.state")] = 1 if gone < 1 else done
        self.values[self.place("identification.progress")] = int(min(100, 100 * gone))
        self.values[self.place("identification.reason")] = self.identify_reason if gone >= 1 else 0

    def run(self):
        last = time.monotonic()
        while not self.ending.is_set():
            message = self.bus.recv(0.001)
            with self.gate:
                if message is not None and not message.is_extended_id and not self.mute:
                    data = (c.c_uint8 * 8)(*message.data)
                    frame = Frame(message.arbitration_id, len(message.data), data)
                    self.lib.node_receive(self.node, c.byref(frame), self.now_us())
                self.lib.node_run(self.node, self.now_us())
                now = time.monotonic()
                self._drive(now - last)
                last = now

    def stop(self):
        self.ending.set()
        self.join(2.0)
        self.bus.shutdown()
