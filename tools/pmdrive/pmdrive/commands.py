"""What the commands do and show: (arguments, drive, output)."""
import json
import sys
import time
from pathlib import Path

from . import attend, bus, dictionary, files, flash, identify, motion, names, tune
from . import trace as scope
from .drive import error_text, fault_text, state_of
from .errors import NoAnswer, NotDone, UsageError


class Output:
    """Lines for people, or one JSON object per answer for programs; progress goes to a terminal only."""

    def __init__(self, as_json, stream=None):
        self.as_json, self.stream = as_json, stream or sys.stdout

    def line(self, text=""):
        if not self.as_json:
            print(text, file=self.stream)

    def data(self, data):
        if self.as_json:
            print(json.dumps(data), file=self.stream, flush=True)

    def progress(self, *what):
        if not self.as_json and sys.stderr.isatty():
            text = f"{what[0]}/{what[1]}" if len(what) == 2 else str(what[0])
            print(f"\r{text:40s}\r", end="", file=sys.stderr, flush=True)


def plain(entry, raw):
    """For JSON: a number in the entry's unit, text as it is, bytes in hexadecimal."""
    if not entry.number:
        return raw if isinstance(raw, str) else raw.hex()
    value = entry.physical(raw)
    return int(value) if value == int(value) else float(value)


def as_json(values):
    return {entry.name: {"value": plain(entry, raw), "unit": entry.unit, "raw": raw if entry.number else None}
            for entry, raw in values.items()}


def shown(entry, raw):
    """With what a code means."""
    if entry.name in ("drive_fault", "fault_record.code"):
        return f"{raw} ({fault_text(raw)})"
    if entry.name == "error_code":
        return f"{raw:04X}h ({error_text(raw) if raw else 'none'})"
    return entry.text(raw)


def show(out, values):
    out.data(as_json(values))
    width = max((len(entry.name) for entry in values), default=0)
    for entry, raw in values.items():
        out.line(f"{entry.name:{width}s}  {shown(entry, raw)}")


def list_names(arguments, _, out):
    parts = [text.lower() for text in arguments.names if text not in names.RECORDS]
    found = [e for e in dictionary.ENTRIES
             if not arguments.names or e.record in arguments.names or any(text in e.name.lower() for text in parts)]
    if not found:
        raise UsageError(f"no name has `{'` or `'.join(arguments.names)}` in it", "`pmdrive list` shows all names")
    if out.as_json:
        describe(found, out)
        return
    record = None
    for e in found:
        if e.record != record:
            record = e.record
            out.line(f"{e.where.split(':')[0]} {record}")
        limits = f"{e.text(e.least)} to {e.text(e.most)}" if e.least is not None else e.unit
        out.line(f"  {e.name:28s} {e.access:6s} {limits:32s} {e.help}")


def scan(arguments, _, out):
    found = bus.scan(arguments.can, arguments.bitrate, progress=out.progress)
    out.data({"nodes": found})
    out.line("\n".join(f"node {node}" for node in found) if found else "nobody answers: check bit rate, cable and power")


def info(arguments, drive, out):
    if arguments.names:
        describe(names.select(arguments.names), out)
        return
    values = {names.find(name): raw for name, raw in drive.info().items()}
    show(out, values)
    out.line(f"state of CiA 402  {state_of(drive.read('statusword'))}")


def describe(entries, out):
    for e in entries:
        out.data({"name": e.name, "index": e.index, "sub": e.sub, "type": e.type, "access": e.access, "unit": e.unit,
                  "scale": float(e.scale), "least": e.least, "most": e.most, "default": e.preset, "help": e.help,
                  "book": e.book, "values": e.values})
        out.line(f"{e.label}  {e.type}, {e.access}")
        out.line(f"  {e.help}")
        if e.least is not None:
            out.line(f"  {e.text(e.least)} to {e.text(e.most)}")
        if e.preset is not None and e.number:
            out.line(f"  default {e.text(e.preset)}{' + node id' if e.node_id else ''}")
        for raw, text in e.values.items():
            out.line(f"  {raw}: {text}")
        if e.book:
            out.line(f"  book {e.book.replace('#', 'row ')}")


def get(arguments, drive, out):
    show(out, {entry: drive.read(entry) for entry in names.select(arguments.names)})


def set_values(arguments, drive, out):
    """All are understood before the first is sent."""
    wanted = {}
    for text in arguments.assignments:
        name, equals, value = text.partition("=")
        if not equals:
            raise UsageError(f"`{text}` is not NAME=VALUE")
        entry = names.find(name.strip())
        raw = entry.parse(value)
        entry.check(raw)
        wanted[entry] = raw
    for entry, raw in wanted.items():
        drive.write(entry, raw)
    show(out, {entry: drive.read(entry) for entry in wanted})
    _hint(wanted, drive, out)


