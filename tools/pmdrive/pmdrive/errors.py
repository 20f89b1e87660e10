"""What can go wrong, said so that the reader knows the object, the reason and what to do."""

# CiA 301: abort code: (what it means, what to do)
ABORTS = {
    0x05030000: ("toggle bit not alternated", "another client may be talking to this node: stop it"),
    0x05040000: ("transfer timed out in the device", "the bus is overloaded or frames get lost: try again"),
    0x05040001: ("command not valid or unknown", "the device does not know this kind of transfer"),
    0x05040002: ("invalid block size", "try again"),
    0x05040003: ("invalid sequence number", "frames were lost: check cable, termination and load of the bus"),
    0x05040004: ("wrong checksum", "frames were corrupted or lost: check cable, termination and load of the bus"),
    0x05040005: ("out of memory in the device", "transfer less at a time"),
    0x06010000: ("access not supported", "this firmware has the object but not what it is for"),
    0x06010001: ("object can only be written", "there is nothing to read"),
    0x06010002: ("object can only be read", "it cannot be set"),
    0x06020000: ("no such object in the device",
                 "the firmware is of another version than this tool: `pmdrive info` tells which"),
    0x06040041: ("object cannot be mapped to process data", "choose one marked t or r in docs/object-dictionary.md"),
    0x06040042: ("mapped objects are longer than the message", "map fewer: eight bytes at most"),
    0x06040043: ("does not go with other values of the device",
                 "change those that belong together in one `pmdrive set`, or with `pmdrive load`"),
    0x06040047: ("internal incompatibility in the device", "report it with the output of `pmdrive info`"),
    0x06060000: ("hardware error in the device", "the flash could not be written: try again, then replace the board"),
    0x06070010: ("length does not match", "the firmware is of another version than this tool"),
    0x06070012: ("value too long", "the firmware is of another version than this tool"),
    0x06070013: ("value too short", "the firmware is of another version than this tool"),
    0x06090011: ("no such sub-index in the device",
                 "the firmware is of another version than this tool: `pmdrive info` tells which"),
    0x06090030: ("value not valid", "choose one of those in docs/object-dictionary.md"),
    0x06090031: ("value too high", "`pmdrive info NAME` shows the range"),
    0x06090032: ("value too low", "`pmdrive info NAME` shows the range"),
    0x06090036: ("most is below least", "change the other limit first"),
    0x08000000: ("general error in the device", "try again"),
    0x08000020: ("data cannot be stored or transferred", "the signature was wrong, or the store is not ready"),
    0x08000021: ("locked in the device", "open it first: parameters_open, 6E65 706Fh; NMT stop and a reset close it"),
    0x08000022: ("not in the present state of the device",
                 "switch the bridge off first: `pmdrive stop`; after four saves there is one every 30 s"),
    0x08000023: ("no object dictionary", "the firmware is broken: flash it again"),
    0x08000024: ("no data available", "nothing has been recorded yet"),
}


class PmdriveError(Exception):
    """Base of all errors of this tool: `text` says what, `do` what to do about it."""

    def __init__(self, text, do=""):
        super().__init__(f"{text}\n  {do}" if do else text)
        self.text, self.do = text, do

    def as_dict(self):
        return {"error": self.text, "do": self.do}


class UsageError(PmdriveError):
    """The command line or a file makes no sense."""


class ValueRefused(UsageError):
    """A value that is not sent, because the device would refuse it."""

    def __init__(self, entry, reason):
        super().__init__(f"{entry.label}: {reason}", entry.help)
        self.entry = entry

    def as_dict(self):
        return {**super().as_dict(), "object": self.entry.name, "index": self.entry.index, "sub": self.entry.sub}


class Refused(PmdriveError):
    """The device has refused, with an abort code."""

    def __init__(self, label, code, index=None, sub=None, do=None):
        meaning, usual = ABORTS.get(code, ("abort code that CiA 301 does not know", "report it"))
        super().__init__(f"{label}: {meaning} ({code >> 16:04X} {code & 0xFFFF:04X}h)", do or usual)
        self.label, self.code, self.index, self.sub = label, code, index, sub

    def as_dict(self):
        return {**super().as_dict(), "object": self.label, "abort": self.code, "index": self.index, "sub": self.sub}


class NotInImage(Refused):
    """An object that this tool knows and the device does not have: it belongs to methods that its image lacks."""

    CODES = (0x06020000, 0x06090011)

    def __init__(self, label, code, index, sub):
        super().__init__(label, code, index, sub, "flash an image that has the method, or a firmware of this version: "
                                                  "`pmdrive info` tells which it is")
        self.text = f"{label}: not in this image ({code >> 16:04X} {code & 0xFFFF:04X}h)"
        self.args = (f"{self.text}\n  {self.do}",)


class NoAnswer(PmdriveError):
    """Nothing comes back."""

    def __init__(self, node_id, label=""):
        what = f" to {label}" if label else ""
        super().__init__(f"node {node_id} does not answer{what}",
                         "is it powered, and has it this node id? `pmdrive scan` looks for all; check bit rate and cable")


class Disturbed(PmdriveError):
    """Answers come, but to what others have asked."""

    def __init__(self, label):
        super().__init__(f"{label}: the answers that come are to somebody else's questions",
                         "another program talks to this node: end it, or use `pmdrive shell` for both")


class BusError(PmdriveError):
    """The adapter or interface."""


class FaultError(PmdriveError):
    """The drive is in a fault, or has gone into one."""


class NotDone(PmdriveError):
    """The device has not done in time what was asked."""
