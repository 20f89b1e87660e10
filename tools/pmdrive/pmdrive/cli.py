"""The command line. Every command is a call of the Python interface and a way to show what it gives."""
import argparse
import json
import logging
import os
import sys

from . import bus, commands, flash
from .errors import PmdriveError, UsageError

EXAMPLES = """\
examples:
  pmdrive scan                                  who is on the bus
  pmdrive get machine velocity_actual           a whole record, and a value
  pmdrive set R_s=6.2ohm current_bandwidth=800  units and prefixes are understood
  pmdrive dump >motor.yaml; pmdrive diff motor.yaml; pmdrive load motor.yaml
  pmdrive identify; pmdrive tune; pmdrive save  from a new motor to one that runs
  pmdrive run speed 300rpm --for 5              never longer than someone attends
  pmdrive trace i_d i_q theta --trigger i_q --level 2A --out start.csv
  pmdrive --can can0 flash pmdrive.elf          writes the firmware, then looks on the bus whether it runs

CAN interface and node id may also stand in PMDRIVE_CAN and PMDRIVE_NODE. A CAN interface is one of:
  """ + bus.KINDS


def parser():
    top = argparse.ArgumentParser(prog="pmdrive", description="Tunes the sensorless motor drive over CAN.",
                                  epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter)
    top.add_argument("--can", default=os.environ.get("PMDRIVE_CAN"), help="CAN interface (PMDRIVE_CAN, else can0)")
    top.add_argument("--node", type=int, default=int(os.environ.get("PMDRIVE_NODE", "1")), help="node id (%(default)s)")
    top.add_argument("--bitrate", type=int, default=500000, help="bit/s, where the adapter takes it (%(default)s)")
    top.add_argument("--json", action="store_true", help="answers as JSON, for programs")
    kinds = top.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def add(name, help_text, function, connects=True):
        sub = kinds.add_parser(name, help=help_text, description=help_text)
        sub.set_defaults(function=function, connects=connects)
        return sub

    add("scan", "find the nodes on the bus", commands.scan, connects=False)
    sub = add("info", "what the drive is and how it does; with names: what they mean", commands.info, connects=None)
    sub.add_argument("names", nargs="*", help="objects or records")
    sub = add("list", "the names of objects, with range and meaning", commands.list_names, connects=False)
    sub.add_argument("names", nargs="*", help="records or parts of names (all)")
    sub = add("get", "read values", commands.get)
    sub.add_argument("names", nargs="+", help="objects or records, by name or index:sub")
    sub = add("set", "write values", commands.set_values)
    sub.add_argument("assignments", nargs="+", metavar="NAME=VALUE", help="with a unit if you like: R_s=6200mohm")
    sub = add("dump", "write all stored values as a file", commands.dump)
    sub.add_argument("names", nargs="*", help="only these objects or records")
    sub.add_argument("--out", help="file (standard output)")
    sub = add("load", "set the values of a file, check all together, read back", commands.load)
    sub.add_argument("file")
    sub.add_argument("--dry-run", action="store_true", help="only show what would change")
    sub.add_argument("--yes", action="store_true", help="do not ask")
    sub = add("diff", "what differs from a file, or from the defaults", commands.diff)
    sub.add_argument("file", nargs="?", help="file (the defaults)")
    for name, text, function in (("save", "keep the present values over a reset", commands.save),
                                 ("restore", "have the defaults after the next reset", commands.restore)):
        sub = add(name, text, function)
        sub.add_argument("group", nargs="?", default="all", choices=("all", "communication", "application", "machine"))
    sub = add("reset", "restart the drive", commands.reset)
    sub.add_argument("--communication", action="store_true", help="its communication alone")
    sub = add("faults", "the latched fault, its record, and the history", commands.faults)
    sub.add_argument("--clear", action="store_true", help="clear the fault")
    sub = add("monitor", "live values", commands.monitor)
    sub.add_argument("names", nargs="*", help="objects or records")
    sub.add_argument("--interval", type=float, default=0.2, help="seconds (%(default)s)")
    sub.add_argument("--count", type=int, default=0, help="end after so many (0: at Ctrl-C)")
    sub = add("run", "run the motor while a time lasts or a key is held", commands.run)
    sub.add_argument("mode", choices=("speed", "torque", "current"))
    sub.add_argument("target", help="300rpm, 20rad/s; 50%% of rated torque; 2A (turning at --speed)")
    sub.add_argument("--speed", default="0", help="of the vector in current mode")
    sub.add_argument("--for", dest="seconds", type=float, help="seconds; without it the space bar must be held")
    add("stop", "switch the bridge off now", commands.stop)
    sub = add("identify", "measure the machine: the motor turns; shows what would change, asks, writes",
              commands.identify_machine)
    sub.add_argument("--only", help="some of resistance,inductance,flux,mechanics (all)")
    sub.add_argument("--current", help="2A; the rated one unless given")
    sub.add_argument("--speed", help="20rad/s, 300rpm; 30%% of speed_max unless given; negative: the other way round")
    sub.add_argument("--rated-current", help="name plate: 4A, peak of a phase. With the next three: values to begin with")
    sub.add_argument("--pole-pairs", help="name plate")
    sub.add_argument("--max-speed", help="name plate: 3000rpm")
    sub.add_argument("--dc-link", help="voltage of the link: 24V")
    sub.add_argument("--yes", action="store_true", help="do not ask")
    sub = add("tune", "controllers, position loop and start from the machine's parameters; shows, asks, writes",
              commands.tune_controllers)
    sub.add_argument("--bandwidth", type=float, help="of the current control, Hz (f_pwm / 20)")
    sub.add_argument("--yes", action="store_true", help="do not ask")
    sub = add("trace", "record signals as an oscilloscope does", commands.trace)
    sub.add_argument("signals", nargs="+", help="objects marked t in docs/object-dictionary.md")
    sub.add_argument("--divider", type=int, default=1, help="control periods per sample (%(default)s)")
    sub.add_argument("--pre", type=float, default=0.1, help="share before the trigger (%(default)s)")
    sub.add_argument("--trigger", help="signal that triggers (at once)")
    sub.add_argument("--level", help="with a unit if you like")
    sub.add_argument("--edge", default="rising", choices=("rising", "falling", "both"))
    sub.add_argument("--wait", type=float, default=10.0, help="seconds (%(default)s)")
    sub.add_argument("--out", default="trace.csv", help=".csv, .png or .mf4 (%(default)s)")
    sub = add("flash", "write an image, or a page of parameters, through the debug port", commands.flash_board,
              connects="given")
    flash.add_options(sub)
    sub = add("eds", "the data sheet that the drive holds", commands.eds)
    sub.add_argument("--out", help="file (standard output)")
    add("shell", "commands without `pmdrive`, with completion, over one connection", commands.shell)
    sub = add("completion", "print the completion for bash: source <(pmdrive completion)", commands.completion,
              connects=False)
    sub = add("help", "what a command takes", lambda wanted, *_: helped(top, kinds, wanted.topic), connects=False)
    sub.add_argument("topic", nargs="?", choices=sorted(kinds.choices), metavar="COMMAND")
    return top


def helped(top, kinds, command):
    (kinds.choices[command] if command else top).print_help()


def run(arguments, drive=None, out=None):
    """Carries out parsed arguments; over a drive that is connected already, if one is given."""
    out = out or commands.Output(arguments.json)
    needs = {"given": bool(arguments.can), None: not getattr(arguments, "names", None)}.get(
        arguments.connects, arguments.connects)
    arguments.can = arguments.can or "can0"
    if not needs or drive is not None:
        arguments.function(arguments, drive, out)
        return
    with bus.connect(arguments.can, arguments.node, arguments.bitrate) as drive:
        arguments.function(arguments, drive, out)


def main(words=None):
    words = sys.argv[1:] if words is None else words
    for library in ("can", "canopen"):  # what they complain of, our own errors say
        logging.getLogger(library).setLevel(logging.CRITICAL)
    try:
        arguments = parser().parse_args(words or ["help"])
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
