/* PWM excitation: the edges of the normal pattern are moved so that the active vectors of the two halves of a
 * period differ, and the current is sampled between them (METHODS.md 4.6.2, row 48, of which the derivative within
 * a zero vector is observers/zero_vector.h).
 *
 * Along the axis u of the period (axes.h) the first half has V_h more and the second V_h less, so that the
 * mean voltage is what control asked for and the current is without carrier at both ends. The sample at the
 * all-high vector between the halves shows
 *   c = i(k - 1/2) - (i(k-1) + i(k)) / 2 = (F [L_sa u + K e^{j (2 theta + theta_m)} u*]) / D,  F = V_h T_s / 2
 * This is active minus zero: in the first half u is active for t = V_h T_s / V_dc longer than in the second,
 * where a zero vector or -u takes its place; what both halves have in common - EMF, resistance, fundamental
 * voltage, dead time - is in both differences alike and cancels. All three samples lie in the middle of zero
 * vectors, t/2 or more after the last edge.
 *
 * `v_injection` is V_h, the peak of the difference, which is largest at u: 3/2 V_h on the leg of the axis. t
 * >= 20 us at 10 kHz and 300 V needs 60 V. No fundamental current is lost: out->i is the current at k. It
 * needs currents that can be measured while all upper switches conduct: not low-side shunts.
 *
 * eps, misfit: axes.h. Each period about 150 instructions more than without,
 * the modulator's second half included. Functions as injection.h
 * says. Tests: tests/unit/injection/pwm_excitation_test.cpp, tests/scenario/pwm_excitation.yaml. */
#ifndef INJECTION_PWM_EXCITATION_H
#define INJECTION_PWM_EXCITATION_H

#include "injection/axes.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    axes_config_t axes;
    pm_q_t v_h;
    uint16_t between; /* instant of the all-high vector, timer counts */
} pwm_excitation_config_t;

typedef struct {
    axes_t axes;
    pm_ab_t i; /* current at k-1 */
} pwm_excitation_t;

void pwm_excitation_reset(pwm_excitation_t *self, const pwm_excitation_config_t *config, const obs_in_t *in);
void pwm_excitation_step(pwm_excitation_t *self, const pwm_excitation_config_t *config,
                         const injection_in_t *in, injection_out_t *out);
void pwm_excitation_slow(pwm_excitation_t *self, const pwm_excitation_config_t *config, const obs_in_t *in);
obs_out_t pwm_excitation_last(const pwm_excitation_t *self, const pwm_excitation_config_t *config);

void make_pwm_excitation(maker_t *m, pwm_excitation_config_t *c);
injection_limits_t pwm_excitation_limits(const maker_t *m);
pm_num_t pwm_excitation_answer(const maker_t *m);

#ifdef __cplusplus
}
#endif

#endif
