#!/usr/bin/env python3
"""The tables of 004-resistance.md: eigenvalues of flux observer, position loop and speed control around a steady state.

States, in the estimated frame: flux error d and q, reference amplitude, angle error, estimated speed, speed, integral of the
speed control. IPM-1000; the current follows its reference.
"""
import numpy as np

P, J = 3, 0.01
TRUE = {"R": 6.0, "L_q": 70.8e-3, "psi": 0.236}
L_D, I_RATED = 43e-3, 4.0
G, KAPPA, ZETA = 0.5, 10.0, 0.9  # flux gain, adaptation 1/s, damping of the loop
F_LOOP = 25.0


def derivative(x, speed, load, told, i_d, f_speed, across):
    """Time derivative of the states. load: torque; across: with k_t."""
    flux = x[0] + 1j * x[1]
    ref, e, w_hat, w, xi = x[2:]
    w_n, w_s = 2 * np.pi * F_LOOP, 2 * np.pi * f_speed
    k_p = w_s * J / (1.5 * P * P * told["psi"])
    i = i_d + 1j * (-k_p * (w_hat - speed) - xi)
    own = i * np.exp(-1j * e)  # in the rotor's frame
    psi_a = TRUE["psi"] + (L_D - TRUE["L_q"]) * own.real
    active = (TRUE["L_q"] - told["L_q"]) * i + psi_a * np.exp(1j * e) - flux
    eps = active.imag / ref
    turns = w_hat + 2 * ZETA * w_n * eps
    t = min(max(2 * told["L_q"] * i.imag / ref, -0.5), 1) if across else 0
    back = (G + 1j * t) * speed * (ref - active.real)
    d_flux = -1j * turns * flux - (TRUE["R"] - told["R"]) * i - back
    torque = 1.5 * P * psi_a * own.imag
    return np.array([d_flux.real, d_flux.imag, -KAPPA * (ref - active.real), w - turns, w_n**2 * eps,
                     P / J * (torque - load), k_p * w_s / 4 * (w_hat - speed)])


def jacobian(f, x):
    steps = 1e-6 * np.maximum(1, np.abs(x))
    return np.array([(f(x + h) - f(x - h)) / (2 * step) for step, h in zip(steps, np.diag(steps))]).T


def largest(speed, part, R=1.0, L_q=1.0, psi=1.0, f_speed=6.0, across=False):
    """Largest real part in 1/s. part: of the rated current; R, L_q, psi: what is told, of what is true."""
    told = {"R": R * TRUE["R"], "L_q": L_q * TRUE["L_q"], "psi": psi * TRUE["psi"]}
    i_d = -0.2 - 1.55 * part**2
    load = 1.5 * P * (TRUE["psi"] + (L_D - TRUE["L_q"]) * i_d) * part * I_RATED
    x = np.array([0, 0, TRUE["psi"], 0, speed, speed, -part * I_RATED])

    def f(x):
        return derivative(x, speed, load, told, i_d, f_speed, across)

    for _ in range(50):
        x = x - np.linalg.solve(jacobian(f, x), f(x))
    return np.linalg.eigvals(jacobian(f, x)).real.max()


if __name__ == "__main__":
    print("R too high, without load, 6 Hz")
    for speed in (94, 157, 314):
        print(speed, *(f"{dR:+.1f} ohm: {largest(speed, 0, R=1 + dR / 6):+.0f}" for dR in (0, 0.5, 1, 2, -1)), sep="  ")
    for f_speed in (4.0, 6.0):
        print(f"R and L_q 15 % too high, psi_m 15 % too low, {f_speed:.0f} Hz, without and with k_t")
        for speed in (94, 157, 314):
            pairs = [[largest(speed, part, 1.15, 1.15, 0.85, f_speed, across) for across in (False, True)]
                     for part in (-1, -0.5, 0, 0.5, 1)]
            print(speed, *(f"{a:+.0f} {b:+.0f}" for a, b in pairs), sep="  ")
