#!/usr/bin/python3
"""From ten values of a motor to a machine file with all that the drive needs, each choice explained in a line.

    pmsim tune my_motor.yaml                     # prints the file; or tools/tune.py
    pmsim tune my_motor.yaml -o tuned.yaml       # writes it
    pmsim run tests/unit/tune/start.yaml --set machine=tuned.yaml

my_motor.yaml, all that it must have:

    name: My motor
    electrical: {R_s_ohm: 0.11, L_d0_H: 0.18e-3, L_q0_H: 0.2e-3, psi_m_Wb: 0.022, pole_pairs: 15}
    mechanics: {J_kgm2: 0.02}                                   # with what it turns
    rated: {i_rated_A: 20, speed_rated_rad_s: 40, v_dc_V: 36}   # peak of a phase; mechanical

What else a machine file may have is kept; inverter, sensors and link that are not told are those of a board of the motor's
class: MOSFETs up to 100 V; IGBTs above, or silicon carbide from 40 kHz on. What `drive:` of the file says stands above what is
chosen here. The rules are those of `pmdrive tune`. Saturation is taken from c_A_Wb5 of `electrical:`, or from L_q_rated of `drive:`.
L_q may be below L_d.

`injection: 4` or `1` in `drive:` asks for a sine along d or a rotating one: its amplitude, frequency and loops are then chosen by the
position error that is predicted for each of twelve carriers without load and at rated current (section 5.8.3 of the book). It is
not asked for where `drive:` tells all three, v_injection, f_injection and injection_bandwidth.

A link that cannot drive rated current at rest, not reach rated speed, or leaves less than 80 % of its torque there, is warned of;
one that cannot drive half of rated current is refused.

`commutation: 1` in `drive:` asks for block commutation, `trapezoid_flat_deg` in `winding:` says that the EMF is a trapezoid.
"""
import argparse
import difflib
import importlib
import math
import os
import re
import sys
import types
from decimal import Decimal
from pathlib import Path

import yaml

PACKAGE = Path(__file__).resolve().parent / "pmdrive" / "pmdrive"
package = types.ModuleType("pmdrive")  # its modules one by one: no bus is needed, nor what talks to it
package.__path__ = [str(PACKAGE)]
sys.modules["pmdrive"] = package
names, tune = importlib.import_module("pmdrive.names"), importlib.import_module("pmdrive.tune")
carrier = importlib.import_module("pmdrive.carrier")
UsageError = importlib.import_module("pmdrive.errors").UsageError

NEEDED = {
    "electrical": ("R_s_ohm", "L_d0_H", "L_q0_H", "psi_m_Wb", "pole_pairs"),
    "mechanics": ("J_kgm2",),
    "rated": ("i_rated_A", "speed_rated_rad_s", "v_dc_V"),
}
TIMER_HZ = 170e6
LOW_V = 100  # up to there: MOSFETs, which bear half as much again
FAST_HZ = 40e3  # from here on above LOW_V: silicon carbide
PWM_HZ = (10e3, 20e3, 40e3, 60e3)
PER_TURN = 20  # periods of a turn of the field at the speed that trips
LEAST_PER_TURN = 13  # the drive refuses less than 12.6
PER_RISE = 3  # periods of L / R
# Of rated current, what the link must drive at rest. The vector of a start asks for 0.8: a motor at 12 V starts without a load where the
# link drives 0.96 and stalls where it drives 0.82. Between that and a half a smaller i_open_loop or light friction may do; below, nothing.
START = 0.5
BEARS = 0.8  # of the torque of rated current, at rated speed
RIPPLE = 6  # of the phase current, peak to peak: v_dc / (6 L f_pwm) at its most
BELOW = "the motor's; below L_d: i_d = 0 and no injection, which costs less than (L_d - L_q) i / psi_m squared, half"
OTHERS = "name", "electrical", "winding", "mechanics", "rated", "inverter", "sensor", "dclink", "drive"


def fields():
    """{(section, key): (least, most)} of a machine file, as pmsim has them (`pmsim keys`); None of what is no number. And those that
    are whole numbers."""
    found, whole = {}, set()
    for line in (Path(__file__).parent / "machine_keys.txt").read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            name, kind, *limits = line.split()
            place = tuple(name.split("."))
            found[place] = tuple(map(float, limits)) or None
            whole |= {place} if kind == "whole" else set()
    return found, whole