READY_HINTS = {1: "`pmdrive save`, before it may be switched on",
               2: "the drive refuses them as they are: `pmdrive get parameter_refused`",
               3: "the hardware runs with the old ones: `pmdrive save`, then `pmdrive reset`",
               4: "a batch is open: `pmdrive set parameter_batch=0`"}


def _hint(written, drive, out):
    """What is still to be done before the drive may be switched on with these values."""
    if any(entry.record in names.DRIVE_RECORDS for entry in written):
        ready = drive.read("parameters_ready")
        if ready:
            out.line(READY_HINTS.get(ready, names.find("parameters_ready").text(ready)))


def _write(path, text, out):
    if path:
        Path(path).write_text(text, encoding="utf-8")
        out.line(f"wrote {path}")
    else:
        out.stream.write(text)


def dump(arguments, drive, out):
    entries = names.select(arguments.names) if arguments.names else names.stored()
    values = drive.dump([e for e in entries if e.number and e.writable], out.progress)
    if out.as_json:
        out.data(as_json(values))
    else:
        _write(arguments.out, files.render(values, f"pmdrive node {drive.node_id}"), out)


def _defaults(drive):
    return {e: e.preset + (drive.node_id if e.node_id else 0) for e in names.stored()}


def show_changes(changes, out, words=("here", "there")):
    out.data([{"name": e.name, words[0]: plain(e, here), words[1]: plain(e, there), "unit": e.unit}
              for e, here, there in changes])
    for entry, here, there in changes:
        out.line(f"{entry.name:26s} {entry.text(here):>20s} -> {entry.text(there)}")


def diff(arguments, drive, out):
    values = files.read(arguments.file) if arguments.file else _defaults(drive)
    changes = drive.diff(values, out.progress)
    show_changes(changes, out, ("drive", "file" if arguments.file else "default"))
    if not changes:
        out.line("no difference")


def load(arguments, drive, out):
    values = files.read(arguments.file)
    changes = drive.load(values, dry_run=True)
    show_changes(changes, out, ("before", "after"))
    if not changes:
        out.line("nothing to change")
        return
    if arguments.dry_run:
        return
    if not (arguments.yes or out.as_json) and not attend.confirm(f"write these {len(changes)} values?"):
        raise NotDone("nothing was written")
    drive.load(values, progress=out.progress)
    out.line(f"{len(changes)} values written and read back; `pmdrive save` keeps them over a reset")
    _hint([entry for entry, _, _ in changes], drive, out)


def _take(arguments, drive, out, values, what):
    """Shows what would change, asks, writes, reads back. Whether anything was written."""
    changes = drive.load(values, dry_run=True)
    show_changes(changes, out, ("before", "after"))
    if not changes:
        out.line(f"{what}: nothing to change")
        return False
    if not (arguments.yes or out.as_json) and not attend.confirm(f"write these {len(changes)} values?"):
        raise NotDone("nothing was written")
    drive.load(values)
    out.line(f"{len(changes)} values written and read back")
    return True


def _name_plate(arguments, drive, out):
    given = (arguments.rated_current, arguments.pole_pairs, arguments.max_speed, arguments.dc_link)
    if all(value is None for value in given):
        return
    if any(value is None for value in given):
        raise UsageError("a name plate has all four", "--rated-current --pole-pairs --max-speed --dc-link")
    numbers = [float(names.find(name).physical(names.find(name).parse(text)))
               for name, text in zip(("i_rated", "pole_pairs", "speed_max", "v_dc_nominal"), given)]
    current, pole_pairs, speed, dc_link = numbers
    out.line("to begin with, from the name plate; what is not written there is a guess:")
    values = identify.name_plate(drive, current, int(pole_pairs), speed, dc_link)
    if _take(arguments, drive, out, values, "name plate") and drive.read("parameters_ready") in (1, 3):
        drive.save()  # over-current comparators take their level at the start
        drive.reset()


def _entry_or_zero(name, text):
    return 0 if text is None else names.find(name).parse(text)


def identify_machine(arguments, drive, out):
    wanted = identify.routines(arguments.only)
    current = _entry_or_zero("target_current", arguments.current)
    speed = _entry_or_zero("target_velocity", arguments.speed)
    turning = "turns" if {"flux", "mechanics"} & set(wanted) else "moves"
    if not (arguments.yes or out.as_json) and not attend.confirm(
            f"THE MOTOR {turning.upper()} for some 15 s, with its rated current. Is it free to?"):
        raise NotDone("nothing was done")
    _name_plate(arguments, drive, out)
    found = identify.run(drive, wanted, current, speed, out.progress)
    for group in found.values():
        show(out, {names.find(f"identification.{name}"): raw for name, raw in group.items()})
    if _take(arguments, drive, out, identify.parameters(drive, found), "identification"):
        out.line("next: `pmdrive tune`, then `pmdrive save`")


def tune_controllers(arguments, drive, out):
    bandwidth = arguments.bandwidth
    if _take(arguments, drive, out, tune.changes(drive, bandwidth), "tuning"):
        out.line("`pmdrive save` keeps them over a reset")


