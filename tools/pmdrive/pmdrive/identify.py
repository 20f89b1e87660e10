"""The drive measures its machine: from the name plate to parameters that it has found itself.

    with pmdrive.connect("can0") as drive:
        drive.load(identify.name_plate(drive, current=4, pole_pairs=3, speed=150, dc_link=300))
        found = identify.run(drive)
        drive.load(identify.parameters(drive, found))

The motor turns. Nothing is changed by run(): results become parameters by load().
"""
import math
import time
from decimal import Decimal

from . import names, tune
from .errors import NotDone, UsageError
from .motion import Motion

ROUTINES = {"resistance": 1, "inductance": 2, "flux": 4, "mechanics": 8}
ALONE = {"saliency": 16, "neutral": 32}  # with the rotor locked; with it free
RESULTS = {
    "resistance": ("R_s", "dead_voltage", "leg_capacitance"),
    "inductance": ("L_d", "L_q", "L_q_rated", "L_dh_rated", "L_qh_rated", "L_dqh_rated", "cross_half"),
    "flux": ("psi_m",),
    "mechanics": ("J", "friction", "coulomb"),
    "saliency": ("L_d", "L_q", "L_dh_rated", "L_qh_rated", "L_dqh_rated", "cross_half"),
    "neutral": ("dL_0", "zero_L_c0", "zero_falls", "star_alpha", "star_beta"),
}
DONE, FAILED = 2, 3
WHAT_TO_DO = {
    1: "check the motor's wires and i_rated; a phase may be open, or the link cannot drive the current, R_s i above 0.45 v_dc: "
       "less --current",
    2: "check the motor's wires: a phase is open or loose",
    3: "check the current sensors' scale, i_full_scale and v_full_scale",
    4: "free the shaft, take its load off, or allow more --current; of a motor with saliency less, where it is above "
       "psi_m/(2 (L_q - L_d)): beyond that the vector holds the rotor less, from twice that on not at all",
    5: "it was stopped, or a fault came: `pmdrive faults`",
    6: "a round machine has no saliency to map; nothing at the star point: is it led out?",
    7: "lock the shaft",
}
ROUND = 0.03      # less saliency than that is none,
SATURATED = 0.02  # and then less saturation
LONGEST_S = 60.0


def routines(words=None):
    """Sum for identification.command of names, or of a text with commas; None: all."""
    words = list(ROUTINES) if words is None else words.split(",") if isinstance(words, str) else list(words)
    unknown = [word for word in words if word not in {**ROUTINES, **ALONE}]
    if unknown or not words:
        raise UsageError(f"`{', '.join(unknown)}` is no routine", f"one or several of {', '.join(ROUTINES)}; or {', '.join(ALONE)}")
    if len(words) > 1 and any(word in ALONE for word in words):
        raise UsageError(f"`{'` and `'.join(ALONE)}` run alone: the rotor is locked for `saliency`", "run it alone")
    return words


def run(drive, only=None, current=0, speed=0, progress=None):
    """{routine: {name: integer}} of what has been found. Current in mA, 0: rated; speed in mrad/s, 0: 30 % of speed_max."""
    wanted = routines(only)
    drive.write("identification.command", sum({**ROUTINES, **ALONE}[word] for word in wanted))
    with Motion(drive, "identify", speed=speed, current=current) as motion:
        try:
            _wait(drive, motion, progress)
        except KeyboardInterrupt:
            motion.quick_stop()
            raise
    return {word: {name: drive.read(f"identification.{name}") for name in RESULTS[word]} for word in wanted}


def _wait(drive, motion, progress):
    end = time.monotonic() + LONGEST_S
    while time.monotonic() < end:
        motion.check_fault()
        state = drive.read("identification.state")
        if state == DONE:
            return
        if state == FAILED:
            reason = drive.entry("identification.reason")
            raw = drive.read(reason)
            raise NotDone(f"the identification has failed: {reason.values.get(raw, raw)}", WHAT_TO_DO.get(raw, ""))
        if progress:
            progress(drive.read("identification.progress"), 100)
        time.sleep(0.1)
    raise NotDone(f"the identification has not ended within {LONGEST_S:g} s", "report it with the output of `pmdrive info`")


