"""Limits, controllers, position loop and start from what is known of the machine.

The rules are those by which the machine files of sim_plant/machines were set by hand; docs/identify.md says why.
"""
import math

from .errors import NotInImage, UsageError

BOARD = ("f_pwm", "i_full_scale", "v_full_scale", "i_noise", "dead_time", "device_drop")
MACHINE = ("pole_pairs", "i_rated", "i_max", "speed_max", "v_dc_nominal", "v_dc_min", "R_s", "L_d", "L_q", "L_q_rated",
           "L_qh_rated", "psi_m", "J")
BESIDE = ("commutation", "leg_capacitance", "injection")  # where the image has them
SQUARE = 0      # of `injection`: along d; the windows of the other sources bound their loop
SALIENT = 0.05  # the drive's own limit for injection
MEASURED = 0.02 # of R, L_d, L_q, psi_m and J: what identification is off by
TOLD = 0.15     # what a data sheet is
STEPS = 4096    # of the converter
SLOWEST_HZ = 25.0    # of a position loop: by injection slow enough for the noise of the smallest answer that leads
LAG = 0.12           # rad that the estimate may be behind an acceleration
STALL_S = 0.6
HAND_OVER = 0.08     # of rated speed: without injection, where nothing asks for more
SPEED_MOST = 0.4     # of rated speed: hand-over of a machine whose EMF is small at any speed
QUALITY = 3.0        # of an open terminal that rings
DECAY = 4.0          # time constants, after which it has
BLANK_MOST = 0.4     # of a period
SECTORS_LEAST = 25   # from rest to rated speed with rated torque

# Why each value is what it is, in a line.
WHY = {
    "i_max": "1.25 times rated",
    "i_trip": "2.25 times rated, at most 90 % of the converter's range",
    "speed_max": "1.25 times rated",
    "speed_trip": "1.2 times speed_max",
    "v_dc_min": "30 % of the link, and 7 % of the converter's range; more where R or L is far above what the board is made for",
    "v_dc_derate": "120 % of the link, a battery that is full",
    "v_dc_max": "133 % of the link, at most 96 % of the converter's range",
    "current_bandwidth": "a twentieth of f_pwm, a tenth with what saturation leaves of L_q; at most 1500 Hz, and what the link "
                         "drives a tenth of rated current with",
    "injection_bandwidth": "as flux_bandwidth, as far as the noise of the answer lets it, and a tenth of current_bandwidth; 25 Hz at least",
    "speed_bandwidth": "six times rated torque over the inertia at rated speed; below the position's loop, also with what "
                       "saliency adds to the torque; a gain that the drive's format has",
    "acceleration": "0.3 of rated torque, over what saliency adds to it; at most what the position loop, of 25 Hz by injection, "
                    "follows 0.12 rad behind",
    "flux_bandwidth": "follows 0.8 of rated torque within 0.18 rad, well short of the 0.3 that count as lost; 25 to 120 Hz; a tenth of "
                      "current_bandwidth where saturation is what slows that",
    "flux_gain": "half where the machine saturates or is salient; damping costs nothing elsewhere",
    "speed_low": "with injection 15 % of rated speed, or so much of speed_high; without 4 %, and half of speed_high",
    "speed_high": "with injection 27 % of rated speed, and an EMF 2.5 times what a leg loses; without 8 %, and one above that and what "
                  "R i is off by",
    "i_d_light": "a tenth of rated, a fifth at most: light load stays out of what dead time does to small currents, where a wire that "
                 "is off is not seen",
    "i_fw_max": "half of rated",
    "comp_zone": "a dozen steps of the converter",
    "v_injection": "seven steps of the converter as an answer, 14 times what a leg loses; as the link and i_trip leave room",
    "i_pulse": "rated current, which saturates",
    "start_method": "0: pulses and injection, as the saliency is sure and seen; 2: align and open loop, as it is not",
    "i_open_loop": "0.8 of rated, bears half the rated torque 39 degrees behind; at most psi_m/(2 (L_q - L_d)), or saliency "
                   "turns the rotor away",
    "open_loop_damping": "0.7; less where dead time and drops take more of a leg than 2.5 times the EMF of a rotor that swings, or "
                         "current control is slower than 370 Hz",
    "t_align": "half a second, three swings of the rotor on the vector at least",
    "t_stall": "a fault well within a second of a rotor that does not turn",
    "six_step_speed": "10 % of rated, where an open terminal shows its EMF",
    "pattern": "both legs chopped: the open terminal shows its EMF for half a period and more, and never beyond the rails",
    "t_blank": "an open terminal has rung out, at 1/(2 pi sqrt(1.5 L C)) with Q = 3; at most 40 % of a period",
    "open_loop_acceleration": "a tenth of rated torque; hands over within 0.6 s where that allows it",
}


