"""The device itself: who is on the bus, its firmware, its data sheet."""
from pathlib import Path

from . import bus, flash, names
from . import trace as scope
from .errors import NoAnswer, NotDone, UsageError
from .output import show, write_text


def add(command):
    sub = command("flash", "write an image, or a page of parameters, through the debug port", flash_board, connects="given")
    flash.add_options(sub)
    sub = command("eds", "the data sheet that the drive holds", eds)
    sub.add_argument("--out", help="file (standard output)")


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
    write_text(arguments.out, scope.data_sheet(drive), out)
