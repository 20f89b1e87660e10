"""From a motor that is not known to one that runs: identification and tuning."""
from . import attend, identify, names, tune
from .entry import QUANTITY
from .errors import NotDone, UsageError
from .output import show, show_changes

RESTART = 3  # parameters_ready


def add(command):
    sub = command("identify", "measure the machine: the motor turns; shows what would change, asks, writes", identify_machine)
    sub.add_argument("--only", help="some of resistance,inductance,flux,mechanics (all); or alone: saliency (rotor locked), "
                                      "neutral (star point led out)")
    sub.add_argument("--current", help="2A; the rated one unless given")
    sub.add_argument("--speed", help="20rad/s, 300rpm; 30%% of speed_max unless given; negative: the other way round")
    sub.add_argument("--rated-current", help="name plate: 4A, peak of a phase. With the next three: values to begin with")
    sub.add_argument("--pole-pairs", help="name plate")
    sub.add_argument("--max-speed", help="name plate: 3000rpm")
    sub.add_argument("--dc-link", help="voltage of the link: 24V")
    sub.add_argument("--yes", action="store_true", help="do not ask")
    sub = command("tune", "controllers, position loop and start from the machine's parameters; shows, asks, writes",
                  tune_controllers)
    sub.add_argument("--bandwidth", type=float, help="of the current control, Hz (f_pwm / 20)")
    sub.add_argument("--yes", action="store_true", help="do not ask")


def _take(arguments, drive, out, values, what):
    """Shows what would change, asks, writes, reads back. Whether anything was written."""
    changes = drive.load(values, dry_run=True)
    show_changes(changes, out, ("before", "after"))
    if not changes:
        out.line(f"{what}: nothing to change")
        return False
    if not arguments.yes and not attend.confirm(f"write these {len(changes)} values?"):
        raise NotDone("nothing was written")
    drive.load(values)
    out.line(f"{len(changes)} values written and read back")
    return True


def _name_plate(arguments):
    """(A, pole pairs, rad/s, V), or nothing."""
    given = (arguments.rated_current, arguments.pole_pairs, arguments.max_speed, arguments.dc_link)
    if all(value is None for value in given):
        return ()
    if any(value is None for value in given):
        raise UsageError("a name plate has all four", "--rated-current --pole-pairs --max-speed --dc-link")
    return [float(names.find(name).physical(_understood(name, text)))
            for name, text in zip(("i_rated", "pole_pairs", "speed_max", "v_dc_nominal"), given)]


def _begin(arguments, drive, out, plate):
    current, pole_pairs, speed, dc_link = plate
    out.line("to begin with, from the name plate; what is not written there is a guess:")
    values = identify.name_plate(drive, current, int(pole_pairs), speed, dc_link)
    if _take(arguments, drive, out, values, "name plate") and drive.read("parameters_ready") == RESTART:
        # Over-current comparators take their level at the start. The guesses are not stored as the machine's values.
        drive.save("application")
        drive.reset()
        drive.load(values)
        if "fault" in drive.state():  # the limits alone were not right with the machine that it had
            drive.clear_fault()


def _understood(name, text):
    """The integer; a speed has its unit, for name plates have another than the dictionary."""
    if text is None:
        return 0
    entry = names.find(name)
    raw = entry.parse(text)
    entry.check(raw)
    if entry.unit == "rad/s" and not QUANTITY.fullmatch(text)[2]:
        number = text.strip()
        raise UsageError(f"`{number}` is a speed without a unit", f"{number}rpm or {number}rad/s")
    return raw


def identify_machine(arguments, drive, out):
    wanted = identify.routines(arguments.only)
    current = _understood("target_current", arguments.current)
    speed = _understood("target_velocity", arguments.speed)
    plate = _name_plate(arguments)
    turning = "turns" if {"flux", "mechanics"} & set(wanted) else "moves"
    if not arguments.yes and not attend.confirm(
            f"THE MOTOR {turning.upper()} for some 13 s, with its rated current. Is it free to?"):
        raise NotDone("nothing was done")
    if plate:
        _begin(arguments, drive, out, plate)
    found = identify.run(drive, wanted, current, speed, out.progress)
    for group in found.values():
        show(out, {names.find(f"identification.{name}"): raw for name, raw in group.items()})
    if _take(arguments, drive, out, identify.parameters(drive, found), "identification"):
        out.line("next: `pmdrive tune`, then `pmdrive save`")


def tune_controllers(arguments, drive, out):
    bandwidth = arguments.bandwidth
    if _take(arguments, drive, out, tune.changes(drive, bandwidth), "tuning"):
        out.line("`pmdrive save` keeps them over a reset")