def save(arguments, drive, out):
    drive.save(arguments.group)
    out.data({"saved": arguments.group})
    out.line(f"kept: {arguments.group}")


def restore(arguments, drive, out):
    drive.restore(arguments.group)
    out.data({"restored": arguments.group})
    out.line(f"defaults of {arguments.group}, after `pmdrive reset`")


def reset(arguments, drive, out):
    drive.reset(arguments.communication)
    out.data({"reset": True})
    out.line("it is back")


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
            out.line(f"  {entry.name.split('.')[-1]:12s} {shown(entry, raw)}")
    for word in found["history"]:
        out.line(f"error {word & 0xFFFF:04X}h  {error_text(word)}")


MONITORED = ("drive_state", "velocity_actual", "i_d", "i_q", "dc_link_voltage", "temperature", "quality", "weight")


def monitor(arguments, drive, out):
    entries = names.select(arguments.names or MONITORED)
    out.line("  ".join(f"{e.name:>16s}" for e in entries))
    count = 0
    while True:
        values = {entry: drive.read(entry) for entry in entries}
        out.data(as_json(values))
        out.line("  ".join(f"{shown(entry, raw):>16s}" for entry, raw in values.items()))
        count += 1
        if count == arguments.count:
            return
        time.sleep(arguments.interval)


def run(arguments, drive, out):
    target = {"speed": "target_velocity", "torque": "target_torque", "current": "target_current"}[arguments.mode]
    entry, speed = names.find(target), names.find("target_velocity")
    raw = entry.parse(arguments.target)
    entry.check(raw)
    numbers = {arguments.mode: raw}
    if arguments.mode == "current":
        numbers["speed"] = speed.parse(arguments.speed)
        speed.check(numbers["speed"])
    attention = attend.attention(arguments.seconds)
    with attention, motion.Motion(drive, arguments.mode, **numbers) as running:
        entries = [names.find(name) for name in ("velocity_actual", "i_d", "i_q", "drive_limits")]
        last = ""
        while attention.lasts():
            running.check_fault()
            values = {e: drive.read(e) for e in entries}
            last = "  ".join(f"{e.name} {e.text(raw)}" for e, raw in values.items())
            out.data(as_json(values))
            out.progress(last)
    out.line(last)
    out.line(f"stopped: {drive.state()}")


def stop(_, drive, out):
    motion.switch_off(drive)
    out.data({"state": drive.state()})
    out.line(f"the bridge is off: {drive.state()}")


def trace(arguments, drive, out):
    path = arguments.out
    scope.check_path(path)
    entries = scope.set_up(drive, arguments.signals, arguments.divider, arguments.pre, arguments.trigger,
                           arguments.level, arguments.edge)
    scope.record(drive, arguments.wait, out.progress)
    recording = scope.fetch(drive, entries)
    recording.write(path)
    out.data({"file": path, "samples": len(recording.time_s), "signals": [e.name for e in entries]})
    out.line(f"wrote {path}: {len(recording.time_s)} samples of {', '.join(e.name for e in entries)}")


def _must_be_off(drive):
    """A drive that does not answer may be empty: it can be written."""
    try:
        if drive.state() in ("operation enabled", "quick stop active"):
            raise NotDone("the motor runs: nothing was written", "`pmdrive stop`")
    except NoAnswer:
        pass


def _verify(arguments, drive, out):
    """Whether the node runs what was written: the data sheet that it holds is in the image as it stands."""
    drive.await_answer()
    wanted = ("device_name", "hardware_version", "software_version", "identity.revision", "parameters_ready")
    values = {names.find(name): drive.read(name) for name in wanted}
    show(out, values)
    if arguments.image and drive.read("stored_eds") not in Path(arguments.image).read_bytes():
        raise NotDone(f"node {drive.node_id} does not run {arguments.image}: its data sheet is another",
                      "is it the board that was written? `pmdrive scan`")
    out.line(f"node {drive.node_id} runs it")


def flash_board(arguments, drive, out):
    if drive is not None and not arguments.dry_run:
        _must_be_off(drive)
    try:
        flash.write(arguments, out.line)
    except flash.FlashError as error:
        raise (UsageError if error.status == flash.USAGE else NotDone)(error.text, error.do) from None
    if arguments.dry_run:
        out.data({"command": flash.command(arguments)})
    elif drive is not None:
        _verify(arguments, drive, out)
    else:
        out.data({"written": arguments.image or arguments.parameters})
        out.line("written and verified; with --can, the drive is asked on the bus whether it runs")


def eds(arguments, drive, out):
    _write(arguments.out, scope.data_sheet(drive), out)


def shell(arguments, drive, out):
    from .shell import Shell

    Shell(arguments, drive).cmdloop()


def completion(_, __, out):
    from .completion import script

    out.stream.write(script())
