#include "firmware/drive/open_winding.h"

#include "firmware/math/trig.h"

#if PM_HAS(open_winding)

#define THIRD       PM_FRAC(1.0 / 3)
#define PER_ROOT_12 PM_FRAC(0.288675134594812882) /* 1 / (2 sqrt(3)) */

void open_winding_reset(open_winding_t *self)
{
    *self = (open_winding_t){.turn = pm_dir(0), .lead = pm_dir(0)};
}

pm_q_t open_winding_signal(open_winding_t *self, const open_winding_config_t *config, pm_abc_t i)
{
    const pm_q_t before = self->i;
    self->i = pm_frac(i.a, THIRD) + pm_frac(i.b, THIRD) + pm_frac(i.c, THIRD);
    const pm_q_t acted = self->v_acting;
    self->v_acting = self->v_next;
    if (config->held) {
        return acted;
    }
    return acted - pm_mul(config->R, self->i + before) - bridges_induced(config->L, self->i - before);
}

/* Turned by its step; the pair is a signal and what lags it by a quarter of its cycle. */
static void turn(open_winding_t *self)
{
    const pm_q_t y = self->y;
    const pm_q_t q = self->q;
    self->y = pm_shl(pm_mulh_sub(pm_mulh(y, self->turn.cos), q, self->turn.sin), 1);
    self->q = pm_shl(pm_mulh_add(pm_mulh(y, self->turn.sin), q, self->turn.cos), 1);
}

/* v_0 that holds i_0 at zero; beyond `most` nothing is gathered, and the voltage counts as limited. */
static pm_q_t hold(open_winding_t *self, const open_winding_config_t *config, pm_q_t most, int32_t *limited)
{
    turn(self);
    self->y = pm_clamp(self->y - pm_mul(config->k_r, self->i), -most, most);
    const pm_q_t v = pm_shl(pm_mulh_sub(pm_mulh(self->y, self->lead.cos), self->q, self->lead.sin), 1);
    const pm_q_t wanted = v - pm_mul(config->k_p, self->i);
    if (pm_abs(wanted) > most) {
        *limited = PM_SHARE_ONE;
    }
    return pm_clamp(wanted, -most, most);
}

void open_winding_step(open_winding_t *self, const open_winding_config_t *config, modulator_t *modulator,
                       const modulator_config_t *modulator_config, pm_ab_t v, pm_q_t v_dc, pm_ab_t i_quarter,
                       bridges_t *out)
{
    const pm_q_t v_zero = config->held ? hold(self, config, v_dc / 4, &modulator->limited) : 0;
    const pm_ab_t half = {.alpha = pm_half(v.alpha), .beta = pm_half(v.beta)};
    const pm_ab_t across = {.alpha = pm_frac(v.beta, PER_ROOT_12), .beta = pm_frac(v.alpha, PER_ROOT_12)};
    const modulator_zero_t first = {
        .v = {.alpha = half.alpha - across.alpha, .beta = across.beta + half.beta},
        .v_zero = pm_half(v_zero),
        .i_quarter = i_quarter,
        .i_zero_quarter = self->i / 4};
    const modulator_zero_t second = {
        .v = {.alpha = -half.alpha - across.alpha, .beta = across.beta - half.beta},
        .v_zero = -pm_half(v_zero),
        .i_quarter = {.alpha = -i_quarter.alpha, .beta = -i_quarter.beta},
        .i_zero_quarter = -(self->i / 4)};
    const pm_q_t one = modulator_step_zero(modulator, modulator_config, &first, v_dc, &out->bridge[0]);
    const pm_q_t other = modulator_step_zero(modulator, modulator_config, &second, v_dc, &out->bridge[1]);
    out->v = (pm_ab_t){.alpha = out->bridge[0].v.alpha - out->bridge[1].v.alpha,
                       .beta = out->bridge[0].v.beta - out->bridge[1].v.beta};
    self->v_next = one - other;
}

void open_winding_slow(open_winding_t *self, const open_winding_config_t *config, pm_q_t omega)
{
    self->turn = pm_dir((pm_angle_t)pm_rad_to_angle(pm_mul(config->turn, omega)));
    /* of the delay, and of the circuit under k_p that acts with it */
    const pm_angle_t delay = (pm_angle_t)pm_rad_to_angle(pm_mul(config->delay, omega));
    const pm_dir_t late = pm_dir(delay);
    const pm_q_t turns = pm_mul_sat(config->ratio, omega); /* 3 omega over 2 pi f */
    const pm_angle_t lag = pm_atan2(turns / 8 - pm_unit(PM_ONE / 8, late.sin), pm_unit(PM_ONE / 8, late.cos));
    self->lead = pm_dir(delay + lag);
}

#endif
