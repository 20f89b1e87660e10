"""Single values: their names and meaning, reading, writing."""
from . import dictionary, names
from .drive import state_of
from .errors import UsageError
from .output import show


def add(command):
    sub = command("info", "what the drive is and how it does; with names: what they mean", info, connects=None)
    sub.add_argument("names", nargs="*", help="objects or records")
    sub = command("list", "the names of objects, with range and meaning", list_names, connects=False)
    sub.add_argument("names", nargs="*", help="records or parts of names (all)")
    sub = command("get", "read values", get)
    sub.add_argument("names", nargs="+", help="objects or records, by name or index:sub")
    sub = command("set", "write values, the drive's parameters all together", set_values)
    sub.add_argument("assignments", nargs="+", metavar="NAME=VALUE", help="with a unit if you like: R_s=6200mohm")


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


def get(arguments, drive, out):
    show(out, {entry: drive.read(entry) for entry in names.select(arguments.names)})


def set_values(arguments, drive, out):
    """All are understood before the first is sent; parameters of the drive are checked by it together."""
    wanted = {}
    for text in arguments.assignments:
        name, equals, value = text.partition("=")
        if not equals:
            raise UsageError(f"`{text}` is not NAME=VALUE")
        entry = names.find(name.strip())
        if entry in wanted:
            raise UsageError(f"{entry.name} is set twice")
        raw = entry.parse(value)
        entry.check(raw)
        wanted[entry] = raw
    if len(wanted) > 1 and all(entry.record in names.DRIVE_RECORDS for entry in wanted):
        drive.load(wanted)
    else:
        for entry, raw in wanted.items():
            drive.write(entry, raw)
    show(out, {entry: drive.read(entry) for entry in wanted})
    hint(wanted, drive, out)


READY_HINTS = {1: "`pmdrive save`, before it may be switched on",
               2: "the drive refuses them as they are: `pmdrive get parameter_refused`",
               3: "the hardware runs with the old ones: `pmdrive save`, then `pmdrive reset`",
               4: "a batch is open: `pmdrive set parameter_batch=0`",
               5: "mode duty is of block commutation: `pmdrive set commutation=1`"}


def hint(written, drive, out):
    """What is still to be done before the drive may be switched on with these values."""
    if any(entry.record in names.DRIVE_RECORDS for entry in written):
        ready = drive.read("parameters_ready")
        if ready:
            out.line(READY_HINTS.get(ready, names.find("parameters_ready").text(ready)))
