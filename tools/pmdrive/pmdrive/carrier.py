"""Where injection holds: noise of the position by quantisation (METHODS.md 5.8.1, row 65), and whether the loop of position, window
and currents is stable at a load (5.8.2, row 66), from the machine, the converter and the bandwidths.

The noise has a formula, noise_deg(). For the loop there is none: when the frame oscillates at half of f_h, the fundamental current
in it does too, the window over a whole period of the carrier passes two thirds of that as an answer, and the position loop turns the
frame by it. This second loop grows with i_f / I_n and the bandwidth over f_h; a low-pass in the error signal weakens it
(injection/sine.h). So the loop is run, a sample a period, as the drive has it: position loop, window, low-pass, current control, delay of 1.5 periods,
cross-coupling by the parabolas of injection/saliency.h, speed control; on the machine by its fluxes and its inertia, without converter,
and without the inverter unless it is asked for. Holds.run() begins 5 degrees off and ends within LOST of a position or does not.
"""
import cmath
import math

SQUARE, ROTATING, PULSATING, STATIONARY = 0, 1, 4, 5  # numbers of injection/injections.def
NAMES = {SQUARE: "pulsating_square", ROTATING: "rotating_sine", PULSATING: "pulsating_sine", STATIONARY: "stationary_sine"}
SEQUENCES = (ROTATING, STATIONARY)  # their answer is I_n e^{j 2 theta}
ZETA = 0.9
GAIN_RISE = 2.5
KICK = math.radians(5)
STAR = [cmath.exp(2j * math.pi * x / 3) for x in range(3)]
LOST = {SQUARE: math.radians(2), ROTATING: math.radians(3), PULSATING: math.radians(2),
        STATIONARY: math.radians(4)}  # that a held position swings by at the end at most; for dead time a rotating carrier does by 2, one that stands by 3
OFF = math.radians(15)   # and is away at most
SETTLE_S, SEEN_S = 1.0, 0.2


def periods(d):
    """N of a sine; of the square wave two."""
    return 2 if d["injection"] == SQUARE else round(d["f_pwm"] / d["f_injection"])


def flux_of(d):
    """F: flux amplitude of the carrier at the samples."""
    T = 1 / d["f_pwm"]
    return d["v_injection"] * T if d["injection"] == SQUARE else d["v_injection"] * T / (2 * math.sin(math.pi / periods(d)))


def slope_across(L, F):
    L_d, L_q, L_dq = L
    return F * (L_q - L_d + 2 * L_dq ** 2 / L_q) / (L_d * L_q - L_dq ** 2)


def slope_sequence(L, F):
    L_d, L_q, L_dq = L
    return 2 * F * math.hypot((L_q - L_d) / 2, L_dq) / (L_d * L_q - L_dq ** 2)


def common(L, F):
    """I_p, the same for all positions."""
    L_d, L_q, L_dq = L
    return F * (L_d + L_q) / 2 / (L_d * L_q - L_dq ** 2)


def parabola(half, full, rated):
    """a, b of i (a + b |i|) through both."""
    return (4 * half - full) / rated, 2 * (full - 2 * half) / rated ** 2


def i_d_of(d, i_q):
    """For most torque per ampere, as the drive has it."""
    if d["L_q"] <= 1.01 * d["L_d"]:
        return 0.0
    h = d["psi_m"] / (2 * (d["L_q"] - d["L_d"]))
    return h - math.hypot(h, i_q)


def rated_i_q(d):
    """That part of rated current."""
    low, high = 0.0, d["i_rated"]
    for _ in range(30):
        i_q = 0.5 * (low + high)
        low, high = (i_q, high) if math.hypot(i_d_of(d, i_q), i_q) < d["i_rated"] else (low, i_q)
    return low


def lost_V(d):
    """Of a leg, by dead time and drops."""
    return d["dead_time"] * d["f_pwm"] * d["v_dc_nominal"] + d["device_drop"]


def _leg(i, x):
    return (i * STAR[x].conjugate()).real


