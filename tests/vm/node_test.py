"""A live node on a real SocketCAN bus and with real GPIO lines: whatever comes over the bus or not, it runs on or goes
off within its timeout; the lines hold its bridge off.

usage: tests/vm/run python3 tests/vm/node_test.py PMSIM [TEST...]
"""

import contextlib
import os
import pathlib
import random
import re
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from node_bus import ERROR, EXTENDED, REMOTE_REQUEST, Master, Node, Remote, VirtualBus  # noqa: E402

PMSIM = sys.argv[1]
BUS = "vcan0"
SPEED_RAD_S = 60.0
# Two looks at the lines and the bus, and the control period between them.
SLICE_S = 0.002
# The last command before a cut is 20 ms old; more where threads have to wait, or the node is late.
TIMEOUT_SLACK_S = 0.2

CHIP, LINES = os.environ.get("GPIOSIM_CHIP"), os.environ.get("GPIOSIM_LINES")
ENABLE_LINE, FAULT_LINE = 0, 1


def pull(line, up):
    pathlib.Path(LINES, f"sim_gpio{line}", "pull").write_text("pull-up" if up else "pull-down", encoding="ascii")


@contextlib.contextmanager
def node_and_master(*options):
    node = Node(PMSIM, BUS, *options)
    master = Master(VirtualBus(BUS, Remote.STATUS))
    try:
        yield node, master
    except BaseException:
        print(node.text(), flush=True)
        raise
    finally:
        master.close()
        code = node.stop()
    assert code == 0, f"exit code {code}\n{node.text()}"


def start(node, master):
    master.say(True, SPEED_RAD_S)
    node.time_of("running$")


def expect_only(node, mark, *allowed):
    """Nothing but these lines has come since."""
    odd = [line for line in node.since(mark) if not any(re.fullmatch(one, line) for one in allowed)]
    assert not odd, f"unexpected: {odd}\n{node.text()}"


LATE = r"(pmsim node: at .* behind real time, going on from here)?"


def runs_and_stops():
    with node_and_master() as (node, master):
        start(node, master)
        master.wait_for("running")
        time.sleep(1.0)
        master.say(False)
        node.time_of("off$")
    assert "lost" not in node.lines[-2] and " 0 frames taken" not in node.lines[-2], node.text()


def enable_line_holds_the_bridge_off():
    pull(ENABLE_LINE, False)
    with node_and_master("--gpio-enable", f"{CHIP}:{ENABLE_LINE}") as (node, master):
        node.time_of("bridge held off: enable line off")
        mark = len(node.lines)
        master.say(True, SPEED_RAD_S)
        master.wait_for("fault")
        time.sleep(0.5)
        expect_only(node, mark, "off", "fault HARDWARE", LATE)

        pull(ENABLE_LINE, True)
        node.time_of("bridge released by the lines")
        time.sleep(0.3)
        assert master.state == "fault", "started by itself"
        master.clear()
        start(node, master)
        time.sleep(0.5)
        pull(ENABLE_LINE, False)
        held_s = node.time_of("bridge held off: enable line off")
        fault_s = node.time_of("fault HARDWARE")
        assert fault_s - held_s <= SLICE_S, (held_s, fault_s)


def active_low_enable_line():
    pull(ENABLE_LINE, False)
    with node_and_master("--gpio-enable", f"{CHIP}:{ENABLE_LINE}!") as (node, master):
        start(node, master)
        pull(ENABLE_LINE, True)
        node.time_of("bridge held off: enable line off")
        node.time_of("fault HARDWARE")
    pull(ENABLE_LINE, False)


def fault_line_latches():
    pull(ENABLE_LINE, True)
    pull(FAULT_LINE, False)
    options = ("--gpio-enable", f"{CHIP}:{ENABLE_LINE}", "--gpio-fault", f"{CHIP}:{FAULT_LINE}")
    with node_and_master(*options) as (node, master):
        start(node, master)
        pull(FAULT_LINE, True)  # a pulse that is over before anybody looks
        pull(FAULT_LINE, False)
        held_s = node.time_of("bridge held off: fault line")
        assert node.time_of("fault HARDWARE") - held_s <= SLICE_S
        mark = len(node.lines)
        master.say(False, clear=True)
        time.sleep(0.5)
        assert master.state == "fault", "cleared while the line held the bridge"
        expect_only(node, mark, LATE)

        pull(ENABLE_LINE, False)
        node.time_of("bridge held off: enable line off")
        pull(ENABLE_LINE, True)
        node.time_of("bridge released by the lines")
        master.clear()
        start(node, master)

        pull(FAULT_LINE, True)
        node.time_of("bridge held off: fault line")
        pull(ENABLE_LINE, False)  # does not help while the fault is there
        node.time_of("bridge held off: enable line off")
        pull(ENABLE_LINE, True)
        node.time_of("bridge held off: fault line")
        pull(FAULT_LINE, False)


def fault_line_that_is_active_at_the_start():
    pull(FAULT_LINE, True)
    with node_and_master("--gpio-fault", f"{CHIP}:{FAULT_LINE}") as (node, _):
        node.time_of("bridge held off: fault line")
        node.time_of("fault HARDWARE")
        mark = len(node.lines)
        pull(FAULT_LINE, False)
        time.sleep(0.3)
        expect_only(node, mark, LATE)  # for good, without an enable line
    pull(FAULT_LINE, False)


