"""One drive on the bus: its values, what it keeps, its faults. Motion is in motion.py, the oscilloscope in trace.py."""
import contextlib
import random
import time

import can
import canopen
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from . import dictionary, names
from .entry import Entry
from .errors import BusError, Disturbed, FaultError, NoAnswer, NotDone, NotInImage, Refused, UsageError

SAVE = int.from_bytes(b"save", "little")
LOAD = int.from_bytes(b"load", "little")
OPEN = int.from_bytes(b"open", "little")
TOGETHER = 0x06040043  # abort code of the check of all parameters together
STORE_S = 5.0  # most that flash takes
NAMED = 6  # changed values in an error
REASON = ("the bus does not carry the reason: `pmsim run SCENARIO.yaml --set machine=MACHINE.yaml` says it, "
          "with the drive's values in the machine file, and --set NAME=VALUE for each that changes")
TRIES = 10  # where another client of the drive is answered in between
GROUPS = ("all", "communication", "application", "machine")
# Statusword: (mask, value): state of CiA 402
STATES = (
    (0x4F, 0x00, "not ready to switch on"), (0x4F, 0x40, "switch on disabled"), (0x6F, 0x21, "ready to switch on"),
    (0x6F, 0x23, "switched on"), (0x6F, 0x27, "operation enabled"), (0x6F, 0x07, "quick stop active"),
    (0x4F, 0x0F, "fault reaction active"), (0x4F, 0x08, "fault"),
)


def _lost(error):
    return BusError(f"cannot send: {error}", "is the interface still there? Nobody acknowledges where cable, bit rate or power are wrong")


def state_of(statusword):
    return next((name for mask, value, name in STATES if statusword & mask == value), f"0x{statusword:04X}")


def error_text(code):
    """Of an error code of 603Fh, 1003h or an emergency message."""
    fault = next((f for f in dictionary.FAULTS if f.error_code == code & 0xFFFF), None)
    return fault.text if fault else dictionary.ERRORS.get(code & 0xFFFF, "unknown error")


def fault_text(code):
    """Of drive_fault."""
    return dictionary.FAULTS[code - 1].text if 0 < code <= len(dictionary.FAULTS) else "unknown" if code else "none"


def _advice(culprit, changed):
    """What to mend when the drive has refused values together."""
    others = [entry.name for entry in changed if entry is not culprit]
    if not others:
        return f"nothing was changed: mend {culprit.name}, or those that it has to fit; {REASON}"
    named = ", ".join(others) if len(others) <= NAMED else ""
    if culprit in changed:
        among = named or f"the other {len(others)} changes"
        return f"nothing was changed: mend {culprit.name}, or what it has to fit among {among}; {REASON}"
    against = named or f"one of the {len(others)} changes"
    return f"nothing was changed: {culprit.name} was not among the changes; it does not go with {against}; {REASON}"


