/* Pulsating square-wave injection in the estimated frame (METHODS.md 4.3.2, row 38) with indirect
 * cross-coupling compensation (5.2.2.2, row 51).
 *
 * The d-axis voltage alternates by +-V_h each PWM period (f_h = f_pwm/2), s is its sign. From the change of
 * current over a period in the present frame, delta_k, a second difference removes the slope of the
 * fundamental:
 *   h      = s (delta_k - delta_k-1) / 2
 *   h_d    = F [L_sa + K cos(2e + th_m)] / D
 *   h_q    = F K sin(2e + th_m) / D
 *   F      = V_h T_s,                     e: position error
 * The error signal is zero at e = 0 whatever the load:
 *   eps    = gain(i_q) (h_q + lambda(i_q) h_d)
 *   lambda = L_dqh / L_qh = i_q (a + b |i_q|)
 *   gain   = g_0 + g_2 i_q^2
 * from the commissioned inductances (config.c). The rotor turns while the current changes, so the change
 * belongs half a period back, and lambda includes
 *   lambda += omega T_s / 2
 * Without it the position lags by L_q/(L_q - L_d) times omega T_s / 2. lambda and gain are renewed at 1 kHz;
 * |lambda| <= 1.
 *
 * Order in period k: pulsating_square_demodulate() with the current at k, then pulsating_square_output() for
 * the voltage over [k+1, k+2). eps is exact for small e and 1/2 sin 2e beyond: stable at 0 and at 180
 * degrees, so the polarity must be known. misfit: difference of h_d from its expected value, relative. The
 * fundamental current is the mean of two samples: pulsating_square_fundamental_twice().
 * Tests: tests/unit/injection/pulsating_square_test.cpp, tests/scenario. */
#ifndef INJECTION_PULSATING_SQUARE_H
#define INJECTION_PULSATING_SQUARE_H

#include "firmware/math/estimate.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_q_t v_h;
    pm_q_t lambda_1, lambda_2; /* a, b */
    int32_t gain_0;            /* rad per unit of current, Q20 */
    int32_t gain_2;            /* its change with i_q^2, Q16 */
    pm_frac_t half_step;       /* T_s w_base / 2: rotation over half a period, per unit of speed */
    pm_q_t h_d;                /* expected h_d without load */
    int32_t h_d_inverse;       /* Q20 */
} pulsating_square_config_t;

typedef struct {
    pm_ab_t i;          /* current at k-1 */
    pm_dq_t half_delta; /* half of the change over the last period */
    pm_unit_t lambda;   /* at the present current and speed */
    uint32_t warm;      /* periods until two valid differences exist */
    pm_q_t carrier;     /* commanded in the last period: +-v_h */
    int32_t gain;       /* at the present current, Q20, with the sign of the response that comes next */
    pm_q_t h_d;         /* of the last step, either sign */
    pm_q_t eps;         /* of the last step */
} pulsating_square_t;

void pulsating_square_reset(pulsating_square_t *self, const pulsating_square_config_t *config, pm_ab_t i);
void pulsating_square_demodulate(pulsating_square_t *self, const pulsating_square_config_t *config,
                                 const obs_in_t *in, obs_out_t *out);
pm_dq_t pulsating_square_output(pulsating_square_t *self, const pulsating_square_config_t *config);

/* At 1 kHz: gain and lambda for i_dq and omega of `in`, also after a reset. */
void pulsating_square_slow(pulsating_square_t *self, const pulsating_square_config_t *config,
                           const obs_in_t *in);
/* misfit of the last step. */
pm_q_t pulsating_square_misfit(const pulsating_square_t *self, const pulsating_square_config_t *config);

/* Current at k without the carrier, doubled; call before pulsating_square_demodulate(). */
static inline pm_ab_t pulsating_square_fundamental_twice(const pulsating_square_t *self, pm_ab_t i)
{
    const pm_ab_t sum = {i.alpha + self->i.alpha, i.beta + self->i.beta};
    return sum;
}

#ifdef __cplusplus
}
#endif

#endif
