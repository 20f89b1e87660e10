/* Pulsating square-wave injection in the estimated frame (METHODS.md 4.3.2, row 38) with indirect
 * cross-coupling compensation (5.2.2.2, row 51).
 *
 * The d-axis voltage alternates by +-V_h each PWM period (f_h = f_pwm / 2). The change of current over a
 * period, with the slope of the fundamental removed by a second difference, in the present frame and with the
 * sign s of the carrier:
 *   h   = s (delta_k - delta_k-1) / 2
 *   h_d = F [L_sa + K cos(2 e + theta_m)] / D      F = V_h T_s, e: position error
 *   h_q = F K sin(2 e + theta_m) / D
 *   eps = gain(i_q) (h_q + lambda(i_q) h_d)        zero at e = 0 whatever the load (saliency.h)
 * The rotor turns while the current changes, so the change belongs half a period back:
 *   h_q += (omega T_s / 2) h_d
 * Without it the position lags by L_q / (L_q - L_d) times as much.
 *
 * eps is exact for small e and 1/2 sin 2e beyond: stable at 0 and 180 degrees, so the polarity must be known.
 * It begins with half of V_h and has all of it after two calls of pulsating_square_slow(), a quarter more each: a whole half-wave
 * from zero would leave a mean current of half the ripple, a peak twice as high; this leaves one of a quarter more.
 * Commanded at k, a voltage is seen at k+2. So the first three steps after a reset show only noise in eps, and
 * the fourth shows half of the error.
 * misfit: distance of h_d from its value without load, relative. The fundamental current is the mean of two
 * samples. With it a control period takes 48 instructions more (docs/performance.md). Functions as injection.h
 * says.
 * Tests: tests/unit/injection/pulsating_square_test.cpp, tests/scenario. */
#ifndef INJECTION_PULSATING_SQUARE_H
#define INJECTION_PULSATING_SQUARE_H

#include "injection/saliency.h"
#include "injection/source.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_q_t v_h;
    saliency_config_t saliency;
    pm_frac_t half_step; /* T_s w_base / 2: rotation over half a period, per unit of speed */
    pm_q_t h_d;          /* expected h_d without load */
    int32_t h_d_inverse; /* Q20 */
} pulsating_square_config_t;

typedef struct {
    pm_ab_t i;          /* current at k-1 */
    pm_dq_t half_delta; /* half of the change over the last period */
    int32_t carrier;    /* commanded in the last period: +-v_h, less at first, Q30 */
    int32_t gain;       /* at the present current, Q20, with the sign of the answer that comes next */
    pm_unit_t lambda;   /* at the present current and speed */
    pm_dq_t h;          /* of the last step, either sign */
    pm_q_t eps;         /* of the last step */
} pulsating_square_t;

void pulsating_square_reset(pulsating_square_t *self, const pulsating_square_config_t *config,
                            const obs_in_t *in);
void pulsating_square_step(pulsating_square_t *self, const pulsating_square_config_t *config,
                           const injection_in_t *in, injection_out_t *out);
void pulsating_square_slow(pulsating_square_t *self, const pulsating_square_config_t *config,
                           const obs_in_t *in);
obs_out_t pulsating_square_last(const pulsating_square_t *self, const pulsating_square_config_t *config);

void make_pulsating_square(maker_t *m, pulsating_square_config_t *c);
injection_limits_t pulsating_square_limits(const maker_t *m);
pm_num_t pulsating_square_answer(const maker_t *m);

#ifdef __cplusplus
}
#endif

#endif