def a_taken_line_is_refused():
    with node_and_master("--gpio-enable", f"{CHIP}:{ENABLE_LINE}"):
        second = subprocess.run([PMSIM, "node", "tests/scenario/node.yaml", "--can", BUS, "--gpio-enable",
                                 f"{CHIP}:{ENABLE_LINE}"], capture_output=True, text=True, check=False, timeout=60)
        assert second.returncode == 2 and "busy" in second.stderr, second


def cut(for_s):
    subprocess.run(["ip", "link", "set", BUS, "down"], check=True)
    time.sleep(for_s)
    subprocess.run(["ip", "link", "set", BUS, "up"], check=True)


def a_cut_cable():
    with node_and_master() as (node, master):
        start(node, master)
        time.sleep(0.5)
        mark = len(node.lines)
        cut(0.6 * Remote.TIMEOUT_S)
        time.sleep(2 * Remote.TIMEOUT_S)
        expect_only(node, mark, LATE)
        assert master.state == "running"

        master.clear()
        start(node, master)
        time.sleep(0.5)
        mark = len(node.lines)
        subprocess.run(["ip", "link", "set", BUS, "down"], check=True)
        cut_s = node.now_s()
        passed_s = node.time_of("fault REMOTE_LOST") - cut_s
        time.sleep(1.0)
        subprocess.run(["ip", "link", "set", BUS, "up"], check=True)
        assert abs(passed_s - Remote.TIMEOUT_S) < TIMEOUT_SLACK_S, passed_s
        time.sleep(1.0)  # the cable is back, and with it the command to run
        expect_only(node, mark, "fault REMOTE_LOST", LATE)
        assert master.state == "fault", "started by itself"
        master.clear()
        start(node, master)


def bus_off():
    """A virtual bus has no controller; the frame by which its driver would tell is sent by us."""
    off, restarted = ERROR | 0x40, ERROR | 0x100
    with node_and_master() as (node, master):
        start(node, master)
        mark = len(node.lines)
        other = VirtualBus(BUS)
        master.silent = True  # bus-off is told to all, and traffic would end it
        time.sleep(0.1)
        other.send(off, bytes(8))
        off_s = node.time_of("bus off")
        assert node.time_of("fault REMOTE_LOST") - off_s <= SLICE_S
        other.send(restarted, bytes(8))
        node.time_of("bus active")
        master.silent = False
        master.say(True, SPEED_RAD_S)
        master.wait_for("fault")  # told once the node is started again: 1029h
        time.sleep(0.5)
        expect_only(node, mark, "bus off", "fault REMOTE_LOST", "bus active", LATE)
        assert master.state == "fault", "started by itself"
        master.clear()
        start(node, master)


def any_frame(source):
    """Of any kind and content, but no command and no error frame of the controller."""
    while True:
        kind = source.choice((0, 0, 0, EXTENDED, REMOTE_REQUEST))
        identifier = source.getrandbits(29 if kind == EXTENDED else 11)
        if source.random() < 0.5:
            identifier = source.choice((Remote.COMMAND, Remote.STATUS, Remote.HEARTBEAT))
        data = source.randbytes(source.randint(0, 8))
        if kind != 0 or not Remote.is_command(identifier, data):
            return identifier | kind, data


def garbage():
    source = random.Random(1)
    with node_and_master() as (node, master):
        start(node, master)
        mark = len(node.lines)
        other = VirtualBus(BUS)
        for _ in range(3000):
            other.send(*any_frame(source))
            time.sleep(0.001)
        expect_only(node, mark, LATE)
        # Its status has been sent by others too: what counts is what the node says.
        master.say(False)
        node.time_of("off$")


def babble(seconds, frames_per_ms):
    """The frame that wins every arbitration, at that rate."""
    other = VirtualBus(BUS)
    sent, began = 0, time.monotonic()
    while (passed_s := time.monotonic() - began) < seconds:
        due = 100 if frames_per_ms is None else int(1000.0 * passed_s * frames_per_ms) - sent
        for _ in range(due):
            sent += other.send(0x001, bytes(8))
        if due <= 0:
            time.sleep(0.0005)
    return sent


def babbling_peer_at_full_load():
    """1 Mbit/s: a frame of 8 bytes takes 111 bits and 3 of silence before the next."""
    with node_and_master() as (node, master):
        start(node, master)
        mark = len(node.lines)
        sent = babble(3.0, 1000.0 / 114)
        assert sent > 0.9 * 3000 * 1000 / 114, f"only {sent} frames"
        expect_only(node, mark, LATE)
        master.say(False)
        node.time_of("off$")


def flood_beyond_any_bus():
    with node_and_master() as (node, master):
        start(node, master)
        mark = len(node.lines)
        sent = babble(3.0, None)
        expect_only(node, mark, "fault REMOTE_LOST", LATE)
        off = any("REMOTE_LOST" in line for line in node.since(mark))
        print(f"      {sent / 3:.0f} frames per second: {'went off after its timeout' if off else 'ran on'}")
        time.sleep(1.0)
        master.clear()
        start(node, master)


TESTS = (
    runs_and_stops, enable_line_holds_the_bridge_off, active_low_enable_line, fault_line_latches,
    fault_line_that_is_active_at_the_start, a_taken_line_is_refused, a_cut_cable, bus_off, garbage,
    babbling_peer_at_full_load, flood_beyond_any_bus,
)


def main():
    if CHIP is None:
        sys.exit("no GPIOSIM_CHIP in the environment: tests/vm/run runs this test")
    names = sys.argv[2:] or [test.__name__ for test in TESTS]
    for test in TESTS:
        if test.__name__ in names:
            began = time.monotonic()
            test()
            print(f"PASS  {test.__name__}, {time.monotonic() - began:.1f} s", flush=True)


main()
