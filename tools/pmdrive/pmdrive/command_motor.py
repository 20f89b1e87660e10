"""The motor: running it, looking at it, what went wrong."""
import argparse
import sys
import time

from . import attend, motion, names
from . import trace as scope
from . import watch as live
from .drive import error_text
from .output import as_json, check_file, show, shown


MOST_S = 1e6  # to wait for something
TARGETS = {"speed": "target_velocity", "torque": "target_torque", "current": "target_current", "duty": "target_duty"}


def _seconds(text):
    value = float(text)
    if not 0 <= value <= MOST_S:
        raise argparse.ArgumentTypeError(f"{text} s is not 0 to {MOST_S:g} s")
    return value


def add(command):
    sub = command("run", "run the motor while a time lasts or a key is held", run)
    sub.add_argument("mode", choices=tuple(TARGETS))
    sub.add_argument("target", help="300rpm, 20rad/s; 50%% of rated torque; 2A (turning at --speed); 30%% of v_dc")
    sub.add_argument("--speed", default="0", help="of the vector in current mode")
    sub.add_argument("--for", dest="seconds", type=float, help="seconds; without it the space bar must be held")
    command("stop", "switch the bridge off now", stop)
    sub = command("monitor", "live values", monitor)
    sub.add_argument("names", nargs="*", help="objects or records")
    sub.add_argument("--interval", type=_seconds, default=0.2, help="seconds (%(default)s)")
    sub.add_argument("--count", type=int, default=0, help="end after so many (0: at Ctrl-C)")
    sub = command("watch", "live values, drawn in the terminal, and as a picture at the end", watch)
    sub.add_argument("names", nargs="*", help="objects or records (velocity_actual i_q dc_link_voltage)")
    sub.add_argument("--interval", type=_seconds, default=0.1, help="seconds (%(default)s)")
    sub.add_argument("--for", dest="seconds", type=_seconds, help="seconds (until Ctrl-C)")
    sub.add_argument("--out", help="picture: .png, .svg or .pdf")
    sub = command("trace", "record signals as an oscilloscope does", trace)
    sub.add_argument("signals", nargs="+", help="objects marked t in docs/object-dictionary.md")
    sub.add_argument("--divider", type=int, default=1, help="control periods per sample (%(default)s)")
    sub.add_argument("--pre", type=float, default=0.1, help="share before the trigger (%(default)s)")
    sub.add_argument("--trigger", help="signal that triggers (at once)")
    sub.add_argument("--level", help="with a unit if you like")
    sub.add_argument("--edge", default="rising", choices=tuple(scope.EDGES), help="%(choices)s (%(default)s)")
    sub.add_argument("--wait", type=_seconds, default=10.0, help="seconds (%(default)s)")
    sub.add_argument("--out", default="trace.csv", help=".csv, .png or .mf4 (%(default)s)")
    sub = command("faults", "the latched fault, its record, and the history", faults)
    sub.add_argument("--clear", action="store_true", help="clear the fault")


def run(arguments, drive, out):
    entry, speed = names.find(TARGETS[arguments.mode]), names.find("target_velocity")
    raw = entry.parse(arguments.target)
    entry.check(raw)
    numbers = {arguments.mode: raw}
    if arguments.mode == "current":
        numbers["speed"] = speed.parse(arguments.speed)
        speed.check(numbers["speed"])
    attention = attend.attention(arguments.seconds)
    with attention, motion.Motion(drive, arguments.mode, **numbers) as running:
        entries = [names.find(name) for name in ("velocity_actual", "i_d", "i_q", "drive_limits")]
        last, limits, met = "", entries[-1], set()
        while attention.lasts():
            running.check_fault()
            values = {e: drive.read(e) for e in entries}
            met.update(limits.flags(values[limits]))
            last = "  ".join(f"{e.name} {shown(e, raw)}" for e, raw in values.items())
            out.data(as_json(values))
            out.progress(last)
    out.line(last)
    if met:
        out.line(f"the motor did not always follow, it was limited by: {', '.join(sorted(met))}")
    out.line(f"stopped: {drive.state()}")


