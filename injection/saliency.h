/* The saliency of the machine as an injected carrier sees it, against the load (METHODS.md 4.2.2, 5.2; rows 36, 49 and
 * 51). One model for all sources; its figures come from the incremental inductances at no load and at
 * rated current and are renewed at 1 kHz.
 *
 *   L_sd    = (L_qh - L_dh) / 2,  L_sa = (L_qh + L_dh) / 2,  D = L_dh L_qh - L_dqh^2
 *   K       = sqrt(L_sd^2 + L_dqh^2)
 *   theta_m = atan2(-L_dqh, L_sd)
 *   I_p     = F L_sa / D,  I_n = F K / D            F: flux amplitude of the carrier
 *   lambda  = L_dqh / L_qh = i_q (lambda_1 + lambda_2 |i_q|)
 *   theta_m / 2            = i_q (shift_1 + shift_2 |i_q|)
 *   gain                   = gain_0 + gain_2 i_q^2   rad per current of the source's error signal
 *   I_p                    = i_p_0 + i_p_2 i_q^2
 * lambda is the indirect compensation, in the error signal of a carrier along d; the shift is the direct one, a frame of
 * its own for such a carrier (injection_stages.h). A source that reads sequences turns them by theta_m, which is either.
 * All pass through the values at i_q = 0 and i_rated, lambda and theta_m also through those at half of it. The
 * gain rises to 2.5 times that without load at most: beyond, it would only amplify noise. Range: |i_q| < 8,
 * |lambda| <= 1. Tests: tests/unit/injection, tests/unit/drive/config_test.cpp. */
#ifndef INJECTION_SALIENCY_H
#define INJECTION_SALIENCY_H

#include "firmware/math/fixed.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    int32_t gain_0;            /* rad per unit of current, Q20 */
    int32_t gain_2;            /* its change with i_q^2, Q16 */
    pm_q_t lambda_1, lambda_2; /* 0: not compensated */
    pm_q_t shift_1, shift_2;   /* rad; 0: not compensated */
    pm_q_t i_p_0, i_p_2;
} saliency_config_t;

static inline int32_t saliency_gain(const saliency_config_t *c, pm_q_t i_q)
{
    return c->gain_0 + pm_shl(pm_mul(c->gain_2, pm_mul(i_q, i_q)), 4);
}

static inline pm_q_t saliency_lambda(const saliency_config_t *c, pm_q_t i_q)
{
    return pm_mul(i_q, c->lambda_1 + pm_mul(c->lambda_2, pm_abs(i_q)));
}

/* theta_m / 2: by so much the angle of largest inductance is away from d; rad. */
static inline pm_q_t saliency_shift(const saliency_config_t *c, pm_q_t i_q)
{
    return pm_mul(i_q, c->shift_1 + pm_mul(c->shift_2, pm_abs(i_q)));
}

static inline pm_q_t saliency_i_p(const saliency_config_t *c, pm_q_t i_q)
{
    return c->i_p_0 + pm_mul(c->i_p_2, pm_mul(i_q, i_q));
}

#ifdef __cplusplus
}
#endif

#endif