class Known:
    """What the drive makes of its parameters, as injection/saliency_config.c does."""

    def __init__(self, d):
        zero, rated = (d["L_d"], d["L_q"], 0.0), (d["L_dh_rated"], d["L_qh_rated"], d["L_dqh_rated"])
        F, i = flux_of(d), d["i_rated"]
        slope = slope_sequence if d["injection"] in SEQUENCES else slope_across
        self.i_p = common(zero, F)
        self.i_p_2 = (common(rated, F) - self.i_p) / i ** 2
        self.F, self.slope_0 = F, slope(zero, F)
        slope_r = slope(rated, F)
        self.sees = self.slope_0 > 0 and slope_r > 0
        self.gain_0 = 1 / self.slope_0 if self.sees else 0.0
        gain_r = min(1 / slope_r, GAIN_RISE * self.gain_0) if self.sees else 0.0
        self.gain_2 = (gain_r - self.gain_0) / i ** 2
        quarter = [(3 * a + b) / 4 for a, b in zip(zero, rated)]
        half = (quarter[0], quarter[1], d["cross_half"] * quarter[1])
        self.lam = parabola(d["cross_half"], rated[2] / rated[1], i)
        self.turn = parabola(*(0.5 * math.atan2(-L[2], (L[1] - L[0]) / 2) for L in (half, rated)), i)

    def gain(self, i_q):
        return self.gain_0 + self.gain_2 * i_q ** 2

    def of(self, pair, i_q):
        return i_q * (pair[0] + pair[1] * abs(i_q))


def low_pass(d):
    """w_s of injection/sine.h."""
    of_loop, of_carrier = 4 * d["injection_bandwidth"], d["f_pwm"] / periods(d) / 8
    return 2 * math.pi * (d.get("injection_filter") or max(of_loop, of_carrier))


def noise_band_Hz(d):
    """Two-sided noise bandwidth of the loop with its low-pass: times a period, the share of white noise of a sample that is left."""
    w_n = 2 * math.pi * d["injection_bandwidth"]
    k_p, k_i = 2 * ZETA * w_n, w_n ** 2
    return (k_p ** 2 + k_i) / (2 * (k_p - (0 if d["injection"] == SQUARE else k_i / low_pass(d))))


def noise_deg(d, noise_lsb=0.5, bits=12, slope=None):
    """rms of the position by noise and quantisation of the converter, electrical degrees: of a sample's error signal
    (I_qu / slope) sqrt(8/3 (sigma^2 + 1/12)) for a sine of N samples, of which the window leaves 1 / N at frequencies of the loop,
    so the rest is as of white noise per sample; slope: 2 I_n."""
    step = 2 * d["i_full_scale"] / 2 ** bits
    slope = Known(d).slope_0 if slope is None else slope
    sigma2 = (2 / 3) * (noise_lsb ** 2 + 1 / 12)          # of alpha or beta, of three legs, LSB^2
    weight = {SQUARE: 4.0, ROTATING: 1.0, PULSATING: 2.0, STATIONARY: 2.0}[d["injection"]]
    # low frequencies of h: the square's second difference has gain 2 there; of a sine demodulated with 2 sin, 2 of the power;
    # a sequence takes both axes with half of it each
    return math.degrees(step / slope * math.sqrt(sigma2 * weight * noise_band_Hz(d) / d["f_pwm"]))