def stop(_, drive, out):
    motion.switch_off(drive)
    out.data({"state": drive.state()})
    out.line(f"the bridge is off: {drive.state()}")


def trace(arguments, drive, out):
    path = arguments.out
    scope.check_path(path)
    check_file(path)
    entries = scope.set_up(drive, arguments.signals, arguments.divider, arguments.pre, arguments.trigger,
                           arguments.level, arguments.edge)
    scope.record(drive, arguments.wait, out.progress)
    recording = scope.fetch(drive, entries)
    recording.write(path)
    out.data({"file": path, "samples": len(recording.time_s), "signals": [e.name for e in entries]})
    out.line(f"wrote {path}: {len(recording.time_s)} samples of {', '.join(e.name for e in entries)}")


MONITORED = ("drive_state", "velocity_actual", "i_d", "i_q", "dc_link_voltage", "temperature", "quality", "weight")


ESTIMATED = ("theta", "omega_e", "velocity_actual", "torque_actual", "quality", "weight")  # zero while the bridge is off
WITHOUT_ESTIMATE = (0, 1, 5)  # states of the drive: off, calibrating, fault


def _width(entry):
    """That the values of a column want."""
    texts = [entry.name, *(entry.text(raw) for raw in entry.values), shown(entry, -123456) if entry.unit == "rad/s" else ""]
    return max(16, *map(len, texts))


def monitor(arguments, drive, out):
    entries = names.select(arguments.names or MONITORED)
    widths = {entry: _width(entry) for entry in entries}
    estimated = [entry for entry in entries if entry.name in ESTIMATED]
    out.line("  ".join(f"{entry.name:>{width}s}" for entry, width in widths.items()))
    count = 0
    while True:
        values = {entry: drive.read(entry) for entry in entries}
        unknown = estimated if estimated and drive.read("drive_state") in WITHOUT_ESTIMATE else ()
        out.data(as_json(values))
        out.line("  ".join(f"{'-' if entry in unknown else shown(entry, raw):>{widths[entry]}s}"
                           for entry, raw in values.items()))
        count += 1
        if count == arguments.count:
            return
        time.sleep(arguments.interval)


WATCHED = ("velocity_actual", "i_q", "dc_link_voltage")


def watch(arguments, drive, out):
    """In a terminal as curves, else as lines."""
    live.check_path(arguments.out)
    check_file(arguments.out)
    history = live.History(names.select(arguments.names or WATCHED))
    terminal = live.Terminal() if sys.stdout.isatty() and not out.as_json else None
    end = time.monotonic() + (arguments.seconds if arguments.seconds is not None else float("inf"))
    try:
        while time.monotonic() < end:
            values = history.read(drive)
            out.data(as_json(values))
            if terminal:
                terminal.draw(history)
            else:
                out.line("  ".join(f"{entry.name} {shown(entry, raw)}" for entry, raw in values.items()))
            time.sleep(arguments.interval)
    except KeyboardInterrupt:
        pass  # that is how it ends
    if arguments.out and history.time_s:
        live.picture(history, arguments.out)
        out.line(f"wrote {arguments.out}")


def faults(arguments, drive, out):
    if arguments.clear:
        drive.clear_fault()
    found = drive.faults()
    fault = found["fault"]
    out.data({"fault": fault.text if fault else None, "do": fault.do if fault else None, "code": found["code"],
              "record": as_json(found["record"]), "history": found["history"]})
    out.line(f"fault: {fault.text}\n  {fault.do}" if fault else f"fault: {found['code'] or 'none'}")
    if found["record"][names.find("fault_record.code")]:
        out.line("when the first fault came:")
        for entry, raw in found["record"].items():
            out.line(f"  {entry.name.split('.')[-1]:15s} {shown(entry, raw)}")
    for word in found["history"]:
        out.line(f"error {word & 0xFFFF:04X}h  {error_text(word)}")
