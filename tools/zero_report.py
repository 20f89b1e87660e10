"""Section of docs/results/injection.md on motors whose star point is led out: sources that look at the voltage there beside those that
look at currents, on both machines. Made and checked by tools/injection_report.py."""

import math
import random

import observer_report as common
from campaigns.draw import factors
from observer_report import count_lost, degrees, table, worst_of

HEADING = "## Voltage at the neutral beside currents"
SPEED = 0.05
LOADS = [0, 0.5, 1]
TURNS = [1, -1]
RC_S = 100e-6
PERIOD_S = 100e-6
BITS = 12
NOISE = 0.5  # LSB
STEP = math.sqrt(NOISE ** 2 + 1 / 12)  # rms of a sample, LSB
# V_h, V; full scale of the neutral and of the currents; dL_0, L_d, L_q, H
MACHINES = {"IPM-1000": {"V": 35, "range": 10, "I": 10, "dL_0": 2e-3, "L_d": 43e-3, "L_q": 75e-3},
            "SPM-400": {"V": 8, "range": 2, "I": 10, "dL_0": 0.3e-3, "L_d": 3e-3, "L_q": 3.3e-3}}
# name, source, Hz, position loop and speed control, Hz: the loops that the file of the source is compared with, and
# the square wave's for all that can have them
SOURCES = [("pulsating_sine", 4, 500, 15, 4), ("rotating_sine", 1, 500, 12, 3), ("pulsating_square", 0, 500, 20, 3),
           ("zero_anti_rotating", 7, 500, 7, 2), ("zero_anti_rotating", 7, 500, 20, 3), ("zero_rotating", 8, 500, 20, 3),
           ("zero_anti_rotating", 7, 5000, 20, 3)]
NEUTRAL = 7  # from this source on
RATED = {"IPM-1000": ", L_dh_rated: 42.55e-3*$set_L_d, L_qh_rated: 57.32e-3*$set_L_q",
         "SPM-400": ", L_dh_rated: 2.9943e-3*$set_L_d, L_qh_rated: 3.2880e-3*$set_L_q"}
TURNING = f"""  - {{t_s: 0.0, mode: speed, speed_rel: {SPEED}*$turn, enable: true}}
  - {{t_s: 1.5, load_rel: $load*$turn, ramp_s: $ramp}}
  - {{t_s: $back, speed_rel: -{SPEED}*$turn}}"""


class Neutral(common.Study):
    """A study of a source on a machine whose star point is led out."""

    parameter = "injection"

    def __init__(self, machine, cases, start_s, end_s, drive=""):
        m = MACHINES[machine]
        usual = {"load": 0, "ramp": 0.3, "back": 100, "turn": 1, "bits": BITS, "noise": NOISE,
                 **{f"{kind}{x}": 0 for kind in "gn" for x in "abc"}}
        cases = [(name, {**usual, **values}) for name, values in cases]
        sections = (f"sensor: {{bits: $bits, noise_lsb: $noise, gain_error: [$ga, $gb, $gc], v_zero_full_scale_V: {m['range']}, "
                    f"v_zero_filter_s: {RC_S}, v_zero_noise_lsb: $noise, v_zero_network_ohm: 10000, "
                    f"v_zero_network_error: [$na, $nb, $nc]}}\nwinding: {{dL_0_H: {m['dL_0']}}}")
        drive = f"v_injection: {m['V']}, " + (drive or f"dL_0: {m['dL_0']}")
        super().__init__(machine, TURNING, cases, start_s, end_s, drive, sections)

    def settings(self, method, others):
        return [*super().settings(method, others), "start_method=1"]


def both_ways(name="", **values):
    return [(f"{name} {turn}", {**values, "turn": turn}) for turn in TURNS]


def steady(machine):
    cases = [case for load in LOADS for case in both_ways(f"load {load}", load=load)]
    cases += both_ways("10 bits", bits=10) + both_ways("noise", noise=4 * NOISE)
    return Neutral(machine, cases, 3.0, 4.0)


def step(machine):
    return Neutral(machine, both_ways(load=0.5, ramp=0), 1.4, 3.0)


def reversal(machine):
    return Neutral(machine, both_ways(back=2.0), 1.9, 3.5)


