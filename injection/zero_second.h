/* Second harmonic of the voltage at the neutral that a rotating carrier makes at rest (METHODS.md 8.4.3, row 97;
 * METHODS-ADDENDUM.md Z11).
 *
 * The carrier's flux, F = V_h / omega_h, saturates the core as the magnet does: with i_d = psi_d / L_dh + b psi_d^2 / 2 +
 * c psi_q^2 / 2 and i_q = psi_q / L_qh + c psi_d psi_q the current has parts at twice the carrier, of which dL_0 makes a voltage.
 * Of z = <v_0 e^{-j 2 phi}>, 2/N of a whole period of the carrier (zero_rotating_second()):
 *   z(theta) = Z_1 e^{j theta} + Z_5 e^{-j 5 theta} + Z_2 e^{-j 2 theta} + Z_4 e^{j 4 theta}
 *   Z_1 = j dL_0 F^2 omega_h / 8 (b + c),  Z_5 = j dL_0 F^2 omega_h / 8 (b - 3 c)      before resistance and dead time turn them
 * No other orders can be, as a third of a turn of rotor and carrier changes nothing. The first two change their sign with the
 * pole. The others do not: a linear machine has them, from the RC of the channel, which weighs the end of a PWM period more than its
 * beginning, so that a vector counts by where in the period it stands: a pattern at three times the carrier, which makes
 * of A e^{j (2 theta + phi)} an e^{j (2 theta - 2 phi)}. 7 mV beside 17 to 34 mV with IPM-1000 at 70 V and 250 Hz, but 2.3 mV beside
 * 1.6 to 5 mV with SPM-400 at 8 V. So all four are told as they were found with the rotor at known angles (zero_second_1_re ...), for
 * one carrier, whose voltage and frequency are told, too. A carrier with |Z_1| - |Z_5| below |Z_2| + |Z_4|, as one of 35 V and 500 Hz on
 * IPM-1000, is refused: another inverter than that of the day could turn its answer.
 *
 * zero_second_odd(): of the pole, zero_second_even(): the rest, at theta; per unit as x of zero_sequence.h. At 1 kHz, 200
 * instructions each. Tests: tests/unit/injection/zero_second_test.cpp. */
#ifndef INJECTION_ZERO_SECOND_H
#define INJECTION_ZERO_SECOND_H

#include "firmware/math/frames.h"
#include "firmware/params/types.h"
#include "injection/zero_rotating.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_dq_t z_1, z_5, z_2, z_4; /* d + j q */
} zero_second_config_t;

pm_ab_t zero_second_odd(const zero_second_config_t *config, pm_angle_t theta);
pm_ab_t zero_second_even(const zero_second_config_t *config, pm_angle_t theta);

void make_zero_second(maker_t *m, zero_second_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
