"""Sets of values: files, the defaults, and what the drive keeps."""
from . import attend, files, names
from .command_values import hint
from .drive import GROUPS
from .errors import NotDone
from .output import as_json, check_file, show_changes, write_text


def add(command):
    sub = command("dump", "write all stored values as a file", dump)
    sub.add_argument("names", nargs="*", help="only these objects or records")
    sub.add_argument("--out", help="file (standard output)")
    sub = command("load", "set the values of a file, check all together, read back", load)
    sub.add_argument("file", help="`name: value unit` a line, as `dump` writes it; or a machine file, of which `drive:` is read")
    sub.add_argument("--dry-run", action="store_true", help="only show what would change")
    sub.add_argument("--yes", action="store_true", help="do not ask")
    sub = command("diff", "what differs from a file, or from the defaults", diff)
    sub.add_argument("file", nargs="?", help="file as of `load` (the defaults)")
    for name, text, function in (("save", "keep the present values over a reset", save),
                                 ("restore", "have the defaults after the next reset: asks", restore)):
        sub = command(name, text, function)
        sub.add_argument("group", nargs="?", default="all", choices=GROUPS, help="%(choices)s (%(default)s)")
        if function is restore:
            sub.add_argument("--yes", action="store_true", help="do not ask")
    sub = command("reset", "restart the drive", reset)
    sub.add_argument("--communication", action="store_true", help="its communication alone")


def dump(arguments, drive, out):
    check_file(arguments.out)
    entries = names.select(arguments.names) if arguments.names else names.stored()
    values = drive.dump([e for e in entries if e.number and e.writable], out.progress)
    out.data(as_json(values))
    if arguments.out or not out.as_json:
        write_text(arguments.out, files.render(values, f"pmdrive node {drive.node_id}"), out)


def _defaults(drive):
    return {e: e.preset + (drive.node_id if e.node_id else 0) for e in names.stored()}


def diff(arguments, drive, out):
    values = files.read(arguments.file, out.line) if arguments.file else _defaults(drive)
    changes = drive.diff(values, out.progress)
    show_changes(changes, out, ("drive", "file" if arguments.file else "default"))
    if not changes:
        out.line("no difference")


def load(arguments, drive, out):
    values = files.read(arguments.file, out.line)
    changes = drive.load(values, dry_run=True)
    show_changes(changes, out, ("before", "after"))
    if not changes:
        out.line("nothing to change")
        return
    if arguments.dry_run:
        return
    if not arguments.yes and not attend.confirm(f"write these {len(changes)} values?"):
        raise NotDone("nothing was written")
    drive.load(values, progress=out.progress)
    out.line(f"{len(changes)} values written and read back; `pmdrive save` keeps them over a reset")
    hint([entry for entry, _, _ in changes], drive, out)


def save(arguments, drive, out):
    drive.save(arguments.group)
    out.data({"saved": arguments.group})
    out.line(f"kept: {arguments.group}")


def restore(arguments, drive, out):
    if not arguments.yes and not attend.confirm(f"restore the defaults of `{arguments.group}`? What is stored is lost."):
        raise NotDone("nothing was restored")
    drive.restore(arguments.group)
    out.data({"restored": arguments.group})
    out.line(f"defaults of {arguments.group}, after `pmdrive reset`")


def reset(arguments, drive, out):
    drive.reset(arguments.communication)
    out.data({"reset": True})
    out.line("it is back")