FIELDS, WHOLE = fields()
SECTIONS = {section for section, _ in FIELDS} | {"drive", "flux_map"}
PARAMETERS = {entry.name: entry for entry in names.dictionary.ENTRIES if entry.record in names.DRIVE_RECORDS}
OF_INVERTER = {"f_pwm": "f_pwm_Hz", "timer_counts": "timer_counts"}
NUMBER = re.compile(r"-?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


def refuse(path, node, what):
    raise UsageError(f"{path}:{node.start_mark.line + 1}:{node.start_mark.column + 1}: {what}")


def entries(path, node, section=""):
    """{key: node of its value}, and of all below; each key once, each with a value."""
    out, lines = {}, {}
    for key, value in node.value:
        if not isinstance(key, yaml.ScalarNode):
            refuse(path, key, "a key must be a word")
        if key.value in out:
            refuse(path, key, f"key `{key.value}` stands here a second time; first at line {lines[key.value]}")
        if value.tag == "tag:yaml.org,2002:null":
            refuse(path, key, f"{section}{key.value}: a value is missing")
        out[key.value], lines[key.value] = value, key.start_mark.line + 1
        for item in value.value if isinstance(value, yaml.SequenceNode) else []:
            if isinstance(item, yaml.MappingNode):
                entries(path, item)
    return out


def did_you_mean(word, known):
    near = difflib.get_close_matches(word, known, 1, 0.6)
    return f"; did you mean `{near[0]}`?" if near else ""


def number(path, node, what):
    """As pmsim takes it: YAML itself would take 1e3 for a word, true for 1 and 010 for 8."""
    if not isinstance(node, yaml.ScalarNode) or not NUMBER.fullmatch(node.value):
        refuse(path, node, f"{what}: expected a number" + (f", found \"{node.value}\"" if isinstance(node, yaml.ScalarNode) else ""))
    return float(node.value)


def field(path, section, key, node):
    """The value of a key that pmsim takes for a number within limits; None of others, which pmsim reads."""
    what = f"{section}.{key}"
    if (section, key) not in FIELDS:
        refuse(path, node, f"unknown key {what}{did_you_mean(what, [f'{s}.{k}' for s, k in FIELDS if s == section])}")
    if FIELDS[section, key] is None:
        return None
    value, (least, most) = number(path, node, what), FIELDS[section, key]
    if not least <= value <= most:
        refuse(path, node, f"{what} = {node.value} is out of range {least:g} ... {most:g}")
    if (section, key) in WHOLE and value != int(value):
        refuse(path, node, f"{what} = {node.value} is no whole number")
    return value


def parameter(path, key, node):
    """The value of one in `drive:`, that the drive can store."""
    what = f"drive.{key}"
    if key not in PARAMETERS:
        refuse(path, node, f"unknown parameter {what}{did_you_mean(key, list(PARAMETERS))}")
    if key in OF_INVERTER:
        refuse(path, node, f"{what} follows from the inverter: inverter.{OF_INVERTER[key]}")
    value, entry = number(path, node, what), PARAMETERS[key]
    raw = entry.raw(Decimal(node.value))
    if not entry.least <= raw <= entry.most:
        refuse(path, node, f"{what} = {node.value} is out of range {float(entry.least * entry.scale):g} ... {float(entry.most * entry.scale):g}")
    if abs(float(raw * entry.scale) - value) > 0.01 * abs(value):
        refuse(path, node, f"{what} = {node.value} cannot be stored: the step is {float(entry.scale):g}")
    return value


def read(path):
    """The file's sections, checked as pmsim does (docs/pmsim.md); an error names the place and what is wrong there."""
    try:
        text = Path(path).read_text(encoding="utf-8")
        root, x = yaml.compose(text, yaml.SafeLoader), yaml.safe_load(text)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        raise UsageError(f"{path}:{mark.line + 1}:{mark.column + 1}: {error.context or 'wrong here'}, {error.problem}") from None
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        reason = error.strerror if isinstance(error, OSError) else " ".join(str(error).split())
        raise UsageError(f"{path}: {reason}") from None
    if not isinstance(root, yaml.MappingNode):
        raise UsageError(f"{path}: no machine file: it needs `name`")
    sections = entries(path, root)
    if "name" not in sections:
        raise UsageError(f"{path}: no machine file: it needs `name`")
    for section, node in sections.items():
        if section == "name":
            continue
        if section not in SECTIONS:
            refuse(path, node, f"unknown section `{section}`{did_you_mean(section, list(SECTIONS))}")
        if not isinstance(node, yaml.MappingNode):
            refuse(path, node, f"`{section}` is no section")
        for key, value in entries(path, node, section + ".").items():
            found = parameter(path, key, value) if section == "drive" else None if section == "flux_map" else field(path, section, key, value)
            if found is not None:
                x[section][key] = found
    for section, keys in NEEDED.items():
        if section not in sections:
            raise UsageError(f"{path}: it needs the section `{section}`")
        for key in keys:
            if key not in x[section]:
                refuse(path, sections[section], f"{section}.{key} is needed, a number")
    if at_rest(x) < START * x["rated"]["i_rated_A"]:
        value, *remedy = too_little_at_rest(x)
        raise UsageError(f"{path}:{sections['rated'].start_mark.line + 1}: {value}", *remedy)
    for section in ("inverter", "sensor", "dclink", "drive"):
        x.setdefault(section, {})
    return x


def phase_V(x):
    """Most that the link gives a phase, peak, and its formula."""
    v = x["rated"]["v_dc_V"]
    return (v, "v_dc") if x.get("winding", {}).get("connection") == "open" else (v / math.sqrt(3), "v_dc/sqrt(3)")


def at_rest(x):
    """Current that the link drives through R_s, A."""
    return phase_V(x)[0] / x["electrical"]["R_s_ohm"]


def too_little_at_rest(x):
    """What, and what to do."""
    (v, formula), rated, R = phase_V(x), x["rated"], x["electrical"]["R_s_ohm"]
    needed = R * rated["i_rated_A"]
    return (f"rated.i_rated_A = {rated['i_rated_A']:g} takes {needed:.3g} V of a phase at rest, R_s i_rated; rated.v_dc_V = "
            f"{rated['v_dc_V']:g} gives {v:.3g} V, {formula}, which drives {at_rest(x):.3g} A",
            f"v_dc_V above {needed / v * rated['v_dc_V']:.3g}, or i_rated_A below {at_rest(x):.3g}; or is R_s_ohm that of two phases in "
            "series?")


def too_fast(x):
    """What, and what to do, where not even field weakening reaches rated speed without a load; None where it does."""
    (v, formula), rated = phase_V(x), x["rated"]
    i = x["drive"].get("i_fw_max", 0.5 * rated["i_rated_A"])
    psi, poles, omega = x["electrical"]["psi_m_Wb"], x["electrical"]["pole_pairs"], rated["speed_rated_rad_s"]
    weakened = min(psi, flux(x, -i, 0.0)[0][0])
    if weakened * poles * omega <= v:
        return None
    emf = psi * poles * omega
    return (f"rated.speed_rated_rad_s = {omega:g} has {emf:.3g} V of EMF in a phase, psi_m pole_pairs speed; rated.v_dc_V = "
            f"{rated['v_dc_V']:g} gives {v:.3g} V, {formula}, enough for {v / (psi * poles):.3g} rad/s, {v / (weakened * poles):.3g} with "
            f"i_fw_max = {i:g}, and less under load",
            f"v_dc_V well above {emf / v * rated['v_dc_V']:.3g}, or speed_rated_rad_s below {v / (psi * poles):.3g}")


def at_rated_speed(x):
    """(torque, phase voltage) of currents up to rated, at rated speed."""
    rated, e = x["rated"], x["electrical"]
    p, R, i_rated = e["pole_pairs"], e["R_s_ohm"], rated["i_rated_A"]
    omega = p * rated["speed_rated_rad_s"]
    for part in range(9):
        i_d = -i_rated * part / 10
        for of_rest in range(1, 21):
            i_q = math.sqrt(i_rated ** 2 - i_d ** 2) * of_rest / 20
            (psi_d, psi_q), _ = flux(x, i_d, i_q)
            yield 1.5 * p * (psi_d * i_q - psi_q * i_d), math.hypot(R * i_d - omega * psi_q, R * i_q + omega * psi_d)


def too_heavy(x):
    """What, and what to do, where the link leaves well less than the torque of rated current at rated speed; None where it does not."""
    (v, formula), rated = phase_V(x), x["rated"]
    points = list(at_rated_speed(x))
    torque = max(torque for torque, _ in points)
    left = max((torque for torque, needed in points if needed <= v), default=0.0)
    if left >= BEARS * torque:
        return None
    needed = min(needed for at, needed in points if at >= BEARS * torque)
    return (f"at rated.speed_rated_rad_s = {rated['speed_rated_rad_s']:g} rated.v_dc_V = {rated['v_dc_V']:g}, {v:.3g} V of a phase, {formula}, "
            f"leaves {100 * left / torque:.0f} % of the torque of rated current",
            f"v_dc_V of {needed / v * rated['v_dc_V']:.3g} for {BEARS:.0%} of it, or a load that is lighter there")


def warnings(x):
    """[(what, what to do)] of a link that is too low for the motor."""
    slow = [too_little_at_rest(x)] if at_rest(x) < x["rated"]["i_rated_A"] else []
    return slow + [told for told in [too_fast(x) or too_heavy(x)] if told]


def above(value, steps):
    """The first of a series of round numbers that is not below it."""
    exponent = math.floor(math.log10(value))
    return next(s * 10 ** e for e in (exponent, exponent + 1) for s in steps if s * 10 ** e >= value * (1 - 1e-9))


def dead_time(low, f_pwm):
    """Of a board that switches so often, and what it is."""
    return (0.5e-6, "MOSFET board") if low or f_pwm >= FAST_HZ else (2e-6, "IGBT module")


def trip_Hz(told):
    """Turns of the field a second at speed_trip."""
    return 1.5 * told["electrical", "pole_pairs"] * told["rated", "speed_rated_rad_s"] / (2 * math.pi)


def pwm(told, L):
    """Frequency and why. What dead time takes of a leg changes by 2 t_d f_pwm v_dc with its current's sign, and the observer must
    tell the EMF from it at the hand-over: where it would be more than that EMF, fewer periods are taken for a turn and more ripple,
    as few as control needs."""
    v, i = told["rated", "v_dc_V"], told["rated", "i_rated_A"]
    omega = told["electrical", "pole_pairs"] * told["rated", "speed_rated_rad_s"]
    low = v <= LOW_V
    turns_Hz = trip_Hz(told)
    board = max(20e3 if low else 10e3, PER_RISE * told["electrical", "R_s_ohm"] / L)
    wanted = max(board, PER_TURN * turns_Hz, v / (RIPPLE * i * L))
    least = max(board, LEAST_PER_TURN * turns_Hz)
    emf = tune.HAND_OVER * omega * told["electrical", "psi_m_Wb"]

    def lost(f):
        return 2 * dead_time(low, f)[0] * f * v

    first, last = (next((f for f in PWM_HZ if f >= x), PWM_HZ[-1]) for x in (least, wanted))
    able = [f for f in PWM_HZ if first <= f <= last]
    f = max((f for f in able if lost(f) <= emf), default=min(able, key=lost))
    if f == last:
        return f, f"{PER_TURN} periods of a turn of the field, {PER_RISE} of L / R, ripple below rated current"
    return f, (f"{last / 1e3:g} kHz would have less ripple, but dead time then takes {lost(last):.2g} V, "
               f"the EMF at the hand-over is {emf:.2g} V")


def in_blocks(x):
    """Block commutation is asked for."""
    return float(x["drive"].get("commutation", 0)) == 1


def pwm_in_blocks(told, L, C):
    """Frequency and why: the highest at which an open terminal has rung out within a third of a period."""
    v, i = told["rated", "v_dc_V"], told["rated", "i_rated_A"]
    turns_Hz = trip_Hz(told)
    board = 20e3 if v <= LOW_V else 10e3
    first, last = (next((f for f in PWM_HZ if f >= max(board, x)), PWM_HZ[-1])
                   for x in (LEAST_PER_TURN * turns_Hz, max(PER_TURN * turns_Hz, v / (RIPPLE * i * L))))
    able = [f for f in PWM_HZ if first <= f <= last]
    f = max((f for f in able if f * tune.ringing(L, C) <= tune.BLANK_MOST), default=first)
    return f, (f"{PER_TURN} periods of a turn of the field, ripple below rated current" if f == last else
               f"{last / 1e3:g} kHz would have less ripple, but an open terminal rings for {1e6 * tune.ringing(L, C):.0f} us")


def stored_F(x, v, i):
    """What takes the energy of a winding with i_max, which a bridge that opens gives back, up to v_dc_max: 3/2 L i^2 = C (v_max^2 - v^2)."""
    return 1.5 * max(inductances(x)) * (1.25 * i) ** 2 / (v ** 2 * (tune.LINK_MOST ** 2 - 1))


def complete(x):
    """What is not told of torque, inverter, sensors and link: {section: {key: (value, why)}}."""
    told = {(section, key): float(x[section][key]) for section, keys in NEEDED.items() for key in keys}
    v, i = told["rated", "v_dc_V"], told["rated", "i_rated_A"]
    poles = told["electrical", "pole_pairs"]
    low = v <= LOW_V
    L, C = min(inductances(x)), 2e-9 if low else 0.5e-9
    C = float(x["inverter"].get("c_leg_F", C))
    f_pwm, why = pwm_in_blocks(told, L, C) if in_blocks(x) else pwm(told, L)
    f_pwm = float(x["inverter"].get("f_pwm_Hz", f_pwm))
    if f_pwm < 4 * math.pi * trip_Hz(told):
        raise UsageError(f"{f_pwm / 1e3:g} kHz are {f_pwm / trip_Hz(told):.3g} periods of a turn of the field at speed_trip, 1.5 times "
                         "rated speed", f"the drive needs {4 * math.pi:.1f}, and has 60 kHz at most")
    scale = above(1.5 * v, (1, 1.2, 1.5, 2, 2.5, 3, 4, 4.5, 5, 6, 8))
    chosen = {
        "rated": {"torque_rated_Nm": (1.5 * poles * told["electrical", "psi_m_Wb"] * i, "1.5 pole_pairs psi_m i_rated")},
        "inverter": {
            "f_pwm_Hz": (f_pwm, why),
            "timer_counts": (round(TIMER_HZ / (2 * f_pwm)), "170 MHz timer, centre-aligned"),
            "dead_time_s": dead_time(low, f_pwm),
            "c_leg_F": (C, "output capacitance of a leg"),
            "v_switch_V": (0.0 if low else 1.0, "resistive" if low else "of a few amperes"),
            "v_diode_V": (0.0 if low else 1.0, "the channel conducts both ways" if low else "of a few amperes"),
            "r_on_ohm": (0.02 * v / i / 10 if low else 0.0, "0.2 % of the link at rated current" if low else "in the drop"),
        },
        "sensor": {
            "i_full_scale_A": (max(above(2.5 * i, (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8)), 0.1), "2.5 times rated; 0.1 A at least"),
            "v_full_scale_V": (scale, "1.5 times the link"),
            "noise_lsb": (0.5, "of 12 bits"),
            **({"v_leg_full_scale_V": (float(x["sensor"].get("v_full_scale_V", scale)), "as the link's channel")} if in_blocks(x) else {}),
        },
        "dclink": {
            "r_source_ohm": (0.002 * v / i, "0.2 % of the link at rated current"),
            "c_F": (above(max(20 * i / (v * f_pwm), 2 * stored_F(x, v, i), 1e-6), (1, 2.2, 4.7)),
                    "rated current for a period is 5 % of the link, and twice what bears the winding's energy; 1 uF at least"),
        },
    }
    if in_blocks(x) and C > 0:
        chosen["winding"] = {"r_winding_ohm": (tune.damping(L, C), f"core loss: an open terminal rings with Q = {tune.QUALITY:g}")}
    return {section: {key: (x.get(section, {}).get(key, value), "told" if key in x.get(section, {}) else why)
                      for key, (value, why) in keys.items()} for section, keys in chosen.items()}


def current(x, psi_d, psi_q):
    """(i_d, i_q) of the energy form that a machine file has, docs/pmsim.md, and their derivatives by the fluxes."""
    e = {key: float(value) for key, value in x["electrical"].items() if key != "pole_pairs"}
    c, s = e.get("c_A_Wb5", 0.0), psi_d ** 2 + psi_q ** 2
    i_f = e["psi_m_Wb"] / e["L_d0_H"] + c * e["psi_m_Wb"] ** 5
    i = psi_d / e["L_d0_H"] + c * psi_d * s * s - i_f, psi_q / e["L_q0_H"] + c * psi_q * s * s
    cross = 4 * c * s * psi_d * psi_q
    return i, (1 / e["L_d0_H"] + c * s * (s + 4 * psi_d ** 2), 1 / e["L_q0_H"] + c * s * (s + 4 * psi_q ** 2), cross)


def flux(x, i_d, i_q):
    """(psi_d, psi_q) of currents and (L_dh, L_qh, L_dqh) there: Newton, which a convex energy lets converge."""
    psi_d, psi_q = float(x["electrical"]["psi_m_Wb"]), 0.0
    for part in range(1, 41):  # step by step up to the current, each from the solution before
        for _ in range(8):
            (e_d, e_q), (a, b, cross) = current(x, psi_d, psi_q)
            e_d, e_q = i_d * part / 40 - e_d, i_q * part / 40 - e_q
            D = a * b - cross ** 2
            psi_d, psi_q = psi_d + (b * e_d - cross * e_q) / D, psi_q + (a * e_q - cross * e_d) / D
    a, b, cross = current(x, psi_d, psi_q)[1]
    D = a * b - cross ** 2
    return (psi_d, psi_q), (b / D, a / D, -cross / D)


def inductances(x):
    """L_d and L_q without current."""
    return flux(x, 0.0, 0.0)[1][:2]


def i_d_for(psi, L_d, L_q, i_q):
    """Of most torque per ampere, as the drive has it."""
    h = psi / (2 * (L_q - L_d)) if L_q > 1.01 * L_d else math.inf
    return h - math.hypot(h, i_q) if h < math.inf else 0.0


def saturation(x, told, L_d, L_q):
    """What rated current makes of the inductances: by c_A_Wb5, by L_q_rated of `drive:`, or nothing."""
    i, psi = float(x["rated"]["i_rated_A"]), float(x["electrical"]["psi_m_Wb"])
    L_d, L_q = told.get("L_d", L_d), told.get("L_q", L_q)
    if "L_q_rated" in told:
        why = "parabola through L_q and L_q_rated, whose slope falls three times as fast"
        L = {"L_qh_rated": max(4 * told["L_q_rated"] - 3 * L_q, 0.3 * told["L_q_rated"]), "L_dh_rated": L_d,
             "L_q_rated": told["L_q_rated"], "L_dqh_rated": 0.0, "cross_half": 0.0}
    elif float(x["electrical"].get("c_A_Wb5", 0.0)) > 0:
        why = "by c_A_Wb5, at rated current and most torque per ampere"
        (_, psi_q), (L_dh, L_qh, L_dqh) = flux(x, i_d_for(psi, L_d, L_q, i), i)
        half = flux(x, i_d_for(psi, L_d, L_q, i / 2), i / 2)[1]
        L = {"L_q_rated": psi_q / i, "L_dh_rated": L_dh, "L_qh_rated": L_qh, "L_dqh_rated": L_dqh, "cross_half": half[2] / half[1]}
    else:
        why = "no saturation is told: as without current"
        L = {"L_q_rated": L_q, "L_dh_rated": L_d, "L_qh_rated": L_q, "L_dqh_rated": 0.0, "cross_half": 0.0}
    return {name: (value, why) for name, value in L.items()}


def from_board(x, told, board):
    """Parameters that follow from inverter, link and sensor; what `drive:` tells of them stands."""
    def of(section, key):
        return float(x[section][key] if key in x.get(section, {}) else board[section][key][0])

    follow = {
        "f_pwm": of("inverter", "f_pwm_Hz"), "dead_time": of("inverter", "dead_time_s"), "v_dc_nominal": of("rated", "v_dc_V"),
        "device_drop": of("inverter", "v_switch_V"), "i_full_scale": of("sensor", "i_full_scale_A"),
        "v_full_scale": of("sensor", "v_full_scale_V"),
        "i_noise": of("sensor", "noise_lsb") * 2 * of("sensor", "i_full_scale_A") / tune.STEPS,
    }
    return {name: float(told.get(name, value)) for name, value in follow.items()}


def careful(known, tolerance):
    """L_q of a motor to whose flux saliency adds more than the magnet gives: at most what it has, though more was told. With more, the
    estimate lags, the rotor has less negative i_d, its flux falls and the estimate lags further (docs/methods_notes.md, 2.2.2)."""
    if (known["L_q"] - known["L_d"]) * known["i_rated"] < known["psi_m"]:
        return {}
    why = f"the motor's over 1 + {tolerance:g}: told too much of it, the flux observer loses the position"
    return {name: (max(known[name] / (1 + tolerance), known["L_d"]), why) for name in ("L_q", "L_q_rated")}


def two_bridges(x, machine, r_on):
    """What an open winding or two sets are told beside or otherwise; none of a star."""
    winding = x.get("winding", {})
    if winding.get("connection") == "open":
        return {"L_0": (float(winding["L_0_H"]), "of the zero sequence"),
                "R_s": (machine["R_s"][0] + r_on, "winding and two switches")}
    if int(winding.get("sets", 1)) < 2:
        return {}
    out = {name: (float(winding.get(key, 0.0)), "between the sets") for name, key in (("M_d", "M_d_H"), ("M_q", "M_q_H"))}
    for name, mutual in (("L_d", "M_d"), ("L_dh_rated", "M_d"), ("L_q", "M_q"), ("L_q_rated", "M_q"), ("L_qh_rated", "M_q")):
        out[name] = machine[name][0] + out[mutual][0], f"of both sets: {machine[name][1]}, and {mutual}"
    return out


OBSERVED = {"L_d": 2.2, "L_q": 2.2, "psi_m": 1.4}
ONE_BRIDGE = {"flying_start": (0.0, "a catch knows one bridge")}


def drive(x, board, tolerance):
    """`drive:` as {name: (value, why)}, what is told above what is chosen."""
    def of(section, key):
        return float(x[section][key] if key in x[section] else board[section][key][0])

    told = {name: float(value) for name, value in x["drive"].items()}
    L_d, L_q = inductances(x)
    machine = {
        "pole_pairs": (int(of("electrical", "pole_pairs")), "the motor's"),
        "R_s": (of("electrical", "R_s_ohm") + of("inverter", "r_on_ohm"), "winding and one switch"),
        "L_d": (L_d, "the motor's"), "L_q": (L_q, "the motor's" if L_q >= L_d else BELOW),
        "psi_m": (of("electrical", "psi_m_Wb"), "the motor's"),
        "i_rated": (of("rated", "i_rated_A"), "peak of a phase"),
        **saturation(x, told, L_d, L_q), "J": (of("mechanics", "J_kgm2"), "with what it turns"),
        "leg_capacitance": (of("inverter", "c_leg_F"), "the inverter's"),
        "speed_max": (1.25 * of("rated", "speed_rated_rad_s"), tune.WHY["speed_max"]),
    }
    bridges = two_bridges(x, machine, of("inverter", "r_on_ohm"))
    machine.update(bridges)
    known = {name: told.get(name, value) for name, (value, _) in machine.items()}
    known["commutation"] = told.get("commutation", 0)
    known["injection"] = told.get("injection", tune.SQUARE)
    known.update(from_board(x, {}, board))
    out = dict(machine)
    for name, value in tune.limits(known).items():
        out[name] = value, tune.WHY[name]
        known[name] = told.get(name, value)
    out["offset_max"] = 0.03 * known["i_full_scale"], "3 % of the converter's range"
    out.update((name, (value, tune.WHY[name])) for name, value in tune.values(known, tolerance=tolerance).items())
    out.update(careful(known, tolerance))
    if in_blocks(x):
        out["v_terminal_full_scale"] = of("sensor", "v_leg_full_scale_V"), "the sensor's"
        out["emf_shape"] = (1.0 if x.get("winding", {}).get("trapezoid_flat_deg") else 0.0), "the winding's; a sine if nothing is told"
    out["flying_start"] = 1.0, "a rotor that wind or its load turns is caught"
    if bridges:
        out.update(ONE_BRIDGE)
    if told.get("injection") in (carrier.ROTATING, carrier.PULSATING) and not SINE <= told.keys():
        out.update(sine(x, {**{name: value for name, (value, _) in out.items()}, **known, **told}))
    out.update((name, (value, "told")) for name, value in told.items())
    return {name: stored(name, *reason) for name, reason in out.items()}


SINE = {"v_injection", "f_injection", "injection_bandwidth"}


def sine(x, d):
    """Carrier and loops of sine injection, by the errors that are predicted for twelve carriers (pmdrive/carrier.py)."""
    d = {**d, "injection": int(d["injection"])}
    omega = 0.05 * float(x["rated"]["speed_rated_rad_s"]) * d["pole_pairs"]

    def make(parameters, way, inverter):
        return carrier.Holds(parameters, lambda a, b: current(x, a, b)[0], lambda a, b: flux(x, a, b)[0],
                             float(x["electrical"]["R_s_ohm"]), way * omega, inverter=inverter)

    loop, errors, pick = carrier.grid(make, d, tune.largest_carrier(d))
    if pick is None:
        raise UsageError(f"no carrier of {carrier.NAMES[d['injection']]} holds rated current of this motor",
                         "the square wave, injection: 0, has no window that a load could upset")
    why = (f"least flux of the carrier of 12 that hold {carrier.MARGIN:g} times rated current within {carrier.ERROR_DEG:g} degrees: "
           f"{errors[pick]:.1f} predicted")
    behind = tune.LAG * (2 * math.pi * loop) ** 2 / d["pole_pairs"]
    return {"v_injection": (pick[0], why), "f_injection": (pick[1], why),
            "injection_bandwidth": (loop, "the fastest of 15, 10 and 7 Hz that a carrier holds rated current with"),
            "speed_bandwidth": (min(d["speed_bandwidth"], loop / carrier.SLOWER), "a quarter of the position's loop"),
            "acceleration": (min(d["acceleration"], behind), "the position's loop follows 0.12 rad behind")}


def stored(name, value, why):
    """As the drive keeps it: four digits in whole steps, within its range. What the observers count with may be off by so much."""
    if why == "told":
        return value, why
    entry = names.find(name)
    raw = entry.raw(Decimal(repr(float(f"{value:.4g}"))))
    within = min(max(raw, entry.least), entry.most)
    if name in OBSERVED and not 1 / OBSERVED[name] <= within / raw <= OBSERVED[name]:
        raise UsageError(f"{name} is {value:.4g} {entry.unit}, and the drive's reaches from {float(entry.least * entry.scale):g} to "
                         f"{float(entry.most * entry.scale):g}", "the drive counts with it, and does not run this motor")
    return float(within * entry.scale), why if within == raw else why + ("; no less" if within > raw else "; no more") + " is stored"


def plain(value):
    """Four digits, as YAML takes them for a number."""
    if isinstance(value, (str, bool, list, dict)):
        return yaml.safe_dump(value, default_flow_style=True).strip().removesuffix("...").strip()
    text = f"{value:.5g}"
    return text if "e" not in text or "." in text.split("e")[0] else text.replace("e", ".0e")


def text_of(x, tolerance=tune.TOLD):
    """The whole machine file."""
    board = complete(x)
    chosen = {**board, "drive": drive(x, board, tolerance)}
    lines = [f"# {x['name']}: completed by tools/tune.py from what the motor's data are; `told` stood in the file.",
             f"name: {plain(x['name'])}"]
    for section in sorted(set(x) | set(chosen), key=lambda s: OTHERS.index(s) if s in OTHERS else len(OTHERS)):
        if section == "name":
            continue
        if not isinstance(x.get(section, {}), dict):
            lines += ["", f"{section}: {plain(x[section])}"]
            continue
        lines += ["", f"{section}:"]
        entries = {key: (value, "told") for key, value in x.get(section, {}).items()}
        entries.update(chosen.get(section, {}))
        for key, (value, why) in entries.items():
            try:
                value = float(value)
            except (TypeError, ValueError):
                pass
            lines.append(f"  {key + ': ' + plain(value):32} # {why}")
    return "\n".join(lines) + "\n"


def main():
    description, _, rest = __doc__.partition("\n\n")
    parser = argparse.ArgumentParser(description=description, epilog=rest, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("machine", help="file with the motor's values")
    parser.add_argument("-o", "--out", help="file to be written; not there yet")
    parser.add_argument("--tolerance", type=float, default=tune.TOLD, metavar="SHARE",
                        help="by which each of R, L_d, L_q, psi_m and J may be off: %(default)s as on a data sheet, "
                             f"{tune.MEASURED} where they were measured; below it less saliency is enough for a start by pulses")
    arguments = parser.parse_args()
    try:
        if not 0 <= arguments.tolerance <= 0.5:
            raise UsageError(f"--tolerance {arguments.tolerance:g}: a share from 0 to 0.5")
        x = read(arguments.machine)
        text = text_of(x, arguments.tolerance)
        for what, remedy in warnings(x):
            print(f"warning: {arguments.machine}: {what}\n  {remedy}", file=sys.stderr)
        if arguments.out is not None:
            with open(arguments.out, "x", encoding="utf-8") as file:
                file.write(text)
            text = f"{arguments.out}: run it with\n  pmsim run tests/unit/tune/start.yaml --set machine={arguments.out}\n"
        sys.stdout.write(text)
        sys.stdout.flush()
    except UsageError as error:
        print(f"tools/tune.py: {error}", file=sys.stderr)
        return 2
    except FileExistsError:
        print(f"tools/tune.py: {arguments.out} is there already; nothing was written", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"tools/tune.py: {error.filename or 'standard output'}: {error.strerror}", file=sys.stderr)
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is left there is not tried again at the end
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
