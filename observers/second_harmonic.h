/* Removes the second harmonic from the error signal, between a source and the loop
 * (METHODS.md 3.6.2 and 3.6.3, rows 34 and 35).
 *
 * Unequal phases cause a negative sequence in EMF and flux: an error signal d at twice the rotor's angle, of
 * amplitude R_d I / (omega psi_a) for a traceless part R_d of the resistance. The loop would follow it, so
 * its estimate d^ is subtracted and learns from the remainder eps':
 *
 *   eps' = eps - d^
 *   adaptive notch   d^ = a cos 2 theta + b sin 2 theta
 *                    (a, b) += mu eps' (cos, sin)(2 theta + phi)
 *   resonator        d^ = y                                          a SOGI at 2 omega
 *                    (y, q) += mu eps' (cos phi, -sin phi), then turned by 2 omega T
 *
 * The notch is tied to the angle and keeps what it learnt through changes of speed; the resonator knows the
 * frequency only. phi is the angle of the loop's sensitivity at 2 omega; the loop responds to d - d^ with
 *
 *   S = s^3 / (s^3 + k_p s^2 + k_i s + k_1),   s = 2 j omega
 *
 * Its angle exceeds 90 degrees below 2 omega = w_n: there phi = 0, as in the literature, makes the estimate
 * diverge (docs/methods_notes.md). d^ converges with the time constant 2 T / (mu |S|).
 *
 * S is renewed at 1 kHz. While another source leads, or at 2 |omega| < w_n / 3, where |S| < 0.15, learning
 * stops and the estimate fades within 20 ms. A period costs 30 (resonator) or 35 (notch) instructions and a
 * call, two when it is off. Range: mu < 0.1. Tests: tests/unit/observers/second_harmonic_test.cpp,
 * tests/scenario/asymmetry.yaml. */
#ifndef OBSERVERS_SECOND_HARMONIC_H
#define OBSERVERS_SECOND_HARMONIC_H

#include "firmware/math/frames.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    SECOND_HARMONIC_STAYS,
    SECOND_HARMONIC_NOTCH,
    SECOND_HARMONIC_RESONATOR,
    SECOND_HARMONIC_COUNT
} second_harmonic_id_t;

typedef struct {
    second_harmonic_id_t id;
    pm_frac_t mu;       /* per period, Q32 */
    pm_q_t k_p;         /* of the loop, rad/s over w_base: 2 zeta w_n */
    pm_q_t k_i;         /* its square: w_n^2 */
    pm_q_t k_1;         /* its cube: 0 for the PLL */
    pm_q_t omega_least; /* no learning below, w_n / 6 */
    pm_frac_t t_s;      /* T_s w_base, Q32 */
} second_harmonic_config_t;

typedef struct {
    pm_q_t a, b;                /* or y, q */
    pm_dir_t turn;              /* of 2 omega T */
    int32_t gain_cos, gain_sin; /* mu cos phi, +-mu sin phi, Q32; 0: no learning */
} second_harmonic_t;

void second_harmonic_reset(second_harmonic_t *self);

/* Another method between two periods, the next of which has the position theta. The resonator goes on with what the notch has
 * learnt, and the notch with what the resonator has. */
void second_harmonic_change(second_harmonic_t *self, second_harmonic_id_t from, second_harmonic_id_t to,
                            pm_angle_t theta);

/* eps'; dir: direction of the present position. */
pm_q_t second_harmonic_step(second_harmonic_t *self, const second_harmonic_config_t *config, pm_dir_t dir,
                            pm_q_t eps);

/* At 1 kHz. */
void second_harmonic_slow(second_harmonic_t *self, const second_harmonic_config_t *config, pm_q_t omega,
                          pm_q_t weight);

void make_second_harmonic(maker_t *m, second_harmonic_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