LINK_MOST = 1.33  # of the link's voltage: v_dc_max


def _lost(x):
    """What a leg loses by dead time and drops, V."""
    return x["device_drop"] + x["dead_time"] * x["f_pwm"] * x["v_dc_nominal"]


def largest_carrier(x):
    """That the drive accepts, 0.6 of the linear range, with a margin, V."""
    return 0.57 * x["v_dc_nominal"] / math.sqrt(3)


def _flux_gain(x):
    """Behind an acceleration the estimate lags, and i_q is taken for i_d: psi_a of the model is then wrong by (L_q - L_d) i_q times the
    lag, which the feedback gives back to the angle."""
    saturates = x["L_q_rated"] < 0.985 * x["L_q"]
    salient = (x["L_q"] - x["L_d"]) * x["i_max"] > 0.35 * x["psi_m"]
    return 0.5 if saturates or salient else 1.0


def _injection(x, tolerance):
    """Seven steps of the converter as an answer 45 degrees off, and fourteen times what a leg loses, which at light load
    comes and goes with the carrier; as far as the link leaves room. Half a step of its current adds to i_max and stays below 0.9 of
    i_trip, and a quarter of rated current is left to it whatever i_max is. Whether it may lead, and the fastest loop of the position by
    it, Hz: the noise of the speed goes with w^1.5 / answer, and is that of the smallest answer which leads."""
    step, dL = 2 * x["i_full_scale"] / STEPS, x["L_q"] - x["L_d"]
    beside = max(0.9 * limits(x)["i_trip"] - x["i_max"], 0.25 * x["i_rated"])
    top = min(largest_carrier(x), 2 * x["L_d"] * x["f_pwm"] * beside)
    if dL <= max(SALIENT, 2 * tolerance / (1 + tolerance)) * x["L_q"]:  # both may be off, either way
        return 0.2 * top, False, SLOWEST_HZ
    v = max(7 * step * 2 * x["L_d"] * x["L_q"] * x["f_pwm"] / dL, 14 * _lost(x))
    answer = min(v, top) * dL / (2 * x["L_d"] * x["L_q"] * x["f_pwm"])
    smallest = max(4 * x["i_noise"], 2 * step)
    return min(v, top), answer > smallest, SLOWEST_HZ * max(answer / smallest, 1.0) ** (2 / 3)


def _open_loop(x):
    """Current of the vector. Its stiffness is psi_m i - (L_q - L_d) i^2, at its most for psi_m / (2 (L_q - L_d))."""
    i, dL = 0.8 * x["i_rated"], x["L_q"] - x["L_d"]
    return min(i, x["psi_m"] / (2 * dL)) if dL > 0 else i


def _damping(x, i_open, current_Hz):
    """Of the rotor on the vector. It sees the swing by its EMF, psi_m times the swing's frequency at an amplitude of a radian; what
    dead time and drops leave beside that is noise, which damping would turn into motion. And when the vector yields, the drive puts
    psi_m times that before the current control, which takes it back: what is left of it after a step of 1 ms is seen as a swing, and
    is to be yielded to by 0.4 of itself at most (firmware/drive/open_loop_config.c has the gain)."""
    swing = _swing(x, i_open)
    gain = min(6.0, 0.8 / (1e-3 * swing))
    left = gain * math.exp(-2 * math.pi * current_Hz * 1e-3)
    return min(0.7 * min(1.0, x["psi_m"] * swing / (0.4 * _lost(x))) if _lost(x) > 0 else 0.7, 0.4 / left)


def _judged(x):
    """Current from which on the drive looks whether all legs conduct: twice the zone in which a leg's capacitance turns the edges
    (firmware/drive/open_phase.h), with a margin of a tenth."""
    return 1.1 * 2 * 1.7 * x.get("leg_capacitance", 0.0) * x["v_dc_nominal"] / x["dead_time"] if x["dead_time"] > 0 else 0.0


def _swing(x, i_open):
    """Of the rotor on the vector, rad/s."""
    return math.sqrt(1.5 * x["pole_pairs"] ** 2 * x["psi_m"] * i_open / x["J"])


def _stiffest(x):
    """Bandwidth of speed control whose gain, w J / (1.5 p^2 psi_m) of its bases, the drive's format has, Hz."""
    return 30 * 1.5 * x["pole_pairs"] * x["psi_m"] * x["i_full_scale"] / (2 * math.pi * x["J"] * 1.2 * x["speed_max"])


