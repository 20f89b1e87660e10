/* Second harmonic of the voltage at the neutral that a rotating carrier makes at rest (METHODS.md 8.4.3, row 97;
 * METHODS-ADDENDUM.md Z11).
 *
 * The carrier's flux, F = V_h / omega_h, saturates the core as the magnet does. With
 *   i_d = psi_d / L_dh + b psi_d^2 / 2 + c psi_q^2 / 2
 *   i_q = psi_q / L_qh + c psi_d psi_q
 * the current has parts at twice the carrier, of which dL_0 makes a voltage. Over a whole period of the carrier
 * (zero_rotating_second()):
 *   z = 2/N sum v_0 e^{-j 2 phi}
 *   z(theta) = Z_1 e^{j theta} + Z_5 e^{-j 5 theta} + Z_2 e^{-j 2 theta} + Z_4 e^{j 4 theta}
 *   Z_1 = dL_0 F^2 omega_h / 8 (b + c) e^{j (pi / 2 + delta)}
 *   Z_5 = Z_1 (b - 3 c) / (b + c)
 *   Z_2 = j z A e^{j (pi / 2 + delta)}
 * No other orders can be, as a third of a turn of rotor and carrier changes nothing. The first two change their sign with
 * the pole. The others do not: a linear machine has them, from the RC of the channel, which weighs the end of a PWM period
 * more than its beginning, so that a vector counts by where in the period it stands: a pattern at three times the carrier,
 * which makes of A e^{j (2 theta + phi)} an e^{j (2 theta - 2 phi)}. 7 mV beside 17 to 34 mV with IPM-1000 at 70 V and
 * 250 Hz, but 1.7 mV beside 2.3 to 4.7 mV with SPM-400 at 8 V. Told are b + c (zero_second), delta (zero_second_phase; 0.5 rad
 * by resistance and dead time on both) and z (zero_second_even). Of a core that saturates with the fourth power of the flux
 * (b - 3 c) / (b + c) is 1/3, which is taken. Z_4, kappa Z_2 at most, is left out. A carrier with |Z_1| - |Z_5| below
 * |Z_2|, as one of 35 V and 500 Hz on IPM-1000, is refused: another inverter could turn its answer.
 *
 * zero_second_of_pole(): the first two, zero_second_of_either(): the rest, at theta; per unit as x of zero_sequence.h. At 1
 * kHz, 200 instructions each. Tests: tests/unit/injection/zero_second_test.cpp. */
#ifndef INJECTION_ZERO_SECOND_H
#define INJECTION_ZERO_SECOND_H

#include "firmware/math/frames.h"
#include "firmware/params/types.h"
#include "injection/zero_rotating.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_dq_t z_1, z_5, z_2; /* d + j q */
} zero_second_config_t;

pm_ab_t zero_second_of_pole(const zero_second_config_t *config, pm_angle_t theta);
pm_ab_t zero_second_of_either(const zero_second_config_t *config, pm_angle_t theta);

void make_zero_second(maker_t *m, zero_second_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
