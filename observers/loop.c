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
    const bool changed = self->id != (uint8_t)config->id;
    if (changed || weight == 0 || (config->id == LOOP_ARCTANGENT && !self->direct)) {
        self->inner = 0;
    }
    self->id = (uint8_t)config->id;
}

/* The PLL follows theta; inner is its distance from theta. */
static void arctangent(loop_t *self, pm_pll_t *pll, const pm_pll_config_t *gains, pm_q_t eps)
{
    const pm_angle_t turn = (pm_angle_t)pm_rad_to_angle(eps);
    pm_pll_t inner = {.theta = (pm_angle_t)self->inner - turn, .omega = pll->omega};
    pm_pll_correct(&inner, gains, pm_angle_to_rad(pm_angle_diff(0, inner.theta)));
    pll->theta += turn;
    pll->omega = inner.omega;
    self->inner = (int32_t)inner.theta;
}

pm_q_t loop_eps(loop_t *self, const loop_config_t *config, pm_pll_t *pll, const pm_pll_config_t *gains,
                pm_q_t eps)
{
    if (config->id == LOOP_PLL) {
        return eps;
    }
    if (config->id == LOOP_ARCTANGENT) {
        if (!self->direct) {
            return eps;
        }
        arctangent(self, pll, gains, eps);
        return 0;
    }
    const int32_t change = pm_shl(pm_sat(pm_mulh(eps, self->k_acceleration), 26), 4);
    self->inner = pm_add_sat(self->inner, change);
    pll->omega = pm_mulh_add(pll->omega, self->inner, TO_Q28);
    return eps;
}