def machines(machine, count, resistors):
    """R_s, psi_m, dL_0 and the inductances told wrong by up to 10 %, each for itself but for those of SPM-400, of which the
    drive refuses L_q below L_d; gains of the current sensors off by up to 1 %, resistors of the star by up to `resistors`."""
    draw = random.Random(11)
    cases = []
    for n in range(count):
        wrong = factors(draw, ("R", "L_d", "L_q", "psi", "dL"), 0.1)
        if machine == "SPM-400":
            wrong["L_d"] = wrong["L_q"]
        channels = {f"g{x}": draw.uniform(-0.01, 0.01) for x in "abc"}
        channels.update({f"n{x}": resistors * draw.uniform(-1, 1) for x in "abc"})
        turn = TURNS[n % 2]
        cases.append((f"machine {n}", {**{f"set_{key}": 1 / x for key, x in wrong.items()}, **channels, "turn": turn,
                                       "load": 0.5}))
    drive = f"{common.told(machine)}{RATED[machine]}, dL_0: {MACHINES[machine]['dL_0']}*$set_dL"
    return Neutral(machine, cases, 1.4, 2.3, drive)


def own_settings(f_Hz, loop_Hz, control_Hz):
    return [f"f_injection={f_Hz}", f"injection_bandwidth={loop_Hz}", f"speed_bandwidth={control_Hz}"]


def measure(pool, count):
    """(machine, source) -> study -> results."""
    jobs = {}
    for machine in MACHINES:
        for source in SOURCES:
            _, n, *own = source
            studies = {"steady": steady(machine), "step": step(machine), "reversal": reversal(machine),
                       "one": machines(machine, count, 0.01)}
            if n >= NEUTRAL:
                studies["tenth"] = machines(machine, count, 0.001)
            jobs[machine, source] = {key: (study, study.submit(pool, n, own_settings(*own))) for key, study in studies.items()}
    results = {}
    for key, parts in jobs.items():
        results[key] = {name: study.result(job) for name, (study, job) in parts.items()}
        if any(r is None for r in results[key].values()):
            common.fail(f"the drive refuses {key[1][0]} for {key[0]}")
        print(f"{key[0]}: {key[1][0]}, {key[1][2]} Hz, loop {key[1][3]} Hz", flush=True)
    return results


def first_cell(machine, source):
    name, n, f_Hz, loop_Hz, _ = source
    f_Hz = 5000 if n == 0 else f_Hz  # both halves of a PWM cycle
    return f"{machine}, `{name}`, {f_Hz} Hz, loop {loop_Hz} Hz"


def kept(results):
    alive = [r for r in results if not r.lost]
    lost = count_lost(results)
    if not alive:
        return f"{lost} lost"
    return f"{lost} lost, {degrees(max((r.mean for r in alive), key=abs))}, {degrees(max(r.largest for r in alive))}"


def noise_ratio(m, omega):
    """By formula: position noise at the neutral over that by current, of a sine."""
    a = math.exp(-PERIOD_S / RC_S)
    g = math.hypot(1 - a * math.cos(omega * PERIOD_S), a * math.sin(omega * PERIOD_S)) / (1 - a)
    s_v, s_i = m["range"] / 2048 * STEP, math.sqrt(2 / 3) * m["I"] / 2048 * STEP
    K, L_sa = (m["L_q"] - m["L_d"]) / 2, (m["L_q"] + m["L_d"]) / 2
    return s_v * g / s_i * 2 * K / (omega * m["dL_0"] * L_sa)


def network_deg(m):
    """By formula: swing of the position when one resistor of the star is 1 % too large and one too small."""
    L_sa = (m["L_q"] + m["L_d"]) / 2
    A = m["dL_0"] * m["V"] * L_sa / (2 * m["L_d"] * m["L_q"])
    return math.degrees(0.01 / math.sqrt(3) * m["V"] / (2 * A))


def formulas():
    body = []
    for machine, m in MACHINES.items():
        K, L_sa = (m["L_q"] - m["L_d"]) / 2, (m["L_q"] + m["L_d"]) / 2
        D = m["L_d"] * m["L_q"]
        omega = 2 * math.pi * 500
        body.append([machine, f"{K / L_sa:.2f}", f"{m['dL_0'] / K:.2g}", f"{1e3 * m['V'] * K / (omega * D):.0f} mA",
                     f"{m['dL_0'] * m['V'] * L_sa / (2 * D):.2f} V", f"{noise_ratio(m, omega):.3f}",
                     f"{network_deg(m):.1f}"])
    return table(["machine", "K / L_sa", "dL_0 / K", "answer as a current", "as a voltage", "noise of the position, voltage over current",
                  "star of resistors +-1 %: swing, deg"], body)