class Holds:
    """d: the drive's parameters in SI; current: (psi_d, psi_q) -> (i_d, i_q); flux: (i_d, i_q) -> (psi_d, psi_q); R, of the
    machine; omega: electrical speed."""

    def __init__(self, d, current, flux, R, omega, gain=1.0, inverter=False):
        self.d, self.current, self.flux, self.R, self.omega, self.gain = d, current, flux, R, omega, gain
        self.known = Known(d)
        self.lost_V = lost_V(d) if inverter else 0.0
        self.corner_A = d["leg_capacitance"] * d["v_dc_nominal"] / d["dead_time"] if inverter and d["dead_time"] else 0.0

    def taken(self, i_s, i_f):
        """What dead time and leg capacitance take of the voltage, beyond the compensation by the fundamental current."""
        return self.lost_V * 2 / 3 * sum((self.part(_leg(i_s, x)) - self.told(_leg(i_f, x))) * STAR[x] for x in range(3))

    def turned(self, positive, i_f):
        """Of a rotating sine, at 1 kHz: the phase of the answer by resistance, positive sequence and cross-coupling."""
        d, k = self.d, self.known
        kappa = (d["L_q"] - d["L_d"]) / (d["L_q"] + d["L_d"])
        rho = d["R_s"] / 2 * (1 / d["L_d"] + 1 / d["L_q"]) * periods(d) / (2 * math.pi * d["f_pwm"])
        if d.get("injection_post_comp", 1) and positive:
            beyond = cmath.phase(positive) - rho * (1 + kappa ** 2)
            load = abs(i_f) ** 2 / (abs(i_f) ** 2 + k.i_p ** 2)
            share = 0.75 + ((1 / (2 * kappa) - 0.75) * load if kappa >= 0.1 else 0.0)
            most = 1.25 * lost_V(d) / d["v_injection"] + rho / 2
            rho += max(-most, min(most, share * beyond))
        return cmath.exp(2j * (rho - k.of(k.turn, i_f.imag)))

    def told(self, i):
        """As the drive compensates; of a rotating sine within a zone of three times I_p."""
        if self.d["injection"] != ROTATING:
            return self.part(i)
        return max(-1.0, min(1.0, i / (3 * self.known.i_p)))

    def part(self, i):
        size, corner = abs(i), self.corner_A
        share = size / (2 * corner) if size < corner else 1 - corner / (2 * size) if size else 0.0
        return math.copysign(share, i)

    def share(self):
        """Of the bandwidth of current control while the source leads."""
        N, T = periods(self.d), 1 / self.d["f_pwm"]
        most = self.d["f_pwm"] / 20 if self.d["injection"] == SQUARE else 0.4 / (2 * math.pi * (N + 2) / 2 * T)
        return min(1.0, most / self.d["current_bandwidth"])

    def run(self, i_q):
        """(holds, mean, largest error, rad) at the current i_q and its i_d for most torque, which a load of that torque asks for."""
        d, k = self.d, self.known
        T, N, R = 1 / d["f_pwm"], periods(d), d["R_s"]
        i_ref = complex(i_d_of(d, i_q), i_q)
        w_c = 2 * math.pi * d["current_bandwidth"] * self.share()
        w_n = 2 * math.pi * d["injection_bandwidth"]
        kp, ki = 2 * ZETA * w_n, w_n ** 2 * T
        psi = complex(*self.flux(i_ref.real, i_ref.imag))
        smooth = low_pass(d) * T / (1 + low_pass(d) * T)
        low = 0.0
        theta, theta_hat, omega_hat = 0.0, -KICK, self.omega
        psi_s = psi
        rotor = 1.0 + 0j
        past, past_delta = i_ref, 0j
        buffer, at = [i_ref] * N, 0
        total = i_ref * N
        integral = R * i_ref
        omega = omega_ref = self.omega
        P, J = d["pole_pairs"], d["J"]
        load = 1.5 * P * (psi.conjugate() * i_ref).imag
        k_s = 2 * math.pi * d["speed_bandwidth"] * J / (1.5 * P * P * d["psi_m"])
        sum_s = i_q
        slow = round(d["f_pwm"] / 1000)
        v_acting = (R * i_ref + 1j * self.omega * psi) * rotor
        a = 2 * math.pi / N
        turn_of = [cmath.exp(1j * (n * a - 1.5 * a - math.pi / 2)) for n in range(N)]
        turn = self.turned(0j, i_ref)
        cosine = sine = 0j
        stands = d["injection"] == STATIONARY  # along alpha
        i_p, delta, tau = k.i_p, 0.0, (N - 1) / 2 * T
        errors = []
        for n in range(round(SETTLE_S / T)):
            rotor = cmath.exp(1j * theta)
            in_rotor = psi_s / rotor
            i_s = complex(*self.current(in_rotor.real, in_rotor.imag)) * rotor
            frame = cmath.exp(1j * theta_hat)
            i_hat = i_s / frame
            error = math.remainder(theta - theta_hat, 2 * math.pi)
            if abs(error) > 1.0:
                return False, error, abs(error)
            if d["injection"] == SQUARE:
                delta = (i_s - past) / frame / 2
                sign = 1.0 if n % 2 else -1.0  # of two periods ago, and of the next
                x = (delta - past_delta) * sign
                i_f = (i_s + past) / frame / 2
                past, past_delta = i_s, delta
                lam = k.of(k.lam, i_f.imag) + omega_hat * T / 2
                eps = (x.imag + lam * x.real) * k.gain(i_f.imag)
                carrier = d["v_injection"] * sign
            else:
                e = turn_of[at]
                if stands:
                    i_hat = (i_s - i_p * (e * cmath.exp(-1j * delta)).real) / frame
                change = i_hat - buffer[at]
                buffer[at] = i_hat
                total += change
                cosine += change * e.real
                sine += change * e.imag
                i_f = total / N
                c, s = cosine / N, sine / N
                if d["injection"] == PULSATING:
                    delta = max(-0.7, min(0.7, math.atan2(s.real, c.real)))
                    x = 2 * (c * math.cos(delta) + s * math.sin(delta))
                    eps = (x.imag + k.of(k.lam, i_f.imag) * x.real) * k.gain(i_f.imag)
                    carrier = d["v_injection"] * math.cos(at * a)
                elif stands:
                    y = 2 * (c * math.cos(delta) + s * math.sin(delta))
                    if n % slow == 0 and n > N:
                        whole = [i_p * part + 2 * (x * frame).real for part, x in ((math.cos(delta), c), (math.sin(delta), s))]
                        delta = max(-0.7, min(0.7, math.atan2(whole[1], whole[0])))
                        i_p = (k.i_p + k.i_p_2 * i_f.imag ** 2) * math.cos(delta)
                        turn = cmath.exp(1j * (omega_hat * tau - 2 * k.of(k.turn, i_f.imag)))
                    eps = (y / frame * turn).imag * k.gain(i_f.imag)
                    carrier = d["v_injection"] * math.cos(at * a)
                else:
                    negative, positive = c + 1j * s, c - 1j * s
                    if n % slow == 0:
                        turn = self.turned(positive, i_f)
                    eps = (negative * turn).imag * k.gain(i_f.imag)
                    carrier = d["v_injection"] * cmath.exp(1j * at * a)
                at = (at + 1) % N
            if n < N + 2:
                eps = 0.0
            if d["injection"] != SQUARE:
                low += smooth * (eps - low)
                eps = low
            eps *= self.gain
            omega_hat += ki * eps
            w = omega_hat + kp * eps
            e_i = i_ref - i_f
            integral += w_c * R * T * e_i
            v = complex(w_c * d["L_d"] * e_i.real, w_c * d["L_q"] * e_i.imag) + integral
            v += 1j * omega_hat * complex(d["L_d"] * i_f.real + d["psi_m"], d["L_q"] * i_f.imag)
            ahead = cmath.exp(1j * (theta_hat + 1.5 * omega_hat * T))
            omega += T * P / J * (1.5 * P * (psi_s.conjugate() * i_s).imag - load)
            if n % slow == 0:
                e_s = omega_ref - omega_hat
                sum_s += k_s * 2 * math.pi * d["speed_bandwidth"] / 4000 * e_s
                i_q_ref = k_s * e_s + sum_s
                i_ref = complex(i_d_of(d, i_q_ref), i_q_ref)
            lost = self.taken(i_s, i_f * frame) if self.lost_V else 0.0
            psi_s += T * (v_acting - self.R * i_s - lost)
            v_acting = v * ahead + carrier * (1.0 if stands else ahead)
            theta += omega * T
            theta_hat += w * T
            if n * T > SETTLE_S - SEEN_S:
                errors.append(error)
        mean = sum(errors) / len(errors)
        swing = max(abs(e - mean) for e in errors)
        return swing < LOST[d["injection"]] and abs(mean) < OFF, mean, max(map(abs, errors))

    def boundary(self, most, way=1, step=0.05):
        """The current up to which it holds, the field turning with omega and the load against it: A; `most` where it holds there."""
        low, high = 0.0, most
        if self.run(way * most)[0]:
            return most
        while high - low > step:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.run(way * middle)[0] else (low, middle)
        return low