class Drive:
    """Closes its network. Names may be those of the dictionary or index:sub."""

    def __init__(self, network, node_id):
        self.network, self.node_id = network, node_id
        self.node = canopen.RemoteNode(node_id, canopen.ObjectDictionary())
        network.add_node(self.node)
        self.node.sdo.RESPONSE_TIMEOUT = 0.5
        self.node.sdo.MAX_RETRIES = 2
        self.opened = 0  # depth of open()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        try:
            self.network.disconnect()
        except OSError:  # the interface went before
            pass

    # --- single values ----------------------------------------------------------------------------------------

    def _call(self, label, index, sub, function, *arguments):
        for left in reversed(range(TRIES)):
            try:
                return function(index, sub, *arguments)
            except SdoAbortedError as error:
                known = (index, sub) in names.BY_PLACE and error.code in NotInImage.CODES
                raise (NotInImage if known else Refused)(label, error.code, index, sub) from None
            except SdoCommunicationError as error:
                silent = "No SDO response" in str(error)
                if silent or not left:  # else the answer was to another client of the drive
                    raise NoAnswer(self.node_id, label) if silent else Disturbed(label) from None
                time.sleep(random.uniform(0.0, 0.01))  # out of the other's step
            except (can.CanError, OSError) as error:
                raise _lost(error) from None
        raise AssertionError("the last try returns or raises")

    def send(self, cob_id, data):
        try:
            self.network.send_message(cob_id, data)
        except (can.CanError, OSError) as error:
            raise _lost(error) from None

    def upload(self, index, sub, label=""):
        return self._call(label or f"{index:04X}h:{sub:02X}", index, sub, self.node.sdo.upload)

    def download(self, index, sub, data, label=""):
        self._call(label or f"{index:04X}h:{sub:02X}", index, sub, self.node.sdo.download, data)

    @staticmethod
    def entry(name):
        return name if isinstance(name, Entry) else names.find(name)

    def read(self, name):
        """The integer, text or bytes of an object."""
        entry = self.entry(name)
        return entry.decode(self.upload(entry.index, entry.sub, entry.label))

    def write(self, name, raw):
        entry = self.entry(name)
        if not entry.writable or not entry.number:
            raise UsageError(f"{entry.label} cannot be set", entry.help)
        with self.open(entry.access == "locked"):
            self._write(entry, raw)

    @contextlib.contextmanager
    def open(self, needed=True):
        """What is locked can be written meanwhile. A drive that does not answer closes by itself when it is reset."""
        if not needed:
            yield
            return
        if not self.opened:
            self._write(names.find("parameters_open"), OPEN)
        self.opened += 1
        try:
            yield
        finally:
            self.opened -= 1
            if not self.opened:
                with contextlib.suppress(NoAnswer, Disturbed, BusError):
                    self._write(names.find("parameters_open"), 0)

    def _write(self, entry, raw, changed=()):
        """`changed`: what a batch that is closed by it has."""
        try:
            self.download(entry.index, entry.sub, entry.encode(raw), entry.label)
        except Refused as error:
            if error.code != TOGETHER:
                raise
            culprit = names.BY_PLACE.get(divmod(self.read("parameter_refused"), 256))
            if culprit is None:
                raise
            if entry.name == "parameter_batch":
                raise Refused(f"{culprit.label}, of all together", error.code, culprit.index, culprit.sub,
                              _advice(culprit, changed)) from None
            if culprit is entry:
                raise Refused(entry.label, error.code, entry.index, entry.sub,
                              f"change what it has to fit in the same `pmdrive set`; {REASON}") from None
            raise Refused(f"{entry.label}, by {culprit.label}", error.code, entry.index, entry.sub,
                          f"change {culprit.name} in the same `pmdrive set`; {REASON}") from None

    def get(self, name):
        """A Decimal in the unit of the dictionary, or text."""
        entry = self.entry(name)
        raw = self.read(entry)
        return entry.physical(raw) if entry.number else raw

    def set(self, name, value):
        """A number, or text with a unit. Returns the integer that is there then."""
        entry = self.entry(name)
        raw = entry.parse(value)
        entry.check(raw)
        self.write(entry, raw)
        return self.read(entry)

    # --- many values ------------------------------------------------------------------------------------------

    def dump(self, entries=None, progress=None):
        """{entry: integer}; all that is stored if no entries are given. Without what is not in the drive's image."""
        entries = names.stored() if entries is None else entries
        out = {}
        for n, entry in enumerate(entries, 1):
            try:
                out[entry] = self.read(entry)
            except NotInImage:
                pass
            if progress:
                progress(n, len(entries))
        return out

    def diff(self, values, progress=None):
        """[(entry, here, there)] of what differs from values."""
        present = self.dump(list(values), progress)
        for entry in values.keys() - present.keys():
            if values[entry] != entry.preset:
                self.read(entry)  # says that it is not in this image
        return [(entry, here, values[entry]) for entry, here in present.items() if here != values[entry]]

    def load(self, values, dry_run=False, progress=None):
        """Sets what differs, all checked together by the drive, and reads it back. Returns what diff() gave."""
        changes = self.diff(values)
        if dry_run or not changes:
            return changes
        together = [e for e, _, _ in changes if e.record in names.DRIVE_RECORDS]
        with self.open(any(entry.access == "locked" for entry, _, _ in changes)):
            self._load(changes, together, progress)
        wrong = self.diff({entry: raw for entry, _, raw in changes})
        if wrong:
            lost = ", ".join(f"{entry.name} is {entry.text(here)}" for entry, here, _ in wrong[:5])
            raise NotDone(f"{len(wrong)} of {len(changes)} values were not taken: {lost}",
                          "the drive has refused them when it checked all together")
        return changes

    def _load(self, changes, together, progress):
        if together:
            self.write("parameter_batch", 1)
        try:
            for n, (entry, _, raw) in enumerate(changes, 1):
                self.write(entry, raw)
                if progress:
                    progress(n, len(changes))
        finally:
            if together:
                self._write(names.find("parameter_batch"), 0, together)

    def save(self, group="all"):
        self._store(0x1010, group, SAVE)

    def restore(self, group="all"):
        """Defaults, from the next reset on."""
        self._store(0x1011, group, LOAD)

    def _store(self, index, group, signature):
        if group not in GROUPS:
            raise UsageError(f"`{group}` is none of the groups", ", ".join(GROUPS))
        name = {0x1010: "store", 0x1011: "restore"}[index]
        sdo = self.node.sdo
        usual, sdo.RESPONSE_TIMEOUT = sdo.RESPONSE_TIMEOUT, STORE_S
        try:
            with self.open(names.find(f"{name}.{group}").access == "locked"):
                self.download(index, GROUPS.index(group) + 1, signature.to_bytes(4, "little"), f"{name}.{group}")
        finally:
            sdo.RESPONSE_TIMEOUT = usual

    def reset(self, communication=False, seconds=3.0):
        """Restart of the drive, or of its communication alone; returns when it answers again."""
        self.send(0, bytes([130 if communication else 129, self.node_id]))
        time.sleep(0.05)
        self.await_answer(seconds)

    def await_answer(self, seconds=3.0):
        end = time.monotonic() + seconds
        while True:
            try:
                self.read("device_type")
                return
            except NoAnswer:
                if time.monotonic() > end:
                    raise

    # --- what it is and how it does ---------------------------------------------------------------------------

    def info(self):
        """{name: integer or text} of what identifies it and of its state."""
        wanted = ("device_name", "hardware_version", "software_version", "identity.vendor_id", "identity.product_code",
                  "identity.revision", "identity.serial_number", "parameters_ready", "statusword", "mode_display",
                  "drive_state", "drive_fault", "dc_link_voltage", "temperature")
        return {name: self.read(name) for name in wanted}

    def foreign(self):
        """Why the node's dictionary may be another than this tool's; "" if it is the same."""
        try:
            product, revision = self.read("identity.product_code"), self.read("identity.revision")
        except Refused:
            return f"node {self.node_id} does not say what it is"
        if product != dictionary.PRODUCT_CODE:
            return f"node {self.node_id} is no pmdrive: its product code is {product:08X}h"
        if revision != dictionary.REVISION:
            return (f"node {self.node_id} has revision {revision >> 16}.{revision & 0xFFFF} of the object dictionary, this tool "
                    f"{dictionary.REVISION >> 16}.{dictionary.REVISION & 0xFFFF}: names may mean something else")
        return ""

    def state(self):
        return state_of(self.read("statusword"))

    def faults(self):
        """The latched fault, its record and the history of errors."""
        code = self.read("drive_fault")
        record = [e for e in names.RECORDS["fault_record"] if e.sub]
        count = self.read("error_history.count")
        return {
            "fault": dictionary.FAULTS[code - 1] if 0 < code <= len(dictionary.FAULTS) else None,
            "code": code,
            "record": {e: self.read(e) for e in record},
            "history": [self.read(f"error_history.{n}") for n in range(1, min(count, 8) + 1)],
        }

    def clear_fault(self, seconds=2.0):
        """By the rising edge of bit 7 of the controlword."""
        self.write("controlword", 0)
        self.write("controlword", 0x80)
        end = time.monotonic() + seconds
        while self.state() in ("fault", "fault reaction active"):
            if time.monotonic() > end:
                fault = self.faults()["fault"]
                raise FaultError(f"the fault stays: {fault.text if fault else 'unknown'}", fault.do if fault else "")
            time.sleep(0.02)
        self.write("controlword", 0)