def _reach(x):
    """Bandwidth at which a step of a tenth of rated current asks for the whole link, and whose gain the drive's format has, Hz."""
    L = max(x["L_d"], x["L_q"])
    step = 10 * x["v_dc_nominal"] / math.sqrt(3) / x["i_rated"]
    gain = 30 * x["v_full_scale"] / x["i_full_scale"] * 2 ** _doublings(x, x["v_dc_min"])
    return min(step, gain) / (2 * math.pi * L)


def _times(x):
    """By what R, or X at speed_trip, is beyond 4 v_full_scale / i_full_scale, the drive's format with a margin of 5 %."""
    X = x["L_q"] * 1.2 * x["speed_max"] * x["pole_pairs"]
    return max(x["R_s"], X) * 1.05 * x["i_full_scale"] / (4 * x["v_full_scale"])


def _doublings(x, v_dc_min):
    """Of the format's voltage by the drive: as many as R and X need and v_dc_min, an eighth of it, allows."""
    n = 0
    while _times(x) > 2 ** n and v_dc_min >= 0.125 * x["v_full_scale"] * 2 ** n:
        n += 1
    return n


def _v_dc_min(x):
    """As low as the link may be for the impedance to be in the format, where 0.7 of it is enough for that."""
    v = max(0.3 * x["v_dc_nominal"], 0.07 * x["v_full_scale"])
    for n in range(4):
        more = 0.126 * x["v_full_scale"] * 2 ** n
        if "L_q" in x and _times(x) > 2 ** n and more < 0.7 * x["v_dc_nominal"]:
            v = max(v, more)
    return v


def _reluctance(x):
    """What most torque per ampere makes of psi_m at rated current: the speed control knows psi_m alone."""
    dL = x["L_q_rated"] - x["L_d"]
    if dL <= 0:
        return 1.0
    h = x["psi_m"] / (2 * (x["L_q"] - x["L_d"]))  # as the drive has it
    return 1 + dL * (math.hypot(h, x["i_rated"]) - h) / x["psi_m"]


def _hand_over(x, i_open, leads, tolerance):
    """speed_low and speed_high. The EMF must stand out from what dead time is not known to, which under a carrier is more; without
    injection from R too: an error by the tolerance turns the estimate by 0.3 rad at most."""
    rated = 0.8 * x["speed_max"]
    if leads:
        high = min(max(0.27 * rated, 2.5 * _lost(x) / (x["psi_m"] * x["pole_pairs"])), SPEED_MOST * rated)
        return high * 0.15 / 0.27, high
    seen = (_lost(x) + tolerance / 0.3 * x["R_s"] * i_open) / (x["psi_m"] * x["pole_pairs"])
    high = min(max(HAND_OVER * rated, seen), SPEED_MOST * rated)
    return max(0.04 * rated, 0.5 * high), high


def ringing(L, C):
    """Until an open terminal has rung out, s: at 1/(2 pi sqrt(1.5 L C)) with QUALITY."""
    return DECAY * 2 * QUALITY * math.sqrt(1.5 * L * C)


def damping(L, C):
    """Resistor across each winding with which an open terminal rings with QUALITY, ohm (docs/plant.md)."""
    return QUALITY / 1.5 * math.sqrt(1.5 * L / C)


def _in_blocks(x, speed_bandwidth):
    """What block commutation has beside the rest. six_step_start 1 goes from the align. Speed is known once in a sector, as the mean
    of a turn."""
    rated, jerk = 0.8 * x["speed_max"], 1.5 * x["pole_pairs"] * x["psi_m"] * x["i_rated"] / x["J"]
    field_Hz = x["pole_pairs"] * rated / (2 * math.pi)
    sectors = 3 * field_Hz * rated / jerk
    if sectors < SECTORS_LEAST:
        raise UsageError(f"rated torque takes this rotor to its speed within {sectors:.0f} sectors, too few for block commutation",
                         "use field orientation, commutation: 0, or tell the inertia with what the motor turns")
    return {"six_step_speed": 0.1 * rated, "pattern": 0, "start_method": 2,
            "t_blank": min(ringing(x["L_d"], x["leg_capacitance"]), BLANK_MOST / x["f_pwm"]),
            "speed_bandwidth": min(speed_bandwidth, 0.03 * field_Hz), "acceleration": min(0.3 * jerk, 0.02 * field_Hz * rated)}