SHARES = (1 / 4, 1 / 2, 3 / 4)        # of the largest carrier that the link leaves room for
PERIODS = (8, 10, 20, 30)             # N
PERIODS_POLE = 16                     # least that the drive finds the pole with by the second harmonic, polarity: 3
LOOPS_HZ = (15.0, 10.0, 7.0)
SLOWER = 4.0                          # speed control than the position
ERROR_DEG = 3.0                       # largest error that is accepted: METHODS.md 5.8.3
MARGIN = 1.15                         # of the current


def error_deg(make, d, rated):
    """Largest error without load and at rated current, either way, and three deviations of its noise; infinite where it does not
    hold with 15 % more current. make: parameters, way, whether with the inverter -> Holds."""
    worst = 0.0
    for way in (1, -1):
        if not make(d, way, False).run(way * MARGIN * rated)[0]:
            return math.inf
        for i_q in (0.05 * rated, rated):
            held, _, largest = make(d, way, True).run(way * i_q)
            if not held:
                return math.inf
            worst = max(worst, largest)
    return math.degrees(worst) + 3 * noise_deg(d, d["i_noise"] / (2 * d["i_full_scale"] / 4096))


def grid(make, d, top):
    """Row 67: {(V, Hz): error} of twelve carriers, and for the fastest loop that any of them suits the one that takes the least flux
    and so the least current: (loop, map, (V, Hz) or None)."""
    found = {}
    least = PERIODS_POLE if d.get("polarity") == 3 else 0
    for loop in LOOPS_HZ:
        found = {}
        for share in SHARES:
            for N in (N for N in PERIODS if N >= least):
                v, f = float(f"{share * top:.3g}"), d["f_pwm"] / N
                found[v, f] = error_deg(make, {**d, "v_injection": v, "f_injection": f, "injection_bandwidth": loop,
                                               "speed_bandwidth": loop / SLOWER}, rated_i_q(d))
        good = [(v / f, (v, f)) for (v, f), error in found.items() if error <= ERROR_DEG]
        if good:
            return loop, found, min(good)[1]
    return LOOPS_HZ[-1], found, None
