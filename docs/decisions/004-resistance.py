#!/usr/bin/env python3
"""The table of 004-resistance.md: eigenvalues of flux observer, position loop and speed control, linearised.

States in the estimated frame: flux error d and q, reference amplitude, angle error, estimated speed, speed, integral
of the speed control. IPM-1000; the current follows its reference.
"""
import numpy as np

P, PSI, J = 3, 0.236, 0.01
G, KAPPA, ZETA = 0.5, 10.0, 0.9  # flux gain, adaptation 1/s, damping of the loop
F_LOOP, F_SPEED, I_D = 25.0, 6.0, -0.2


def largest(omega, dR):
    """Largest real part in 1/s; dR = machine - parameter in ohm."""
    d, q, ref, e, w_hat, w, xi = range(7)
    w_n, w_s = 2 * np.pi * F_LOOP, 2 * np.pi * F_SPEED
    k_t = 1.5 * P * P * PSI / J
    k_p = w_s / k_t
    i_q = np.zeros(7)
    i_q[w_hat], i_q[xi] = -k_p, -k_p * w_s / 4
    eps = np.zeros(7)
    eps[e], eps[q] = 1, 1 / PSI
    a = np.zeros((7, 7))
    a[d, q], a[d, d], a[d, ref] = omega, -G * omega, G * omega
    a[q] = dR * i_q
    a[q, d] -= omega
    a[ref, d], a[ref, ref] = KAPPA, -KAPPA
    a[e, w], a[e, w_hat] = 1, -1
    a[e] -= 2 * ZETA * w_n * eps
    a[w_hat] = w_n**2 * eps
    a[w] = k_t * i_q
    a[w, e] -= k_t * I_D
    a[xi, w_hat] = 1
    return np.linalg.eigvals(a).real.max()


if __name__ == "__main__":
    for omega in (94, 157, 314):
        print(omega, *(f"{dR:+.1f} ohm: {largest(omega, dR):+.1f}" for dR in (0, -0.5, -1, -2, 1)), sep="  ")
