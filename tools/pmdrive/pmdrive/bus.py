"""The way to the bus: adapters and interfaces by a short text, and who is there."""
import socket
import time

import can
import canopen

from .drive import Drive
from .errors import BusError, NotDone, UsageError

CONNECT_S = 3.0
KINDS = "can0, vcan0 (SocketCAN); socketcand:HOST:PORT[:CHANNEL]; slcan:DEVICE; or INTERFACE:CHANNEL of python-can"


def arguments(spec, bitrate):
    """Of can.Bus, for a text like `can0`, `socketcand:host:port`, `slcan:/dev/ttyACM0`."""
    kind, _, rest = spec.partition(":")
    if not kind or (":" in spec and not rest):
        raise UsageError(f"`{spec}` is no CAN interface", f"one of: {KINDS}")
    if not rest:
        return {"interface": "socketcan", "channel": kind}
    if kind == "socketcand":
        parts = rest.split(":")
        if len(parts) not in (2, 3) or not parts[1].isdigit():
            raise UsageError(f"`{spec}` is no CAN interface", "socketcand:HOST:PORT[:CHANNEL]")
        return {"interface": kind, "host": parts[0], "port": int(parts[1]),
                "channel": parts[2] if len(parts) == 3 else "can0"}
    if kind in ("virtual", "udp_multicast"):
        return {"interface": kind, "channel": rest}
    return {"interface": kind, "channel": rest, "bitrate": bitrate}


def open_network(spec, bitrate=500000):
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.05  # closing waits for it
    usual = socket.getdefaulttimeout()
    if spec.startswith("socketcand"):
        socket.setdefaulttimeout(CONNECT_S)  # of its greeting
    try:
        network.connect(**arguments(spec, bitrate))
    except (can.CanError, OSError, ValueError, ImportError) as error:
        do = ("does `pmsim node` or another server listen there? It takes one client at a time" if spec.startswith("socketcand")
              else f"is the adapter plugged in and the interface up (`ip link`)? It may be: {KINDS}")
        raise BusError(f"cannot open {spec}: {error}", do) from None
    finally:
        socket.setdefaulttimeout(usual)
    return network


def connect(spec, node=1, bitrate=500000):
    """A Drive, to be closed, or used with `with`."""
    if not 1 <= node <= 127:
        raise UsageError(f"node id {node} is not 1 to 127")
    return Drive(open_network(spec, bitrate), node)


BIT_TIMINGS = {1000: 0, 500: 2, 250: 3, 125: 4}  # CiA 305, table 0: kbit/s


def configure_alone(spec, bitrate, wanted):
    """Node id and bit rate of the only device on the bus by LSS (CiA 305), kept; the device then restarts with them."""
    network = open_network(spec, bitrate)
    try:
        lss = network.lss
        lss.send_switch_state_global(lss.CONFIGURATION_STATE)
        if "can_node_id" in wanted:
            lss.configure_node_id(wanted["can_node_id"])
        if "can_bit_rate" in wanted:
            lss.configure_bit_timing(BIT_TIMINGS[wanted["can_bit_rate"]])
        lss.store_configuration()
        lss.send_switch_state_global(lss.WAITING_STATE)
        network.send_message(0, bytes([129, 0]))
    except canopen.lss.LssError as error:
        raise NotDone(f"the device does not take it: {error}", "one drive alone on the bus, its bridge off? cable, bit rate and power"
                      ) from None
    except can.CanError as error:
        raise BusError(f"cannot send on {spec}: {error}", "nobody acknowledges: check cable, bit rate and power") from None
    finally:
        network.disconnect()


def scan(spec, bitrate=500000, seconds=1.0, progress=None):
    """Node ids that answer, in order, by asking all of them for object 1000h."""
    network = open_network(spec, bitrate)
    try:
        for first in range(1, 128, 16):
            for node in range(first, min(first + 16, 128)):
                network.send_message(0x600 + node, b"\x40\x00\x10\x00\x00\x00\x00\x00")
            time.sleep(seconds / 16)
            if progress:
                progress(first, 127)
        time.sleep(seconds / 2)
        return sorted(network.scanner.nodes)
    except can.CanError as error:
        raise BusError(f"cannot send on {spec}: {error}", "nobody acknowledges: check cable, bit rate and power"
                       ) from None
    finally:
        network.disconnect()
