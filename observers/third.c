#include "observers/third.h"

#include "firmware/math/root.h"

third_point_t third_point(const third_config_t *config, const obs_in_t *in)
{
    const pm_q_t l_d = PM_ONE - pm_mul_sat(config->relative, in->i_dq.d);
    return (third_point_t){.x = pm_mul(config->rc, in->omega),
                           .l = {.d = l_d, .q = pm_mul_sat(config->relative, in->i_dq.q)}};
}

pm_q_t third_speed(const third_config_t *config, pm_q_t omega)
{
    return 3 * pm_max(pm_abs(omega), config->omega_min);
}

static pm_q_t square(pm_dq_t x)
{
    return pm_mul(x.d, x.d) + pm_mul(x.q, x.q);
}

/* The load may turn L by no more than the format of N bears. */
static void set_scale(third_t *self, const third_config_t *config, const obs_in_t *in)
{
    const third_point_t at = third_point(config, in);
    const pm_q_t e = pm_mul(third_speed(config, in->omega), config->psi_3);
    const pm_q_t size = pm_max(pm_mul_sat(pm_abs(e), square(at.l)), 1);
    const int32_t inverse = pm_div(PM_ONE / 1024, size); /* Q18 */
    const bool turned = (in->omega < 0) != (config->psi_3 < 0);
    const int32_t n = turned ? -inverse : inverse;
    self->scale.d = pm_mul_sat(n, at.l.d - pm_mul(at.x, at.l.q));
    self->scale.q = pm_mul_sat(n, at.l.q + pm_mul(at.x, at.l.d));
    self->k_notch = pm_mul(config->notch, pm_small(pm_abs(pm_frac(in->omega, config->t_s))));
}

pm_dq_t third_seed(const third_config_t *config, const obs_in_t *in)
{
    const third_point_t at = third_point(config, in);
    const int32_t e = pm_shl(pm_sat(pm_mul(3 * in->omega, config->psi_3), PM_Q_BITS - 1), 30 - PM_Q_BITS);
    const pm_q_t shrink = pm_div(PM_ONE, PM_ONE + pm_mul(at.x, at.x));
    const pm_q_t re = pm_mul(shrink, at.l.d - pm_mul(at.x, at.l.q));
    const pm_q_t im = -pm_mul(shrink, at.l.q + pm_mul(at.x, at.l.d));
    const pm_half_dir_t dir = third_dir(in->dir);
    const pm_q_t a = pm_shl(pm_mulh(re, dir.cos) - pm_mulh(im, dir.sin), 2);
    const pm_q_t b = pm_shl(pm_mulh(re, dir.sin) + pm_mulh(im, dir.cos), 2);
    return (pm_dq_t){.d = pm_mul(e, a), .q = pm_mul(e, b)};
}

void third_reset(third_t *self, const third_config_t *config, const obs_in_t *in)
{
    *self = (third_t){.last = {.d = THIRD_Z_ONE, .q = 0}};
    set_scale(self, config, in);
}

void third_slow(third_t *self, const third_config_t *config, const obs_in_t *in)
{
    set_scale(self, config, in);
}

obs_out_t third_last(const third_t *self)
{
    obs_out_t out;
    third_describe(self->last, &out);
    return out;
}