def figure(results, machine, name, key, place):
    """Of the source of that name whose loop is the first of the list."""
    source = next(s for s in SOURCES if s[:3] == name)
    return worst_of(results[machine, source][key][place:place + 2])


def words(results):
    sine, zero = ("pulsating_sine", 4, 500), ("zero_anti_rotating", 7, 500)
    square, zero_square = ("pulsating_square", 0, 500), ("zero_anti_rotating", 7, 5000)
    lines = []
    for machine, m in MACHINES.items():
        r = {key: figure(results, machine, name, "steady", 0) for key, name in
             (("sine", sine), ("zero", zero), ("square", square), ("zero square", zero_square))}
        ten = {key: figure(results, machine, name, "steady", 2 * len(LOADS)) for key, name in
               (("square", square), ("zero square", zero_square))}
        lines.append(f"- {machine}, dL_0 / K = {2 * m['dL_0'] / (m['L_q'] - m['L_d']):.2g}: rms without load {r['sine'].one('rms')} by the "
                     f"current of a sine and {r['zero'].one('rms')} at the neutral, {r['square'].one('rms')} and "
                     f"{r['zero square'].one('rms')} with a square wave; with converters of 10 bits {ten['square'].one('rms')} and "
                     f"{ten['zero square'].one('rms')}.")
    return "\n".join(lines) + "\n"


def section(results, count):
    heads = [*(f"{100 * load:.0f} %" for load in LOADS), "10 bits, 0 %", "noise 2 LSB, 0 %", "load step", "reversal"]
    body, drawn = [], []
    for (machine, source), r in results.items():
        pairs = [worst_of(r["steady"][k:k + 2]) for k in range(0, len(r["steady"]), 2)]
        first = first_cell(machine, source)
        body.append([first, *map(str, pairs), worst_of(r["step"]).one("largest"), worst_of(r["reversal"]).one("largest")])
        drawn.append([first, kept(r["one"]), kept(r["tenth"]) if "tenth" in r else "-"])
    return "\n".join([
        HEADING + "\n",
        f"Motors whose star point is led out, and a board that measures it against a star of three resistors (docs/board.md) behind an "
        f"RC of {1e6 * RC_S:.0f} us. {100 * SPEED:.0f} % speed, free rotor under speed control, load against the rotation, carriers of "
        + " and ".join(f"{m['V']} V on {machine}" for machine, m in MACHINES.items())
        + "; worst of both directions: mean, rms, largest. 10 bits and noise are those of all converters. Sources that begin with "
          "`zero` look at the neutral, the others at currents.\n",
        table(["source", *heads], body),
        "By formula, at 500 Hz, converters of 12 bits with half a step of noise (`tests/unit/drive/carrier_noise_test.cpp` proves the ratio "
        "on the plant):\n",
        formulas(),
        f"{count} random machines, half load within 0.3 s: R_s, psi_m, dL_0 and inductances told wrong by up to 10 %, gains of the current "
        "sensors off by up to 1 %; resistors of the star off by up to 1 %, or by 0.1 %, as `pmdrive identify --only neutral` leaves them or bought so. "
        "Lost, largest mean error, largest error:\n",
        table(["source", "resistors 1 %", "resistors 0.1 %"], drawn),
        "What decides is dL_0 / K: the answer of the currents goes with K, the difference of L_d and L_q, that of the neutral with dL_0, how "
        "far mutual and own inductances differ in what the position makes of them. And the neutral is a voltage of "
        "the instant: it does not get smaller with the carrier's frequency.\n",
        words(results),
        "- The neutral is the better source where the currents show little saliency, with coarse converters, with a loop as quick "
        "as 20 Hz by a sine, and under load, as the measured form knows nothing of the machine but dL_0 and L_c0.\n"
        "- Currents are the better source where the rotor cannot turn for the board's resistors to be found (1 % in the star cost what the "
        "table says), "
        "where the star point is not led out, and where |dL_0| leaves less than 0.1 % of the base of voltages, which is refused.\n",
    ])


def probes():
    """No load, every source: what common.check() wants."""
    out = []
    for machine in MACHINES:
        for source in SOURCES:
            _, n, *own = source
            out.append(common.Probe(HEADING, "0 %", first_cell(machine, source), steady(machine), n,
                                    [f"load 0 {turn}" for turn in TURNS], own_settings(*own)))
    return out