def _physical(found):
    return {name: float(names.find(f"identification.{name}").physical(raw))
            for group in found.values() for name, raw in group.items()}


def _inductances(x):
    """The drive knows no inverse saliency; next to none is measured as a little of either sign."""
    if x["L_q"] - x["L_d"] < ROUND * x["L_q"]:
        x["L_q_rated"] *= (x["L_d"] + x["L_q"]) / 2 / x["L_q"]
        x["L_d"] = x["L_q"] = x["L_dh_rated"] = (x["L_d"] + x["L_q"]) / 2
        if x["L_q_rated"] > (1 - SATURATED) * x["L_q"]:
            x["L_q_rated"] = x["L_q"]
        x["L_qh_rated"] = 4 * x["L_q_rated"] - 3 * x["L_q"]
        x["L_dqh_rated"] = x["cross_half"] = 0.0
    x["L_qh_rated"] = max(x["L_qh_rated"], 0.3 * x["L_q_rated"])


def parameters(drive, found):
    """{entry: integer} of the parameters that the results are for."""
    x = _physical(found)
    wanted = {}
    if "resistance" in found:
        gap = float(drive.get("dead_time")) * float(drive.get("f_pwm")) * float(drive.get("dc_link_voltage"))
        wanted["R_s"] = x["R_s"]
        wanted["device_drop"] = max(0.0, x["dead_voltage"] - gap)
        wanted["leg_capacitance"] = x["leg_capacitance"]
    if "inductance" in found:
        _inductances(x)
        wanted.update((name, x[name]) for name in RESULTS["inductance"])
    if "saliency" in found:
        wanted.update((name, x[name]) for name in RESULTS["saliency"])
    if "neutral" in found:
        wanted.update((name, x[name]) for name in RESULTS["neutral"])
    wanted.update((name, x[name]) for name in ("psi_m", "J") if name in x)
    return raw_values(wanted)


def raw_values(wanted):
    """{entry: integer} of {name: SI value}; what is beyond a range is its end."""
    out = {}
    for name, value in wanted.items():
        entry = names.find(name)
        raw = entry.raw(Decimal(repr(float(f"{value:.4g}"))))
        out[entry] = min(max(raw, entry.least), entry.most)
    return out


def name_plate(drive, current, pole_pairs, speed, dc_link):
    """{entry: integer} to begin with, from what is written on the machine: rated current (peak, A), highest speed (rad/s),
    voltage of the link. The machine's own data are guesses that identification replaces."""
    plate = {"pole_pairs": pole_pairs, "i_rated": current, "speed_max": speed, "v_dc_nominal": dc_link}
    scales = {name: float(drive.get(name)) for name in ("i_full_scale", "v_full_scale")}
    if min(current, speed, dc_link) <= 0 or pole_pairs < 1:
        raise UsageError("no motor has such a name plate", "pole pairs from 1 on; current, speed and voltage above 0")
    plate.update(tune.limits({**scales, **plate}))
    psi = 0.8 * dc_link / math.sqrt(3) / (pole_pairs * speed)
    L, torque = 0.2 * psi / current, 1.5 * pole_pairs * psi * current
    plate.update({
        "R_s": 0.03 * dc_link / current, "L_d": L, "L_q": L, "psi_m": psi, "L_q_rated": L, "L_dh_rated": L, "L_qh_rated": L,
        "L_dqh_rated": 0.0, "cross_half": 0.0, "J": 0.3 * torque / speed,
    })
    board = {name: float(drive.get(name)) for name in tune.BOARD}
    return raw_values({**plate, **tune.values({**board, **plate})})
