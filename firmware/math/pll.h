/* Phase-locked loop on a position error (METHODS.md 2.4.2, row 19).
 *
 *   eps    = theta_true - theta                 rad
 *   omega += ki eps
 *   theta += omega + kp eps
 *   kp     = 2 zeta w_n T_s
 *   ki     = w_n^2 T_s                          per-unit of the base speed
 * Error under an acceleration a: a / w_n^2. The angle is predicted first and corrected after the measurement:
 * pm_pll_predict() moves theta from k-1 to k; pm_pll_correct() uses eps(k).
 *
 * Ranges: |eps| <= pi, kp < 0.5, |omega| k_theta below half a turn per step; the speed saturates at -2 and
 * 2 - 2^-28. Angle steps are rounded to 2^-30 turn, the speed to 2^-28; an error below 2^-29 / ki does not
 * move the speed.
 * Cost: docs/decisions/001-signal-format.md. Tests: tests/unit/math/pll_test.cpp. */
#ifndef PM_MATH_PLL_H
#define PM_MATH_PLL_H

#include "firmware/math/fixed.h"

typedef struct {
    pm_frac_t kp_turn; /* Q32, 2 zeta w_n T_s 4 / (2 pi): quarters of 2^32 per radian in Q28 */
    pm_frac_t ki;      /* Q32, w_n^2 T_s / w_base */
    int32_t k_theta;   /* Q30, turns x 16 per step at base speed: pm_omega_to_angle() */
} pm_pll_config_t;

typedef struct {
    pm_angle_t theta; /* turns of 2^32 */
    pm_q_t omega;     /* Q28, per-unit of the base speed */
} pm_pll_t;

/* Turns in one period at speed omega; k_theta = 16 w_base T_s / (2 pi) in Q30 (w_base T_s / 2 pi < 1/8). */
static inline int32_t pm_omega_to_angle(pm_q_t omega, int32_t k_theta)
{
    return pm_shl(pm_mulh(omega, k_theta), 2);
}

static inline void pm_pll_predict(pm_pll_t *self, const pm_pll_config_t *c)
{
    self->theta += (pm_angle_t)pm_omega_to_angle(self->omega, c->k_theta);
}

static inline void pm_pll_correct(pm_pll_t *self, const pm_pll_config_t *c, pm_q_t eps)
{
    self->theta += (pm_angle_t)pm_shl(pm_frac(eps, c->kp_turn), 2);
    self->omega = pm_sat(pm_frac_add(self->omega, eps, c->ki), PM_Q_BITS + 1);
}

#endif
