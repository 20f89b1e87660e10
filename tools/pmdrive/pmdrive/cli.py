"""The command line. Every command is a call of the Python interface and a way to show what it gives."""
import argparse
import json
import logging
import os
import re
import sys
import threading

import can

from . import VERSION as TOOL
from . import bus, command_device, command_machine, command_motor, command_sets, command_values, dictionary
from .errors import BusError, PmdriveError, UsageError
from .output import Output

EXAMPLES = """\
examples:
  pmdrive scan                                  who is on the bus
  pmdrive get machine velocity_actual           a whole record, and a value
  pmdrive set R_s=6.2ohm current_bandwidth=800  units and prefixes are understood
  pmdrive dump >motor.yaml; pmdrive diff motor.yaml; pmdrive load motor.yaml
  pmdrive identify; pmdrive tune; pmdrive save  from a new motor to one that runs
  pmdrive run speed 300rpm --for 5              never longer than someone attends
  pmdrive watch velocity_actual i_q             curves in the terminal
  pmdrive trace i_d i_q theta --trigger i_q --level 2A --out start.csv
  pmdrive --can can0 flash pmdrive.elf          writes the firmware, then looks on the bus whether it runs

CAN interface and node id may also stand in PMDRIVE_CAN and PMDRIVE_NODE. A CAN interface is one of:
  """ + bus.KINDS


NEGATIVE = re.compile(r"-\.?\d")  # a number, as in `run speed -300rpm`; argparse takes it for an option unless a space comes first
VERSION = f"pmdrive {TOOL}, object dictionary revision {dictionary.REVISION >> 16}.{dictionary.REVISION & 0xFFFF}"


def parser():
    top = argparse.ArgumentParser(prog="pmdrive", description="Tunes the sensorless motor drive over CAN.",
                                  epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter)
    top.add_argument("--version", action="version", version=VERSION)
    top.add_argument("--can", default=os.environ.get("PMDRIVE_CAN"), help="CAN interface (PMDRIVE_CAN, else can0)")
    top.add_argument("--node", type=int, default=int(os.environ.get("PMDRIVE_NODE", "1")), help="node id (%(default)s)")
    top.add_argument("--bitrate", type=int, default=500000, help="bit/s, where the adapter takes it (%(default)s)")
    top.add_argument("--json", action="store_true", help="answers as JSON, for programs")
    kinds = top.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def command(name, help_text, function, connects=True):
        sub = kinds.add_parser(name, help=help_text, description=help_text)
        sub.set_defaults(function=function, connects=connects)
        return sub

    command("scan", "find the nodes on the bus", command_device.scan, connects=False)
    for theme in (command_values, command_sets, command_machine, command_motor, command_device):
        theme.add(command)
    command("shell", "commands without `pmdrive`, with completion, over one connection", shell)
    command("completion", "print the completion for bash: source <(pmdrive completion)", completion, connects=False)
    sub = command("help", "what a command takes", lambda wanted, *_: helped(top, kinds, wanted.topic), connects=False)
    sub.add_argument("topic", nargs="?", choices=sorted(kinds.choices), metavar="COMMAND")
    return top


SILENT = "stop", "flash"  # what must not wait, or is there to mend it


def shell(arguments, drive, _):
    from .shell import Shell

    Shell(arguments, drive).cmdloop()


def completion(_, __, out):
    from .completion import script

    out.stream.write(script())


def helped(top, kinds, command):
    (kinds.choices[command] if command else top).print_help()


def parse(words):
    return parser().parse_args([" " + word if NEGATIVE.match(word) else word for word in words])


def run(arguments, drive=None, out=None):
    """Carries out parsed arguments; over a drive that is connected already, if one is given."""
    try:
        _run(arguments, drive, out or Output(arguments.json))
    except BrokenPipeError:
        raise
    except OSError as error:
        raise (UsageError(f"{error.filename}: {error.strerror}") if error.filename else BusError(str(error))) from None


def _run(arguments, drive, out):
    needs = {"given": bool(arguments.can), None: not getattr(arguments, "names", None)}.get(
        arguments.connects, arguments.connects)
    arguments.can = arguments.can or "can0"
    if not needs or drive is not None:
        arguments.function(arguments, drive, out)
        return
    with bus.connect(arguments.can, arguments.node, arguments.bitrate) as drive:
        if arguments.command not in SILENT:
            out.warn(drive.foreign())
        arguments.function(arguments, drive, out)


def _thread_ended(what, usual=threading.excepthook):
    """Of the bus that went while a thread of python-can was sending: the command's own error says it."""
    if not issubclass(what.exc_type, (can.CanError, OSError)):
        usual(what)


def main(words=None):
    words = sys.argv[1:] if words is None else words
    for library in ("can", "canopen"):  # what they complain of, our own errors say
        logging.getLogger(library).setLevel(logging.CRITICAL)
    threading.excepthook = _thread_ended
    try:
        arguments = parse(words or ["help"])
    except ValueError:
        print("pmdrive: PMDRIVE_NODE is not a node id", file=sys.stderr)
        return 2
    try:
        run(arguments)
    except PmdriveError as error:
        if arguments.json:
            print(json.dumps(error.as_dict()))
        else:
            print(f"pmdrive: {error}", file=sys.stderr)
        return 2 if isinstance(error, UsageError) else 1
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


if __name__ == "__main__":
    sys.exit(main())
