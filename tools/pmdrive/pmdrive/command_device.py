"""The device itself: who is on the bus, its firmware, its data sheet."""
from pathlib import Path

from . import bus, flash, names
from . import trace as scope
from .errors import NoAnswer, NotDone, NotInImage, UsageError
from .output import check_file, show, write_text


def add(command):
    sub = command("flash", "write an image, or a page of parameters, through the debug port", flash_board, connects="given")
    flash.add_options(sub)
    sub = command("bus", "give the drive another node id or bit rate, kept over a reset", set_bus, connects=False)
    sub.add_argument("--node-id", help="1 to 127")
    sub.add_argument("--bit-rate", help="125, 250 or 500 kbit/s, 1 Mbit/s: 250, 250kbit/s")
    sub.add_argument("--lss", action="store_true",
                     help="by layer setting services, whatever id it has or if it has none: one drive alone on the bus")
    sub = command("eds", "the data sheet that the drive holds", eds)
    sub.add_argument("--out", help="file (standard output)")


def set_bus(arguments, _, out):
    given = {"can_node_id": arguments.node_id, "can_bit_rate": arguments.bit_rate}
    wanted = {}
    for name, text in given.items():
        if text is not None:
            entry = names.find(name)
            wanted[entry] = entry.parse(text)
            entry.check(wanted[entry])
    if not wanted:
        raise UsageError("neither a node id nor a bit rate is given", "--node-id N, --bit-rate N")
    found = {entry.name: raw for entry, raw in wanted.items()}
    node = found.get("can_node_id", arguments.node)
    if arguments.lss:
        bus.configure_alone(arguments.can or "can0", arguments.bitrate, found)
    else:
        with bus.connect(arguments.can or "can0", arguments.node, arguments.bitrate) as drive:
            for entry, raw in wanted.items():
                drive.write(entry, raw)
            drive.save("communication")
            drive.send(0, bytes([129, arguments.node]))
    out.data({"node": node, "changed": found})
    out.line(", ".join(f"{entry.name} {entry.text(raw)}" for entry, raw in wanted.items()))
    if "can_bit_rate" in found:
        out.line(f"set the interface and the other nodes to this bit rate too: --bitrate {1000 * found['can_bit_rate']}")
        return
    with bus.connect(arguments.can or "can0", node, arguments.bitrate) as drive:
        drive.await_answer()
    out.line(f"node {node} answers")


def scan(arguments, _, out):
    found = bus.scan(arguments.can, arguments.bitrate, progress=out.progress)
    out.data({"nodes": found})
    out.line("\n".join(f"node {node}" for node in found) if found else "nobody answers: check bit rate, cable and power")


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
    try:
        sheet = drive.read("stored_eds") if arguments.image else b""
    except NotInImage:
        out.line("its data sheet is not in this image: whether it is this one was not compared")
        return
    if arguments.image and sheet not in Path(arguments.image).read_bytes():
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
    check_file(arguments.out)
    try:
        text = scope.data_sheet(drive)
    except NotInImage:
        raise NotDone(f"node {drive.node_id} holds no data sheet: its image does without",
                      f"it is the one of this tool: {Path(__file__).with_name('pmdrive.eds')}") from None
    write_text(arguments.out, text, out)
