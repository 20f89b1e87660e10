"""Tunes the pmdrive sensorless motor drive over CAN.

    import pmdrive
    with pmdrive.connect("can0", node=1) as drive:
        drive.set("R_s", "6.2 ohm")
        print(drive.get("velocity_actual"))
        drive.save()

The command line, `pmdrive`, does nothing that this cannot.
"""
from .bus import connect, scan
from .drive import Drive
from .errors import (BusError, FaultError, NoAnswer, NotDone, PmdriveError, Refused, UsageError, ValueRefused)

VERSION = "1.0"

__all__ = ["connect", "scan", "Drive", "PmdriveError", "BusError", "FaultError", "NoAnswer", "NotDone", "Refused",
           "UsageError", "ValueRefused"]
