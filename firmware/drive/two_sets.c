#include "firmware/drive/two_sets.h"

#include "firmware/math/image.h"

#if PM_HAS(two_sets)

/* A code of full scale is one. */
#define CURRENT_BITS (PM_Q_BITS - 15)
#define COS_30       PM_FRAC(0.433012701892219323) /* half of it */

/* By 30 degrees, one way and the other. */
static pm_ab_t onwards(pm_ab_t x)
{
    return (pm_ab_t){.alpha = 2 * pm_frac(x.alpha, COS_30) - pm_half(x.beta),
                     .beta = 2 * pm_frac(x.beta, COS_30) + pm_half(x.alpha)};
}

pm_ab_t two_sets_backwards(pm_ab_t x)
{
    return (pm_ab_t){.alpha = 2 * pm_frac(x.alpha, COS_30) + pm_half(x.beta),
                     .beta = 2 * pm_frac(x.beta, COS_30) - pm_half(x.alpha)};
}

void two_sets_reset(two_sets_t *self, const two_sets_config_t *config)
{
    synchronous_pi_reset(&self->regulator, &config->regulator, (pm_dq_t){0, 0}, (pm_dq_t){0, 0}, 0);
    self->v_next = (pm_ab_t){0, 0};
}

pm_ab_t two_sets_measure(two_sets_t *self, const uint16_t code[PM_LEGS], pm_ab_t i_1)
{
    self->i = (pm_abc_t){.a = pm_shl(code[0], CURRENT_BITS) - self->zero[0],
                         .b = pm_shl(code[1], CURRENT_BITS) - self->zero[1],
                         .c = pm_shl(code[2], CURRENT_BITS) - self->zero[2]};
    const pm_ab_t i_2 = onwards(pm_clarke(self->i));
    self->v_acting = self->v_next;
    self->before = self->z;
    self->z = (pm_ab_t){.alpha = pm_half(i_1.alpha - i_2.alpha), .beta = pm_half(i_1.beta - i_2.beta)};
    return (pm_ab_t){.alpha = i_1.alpha - self->z.alpha, .beta = i_1.beta - self->z.beta};
}

static pm_q_t unexplained(const two_sets_config_t *config, pm_q_t v, pm_q_t now, pm_q_t before)
{
    return v - pm_mul(config->R, now + before) - bridges_induced(config->L, now - before);
}

pm_ab_t two_sets_unexplained(const two_sets_t *self, const two_sets_config_t *config)
{
    return (pm_ab_t){.alpha = unexplained(config, self->v_acting.alpha, self->z.alpha, self->before.alpha),
                     .beta = unexplained(config, self->v_acting.beta, self->z.beta, self->before.beta)};
}

/* The voltage that holds z at zero, or at z_q. The frame is that of where it acts: against where z was measured it is off by one and a half
 * periods, which the phase margin of the loop bears. */
static pm_ab_t hold(two_sets_t *self, const two_sets_config_t *config, const two_sets_in_t *in,
                    int32_t *limited)
{
    const pm_half_dir_t dir = in->ahead;
    const regulator_in_t z = {
        .i = {.d = pm_shl(pm_mulh_add(pm_mulh(self->z.alpha, dir.cos), self->z.beta, dir.sin), 2),
              .q = pm_shl(pm_mulh_sub(pm_mulh(self->z.beta, dir.cos), self->z.alpha, dir.sin), 2)},
        .i_ref = {.d = 0, .q = in->z_q},
        .omega = in->omega,
        .v_max = in->v_dc / 8,
    };
    regulator_out_t u = {.limited = false};
    const bool apart = in->apart.alpha != 0 || in->apart.beta != 0;
    synchronous_pi_step(&self->regulator, apart ? &config->slowed : &config->regulator, &z, &u);
    if (u.limited) {
        *limited = PM_SHARE_ONE;
    }
    const pm_dq_t v = {.d = pm_shl(u.v.d, 30 - PM_WIDE_BITS), .q = pm_shl(u.v.q, 30 - PM_WIDE_BITS)};
    return pm_park_inverse_quarter(v, dir);
}

/* As modulator_step(), and without a common part of the legs where `plain`. */
static void modulate(modulator_t *self, const modulator_config_t *config, bool plain, pm_ab_t v, pm_q_t v_dc,
                     pm_ab_t i_quarter, modulator_out_t *out)
{
    if (!plain) {
        modulator_step(self, config, v, v_dc, i_quarter, out);
        return;
    }
    const pm_abc_t leg = pm_clarke_inverse(v);
    const pm_q_t most = pm_max(leg.a, pm_max(leg.b, leg.c));
    const pm_q_t least = pm_min(leg.a, pm_min(leg.b, leg.c));
    const modulator_zero_t in = {
        .v = v, .v_zero = pm_half(most + least), .i_quarter = i_quarter, .i_zero_quarter = 0};
    (void)modulator_step_zero(self, config, &in, v_dc, out);
}

void two_sets_step(two_sets_t *self, const two_sets_config_t *config, modulator_t *modulator,
                   const modulator_config_t *modulator_config, const two_sets_in_t *in, bridges_t *out)
{
    const pm_ab_t v_z = hold(self, config, in, &modulator->limited);
    const pm_ab_t z = {.alpha = self->z.alpha / 4, .beta = self->z.beta / 4};
    const pm_ab_t v_1 = {.alpha = in->v.alpha + v_z.alpha, .beta = in->v.beta + v_z.beta};
    const pm_ab_t v_2 = {.alpha = in->v.alpha + in->apart.alpha - v_z.alpha,
                         .beta = in->v.beta + in->apart.beta - v_z.beta};
    const pm_ab_t i_1 = {.alpha = in->i_quarter.alpha + z.alpha, .beta = in->i_quarter.beta + z.beta};
    const pm_ab_t i_2 = {.alpha = in->i_quarter.alpha - z.alpha, .beta = in->i_quarter.beta - z.beta};
    modulate(modulator, modulator_config, config->between, v_1, in->v_dc, i_1, &out->bridge[0]);
    modulate(modulator, modulator_config, config->between, two_sets_backwards(v_2), in->v_dc,
             two_sets_backwards(i_2), &out->bridge[1]);
    self->v_next = v_z;
    const pm_ab_t acts = onwards(out->bridge[1].v);
    out->v = (pm_ab_t){.alpha = pm_half(out->bridge[0].v.alpha + acts.alpha),
                       .beta = pm_half(out->bridge[0].v.beta + acts.beta)};
}

#endif
