#include "observers/loop.h"

#define TO_Q28 PM_FRAC(1.0 / 256) /* from Q36 */

void loop_reset(loop_t *self)
{
    *self = (loop_t){0};
}

void loop_slow(loop_t *self, const loop_config_t *config, pm_q_t weight)
{
    self->direct = weight == PM_ONE;
    self->k_acceleration = pm_mul(config->k_acceleration, weight);
    if (weight == 0) {
        self->acceleration = 0;
    }
}

static pm_q_t arctangent(const loop_config_t *config, pm_pll_t *pll, pm_q_t eps)
{
    pll->theta += (pm_angle_t)pm_rad_to_angle(eps);
    pll->omega = pm_sat(pll->omega + pm_shl(pm_mulh(eps, config->k_omega), 2), PM_Q_BITS + 1);
    return 0;
}

pm_q_t loop_correct_other(loop_t *self, const loop_config_t *config, pm_pll_t *pll, pm_q_t eps)
{
    if (config->id == LOOP_ARCTANGENT) {
        return self->direct ? arctangent(config, pll, eps) : eps;
    }
    const int32_t change = pm_shl(pm_sat(pm_mulh(eps, self->k_acceleration), 26), 4);
    self->acceleration = pm_add_sat(self->acceleration, change);
    pll->omega = pm_mulh_add(pll->omega, self->acceleration, TO_Q28);
    return eps;
}
