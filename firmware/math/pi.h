/* Proportional-integral controller with a limit and back-calculation (METHODS.md 1.3.2.2, row 5).
 *
 *   u         = kp e + integral + ff                     ff: feed-forward
 *   integral += ki e + kb (u_limited - u)
 * u and integral are wide (Q22). The caller limits u (alone or as a vector) between the two calls, so that
 * the limit may couple axes. kb = ki / kp makes the integral follow the limited output with the time
 * constant of the controller: it approaches u_limited - ff, so |integral| <= |u_limited| + |ff|.
 *
 * Then no sum can overflow for |e| < 8, 0 <= kp < 30, 0 <= kb <= 1, |ff| < 8, |u_limited| < 8. An initial
 * integral must lie within +-16. An error below 2^-23 / ki does not move the integral.
 * Call output, limit, update once per period; u belongs to the instant of e. Cost: 2 + 3 instructions
 * inline beside loads, stores and the limit. Tests: tests/unit/math/pi_test.cpp. */
#ifndef PM_MATH_PI_H
#define PM_MATH_PI_H

#include "firmware/math/fixed.h"

typedef struct {
    pm_gain_t kp; /* Q26 */
    pm_gain_t ki; /* Q26, per step */
    pm_unit_t kb; /* Q31, ki / kp */
} pm_pi_config_t;

typedef struct {
    pm_wide_t integral; /* Q22; any value within the output limits is a bumpless initial value */
} pm_pi_t;

static inline pm_wide_t pm_pi_output(const pm_pi_t *self, const pm_pi_config_t *c, pm_q_t e, pm_q_t ff)
{
    return pm_gain_add(self->integral, e, c->kp) + pm_widen(ff);
}

/* The back-calculation of the update alone. */
static inline pm_wide_t pm_pi_following(const pm_pi_config_t *c, pm_wide_t integral, pm_wide_t excess)
{
    return integral + pm_shl(pm_mulh(excess, c->kb), 1);
}

/* excess = u_limited - u of the same step. */
static inline void pm_pi_update(pm_pi_t *self, const pm_pi_config_t *c, pm_q_t e, pm_wide_t excess)
{
    self->integral = pm_pi_following(c, pm_gain_add(self->integral, e, c->ki), excess);
}

#endif