def limits(x):
    """{name: SI value} from i_rated, speed_max, v_dc_nominal and the board's full scales."""
    current, speed, link = x["i_rated"], x["speed_max"], x["v_dc_nominal"]
    i_scale, v_scale = x["i_full_scale"], x["v_full_scale"]
    if not (0 < current < 0.75 * i_scale and 0 < link < 0.9 * v_scale):
        raise UsageError("the board cannot measure what the name plate says",
                         f"its channels reach {i_scale:g} A and {v_scale:g} V")
    return {
        "i_max": 1.25 * current, "i_trip": min(2.25 * current, 0.9 * i_scale), "speed_trip": 1.2 * speed,
        "v_dc_min": _v_dc_min(x), "v_dc_derate": min(1.2 * link, 0.88 * v_scale),
        "v_dc_max": min(LINK_MOST * link, 0.96 * v_scale),
    }


def values(x, bandwidth=None, tolerance=MEASURED):
    """{name: SI value} from {name: SI value} of BOARD and MACHINE, and of BESIDE what is known. Bandwidth of the current control in Hz; tolerance: by
    what share of itself each of R, L_d, L_q, psi_m and J may be off."""
    highest = x["f_pwm"] / 10
    if bandwidth is not None and not 10 <= bandwidth <= highest:
        raise UsageError(f"{bandwidth:g} Hz is no bandwidth for the current", f"10 to {highest:g} Hz, a tenth of f_pwm")
    rated_speed = 0.8 * x["speed_max"]
    torque = 1.5 * x["pole_pairs"] * x["psi_m"] * x["i_rated"]
    jerk = torque / x["J"]  # rad/s2 at rated torque
    v_injection, leads, fastest_Hz = _injection(x, tolerance)
    saturated = highest * x["L_qh_rated"] / x["L_q"]
    current = bandwidth or min(x["f_pwm"] / 20, saturated, 1500.0, _reach(x))
    quick = saturated / 10 if saturated < x["f_pwm"] / 20 else 120.0  # the frame turns slower than current control in it can follow
    position_Hz = min(max(min(math.sqrt(0.8 / 0.18 * jerk * x["pole_pairs"]) / (2 * math.pi), quick), SLOWEST_HZ), 120.0)
    quickest = min(fastest_Hz, current / 10) if x.get("injection", SQUARE) == SQUARE else SLOWEST_HZ
    injection_Hz = max(min(position_Hz, quickest), SLOWEST_HZ)
    slower = SLOWEST_HZ if leads else position_Hz
    behind = LAG * (2 * math.pi * slower) ** 2 / x["pole_pairs"]
    ripple = x["v_dc_nominal"] / (x["L_d"] * x["f_pwm"])  # of the current by the pulses: light load must be beyond it
    i_open = _open_loop(x)
    low, high = _hand_over(x, i_open, leads, tolerance)
    out = {
        "current_bandwidth": current,
        "injection_bandwidth": injection_Hz,
        "speed_bandwidth": min(max(6 * jerk / rated_speed / (2 * math.pi), 2.0),
                               SLOWEST_HZ / 3.5 / _reluctance(x) if leads else max(10.0, position_Hz / 6), _stiffest(x)),
        "acceleration": min(0.3 * jerk / _reluctance(x), behind),
        "flux_bandwidth": position_Hz,
        "flux_gain": _flux_gain(x),
        "speed_low": low,
        "speed_high": high,
        "i_d_light": min(max(0.1 * x["i_rated"], 0.05 * ripple, _judged(x)), 0.2 * x["i_rated"]),
        "i_fw_max": 0.5 * x["i_rated"],
        "comp_zone": 12 * 2 * x["i_full_scale"] / STEPS,
        "v_injection": v_injection,
        "i_pulse": x["i_rated"],
        "start_method": 0 if leads else 2,
        "i_open_loop": i_open,
        "open_loop_damping": _damping(x, i_open, current),
        "t_align": min(max(0.5, 3 * 2 * math.pi / _swing(x, i_open)), 10.0),
        "open_loop_acceleration": min(0.1 * jerk, high / 0.6),
        "t_stall": STALL_S,
    }
    return {**out, **_in_blocks(x, out["speed_bandwidth"])} if x.get("commutation") == 1 else out


def changes(drive, bandwidth=None):
    """{entry: integer} for Drive.load()."""
    from .identify import raw_values

    known = {name: float(drive.get(name)) for name in BOARD + MACHINE}
    for name in BESIDE:
        try:
            known[name] = float(drive.get(name))
        except NotInImage:
            pass
    return raw_values(values(known, bandwidth))
