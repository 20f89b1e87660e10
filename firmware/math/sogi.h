/* Second-order generalised integrator: a signal and its quadrature at an adjustable frequency w.
 *
 *   y' = w (k (x - y) - q)
 *   q' = w y
 * At w the output y equals x and q lags it by 90 degrees. Discrete form: (y, q) is turned by w T_s; half of
 * the correction K (x - y), K = k w T_s, is added before and half after the turn. So gain 1 and phase 0 are
 * exactly at w T_s, at every frequency below half the sampling rate, and a dc part of x does not reach y (it
 * reaches q with gain k). Transfer function:
 *   y / x = c (z - 1) / (z^2 - (2 cos wT - c) z + 1 - c)
 *   c     = K (1 + cos wT) / 2
 * Its time constant is 2 T_s / c as long as K < 2 w T_s. y and q belong to the instant of the x of the same
 * step; that x acts from the next step on.
 *
 * Errors at w: amplitude <= 2e-6 / c, phase <= 2e-6 / c rad, both from the direction of w T_s. The caller
 * ensures |x - y| < 8; 0 < K < 0.5 keeps it stable. A zeroed state is the reset.
 * Cost: docs/decisions/001-signal-format.md. Tests: tests/unit/math/sogi_test.cpp. */
#ifndef PM_MATH_SOGI_H
#define PM_MATH_SOGI_H

#include "firmware/math/frames.h"

typedef struct {
    pm_q_t y;    /* in phase, Q28 */
    pm_q_t q;    /* quadrature, lagging, Q28 */
    pm_q_t half; /* half of the correction to come, Q28 */
} pm_sogi_t;

/* step: direction of the angle w T_s, pm_dir(); k: K above in Q32. */
static inline void pm_sogi_step(pm_sogi_t *self, pm_dir_t step, pm_frac_t k, pm_q_t x)
{
    const pm_q_t y = self->y + self->half;
    const pm_q_t q = self->q;
    self->y = pm_shl(pm_mulh_sub(pm_mulh(y, step.cos), q, step.sin), 1) + self->half;
    self->q = pm_shl(pm_mulh_add(pm_mulh(y, step.sin), q, step.cos), 1);
    self->half = pm_frac(x - self->y, k) >> 1;
}

#endif
