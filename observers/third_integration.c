#include "observers/third_integration.h"

#include "firmware/math/root.h"

#define K_SHARE PM_FRAC(1.0 / 256) /* at 1 kHz */

static void set_speed(third_integration_t *self, const third_integration_config_t *config, const obs_in_t *in)
{
    const pm_q_t speed = third_speed(&config->third, in->omega);
    const third_point_t at = third_point(&config->third, in);
    const pm_dq_t turned = {.d = at.l.d - pm_mul(at.x, at.l.q), .q = at.l.q + pm_mul(at.x, at.l.d)};
    const pm_q_t length = pm_max(pm_hypot(turned.d, turned.q), PM_ONE / 64);
    const pm_q_t per = pm_div(PM_ONE, length);
    self->along.cos = pm_shl(pm_sat(pm_mul(turned.d, per), PM_Q_BITS), 30 - PM_Q_BITS);
    self->along.sin = pm_shl(pm_sat(pm_mul(turned.q, per), PM_Q_BITS), 30 - PM_Q_BITS);
    const pm_q_t shrunk = pm_mul(length, pm_div(PM_ONE, PM_ONE + pm_mul(at.x, at.x)));
    const pm_q_t size =
        pm_mul(pm_mul_sat(config->third.psi_3, shrunk), pm_shl(self->share, PM_Q_BITS - THIRD_Z_BITS));
    self->size = pm_shl(pm_sat(size, PM_Q_BITS - 1), 30 - PM_Q_BITS);
    self->leak = pm_small(pm_mul(config->g, pm_frac(speed, config->third.t_s)));
    const pm_q_t lifted =
        pm_mul_sat(in->omega < 0 ? -speed : speed, PM_ONE + pm_mul(config->g, config->lead));
    self->lift = pm_shl(pm_sat(lifted, PM_Q_BITS + 1), 1);
    self->back = pm_shl(in->omega < 0 ? -config->lead : config->lead, 2);
}

/* Direction of 3 theta + arg(L / (1 + j x)), Q28. */
static inline pm_half_dir_t phase_of(const third_integration_t *self, pm_half_dir_t dir)
{
    return (pm_half_dir_t){.cos = pm_mulh_add(pm_mulh(dir.cos, self->along.cos), dir.sin, self->along.sin),
                           .sin = pm_mulh_sub(pm_mulh(dir.sin, self->along.cos), dir.cos, self->along.sin)};
}

static inline int32_t expected(const third_integration_t *self, pm_half_dir_t phase)
{
    return pm_shl(pm_mulh(self->size, phase.cos), 4);
}

/* s c (1 + c^2) (a - Re z), Q17 */
static inline int32_t of_speed(const third_integration_t *self, pm_half_dir_t phase)
{
    const int32_t lacks = pm_shl(pm_sat(self->share - self->third.last.d, THIRD_Z_BITS), 10); /* Q27 */
    const int32_t more = pm_shl(PM_ONE / 16 + pm_mulh(phase.cos, phase.cos), 4);              /* Q28 */
    return pm_mulh(pm_mulh(pm_shl(pm_mulh(phase.sin, phase.cos), 4), more), lacks) / 4;       /* of Q19 */
}

static inline pm_q_t eps_of(const third_integration_t *self)
{
    return pm_frac(pm_shl(self->seen, PM_Q_BITS - THIRD_Z_BITS), PM_FRAC(1.0 / 3));
}

void third_integration_reset(third_integration_t *self, const third_integration_config_t *config,
                             const obs_in_t *in)
{
    third_reset(&self->third, &config->third, in);
    self->share = THIRD_Z_ONE;
    self->seen = 0;
    set_speed(self, config, in);
    self->x = -third_seed(&config->third, in).q;
    /* psi' = |L / (1 + j x)| (c - h sgn omega s) / (1 + g h), half a period ahead of the present: a period more than the seed */
    const pm_half_dir_t phase = phase_of(self, third_dir(in->dir));
    const pm_half_dir_t lagging = {.cos = phase.cos - pm_shl(pm_mulh(phase.sin, self->back), 2), .sin = 0};
    const pm_q_t per = pm_div(PM_ONE, PM_ONE + pm_mul(config->g, config->lead));
    self->psi = pm_mul(expected(self, lagging), per) + pm_mulh(self->x, config->third.t_s);
    self->size = config->expects ? self->size : 0;
}

void third_integration_step(third_integration_t *self, const third_integration_config_t *config,
                            const obs_in_t *in, obs_out_t *out)
{
    const pm_half_dir_t dir = third_dir(in->dir);
    const pm_half_dir_t phase = phase_of(self, dir);
    const int32_t x = third_seen(&self->third, in);
    const int32_t y = pm_mean(x, self->x);
    const int32_t psi = self->psi;
    self->x = x;
    const int32_t rise = pm_mulh(x, config->third.t_s);
    const int32_t offset = psi + pm_frac(rise, config->centre) - pm_half(expected(self, phase));
    self->psi = pm_add_sat(pm_mulh_sub(psi, offset, self->leak), rise);
    const int32_t q_30 = pm_shl_sat(pm_mulh(psi, self->lift), 3, 30) - pm_shl(pm_mulh(y, self->back), 2);
    third_compare(&self->third, dir, y, q_30, out);
    self->seen = pm_sat(self->third.last.q + of_speed(self, phase), THIRD_Z_BITS);
    out->eps = eps_of(self);
}

obs_out_t third_integration_last(const third_integration_t *self)
{
    obs_out_t out = third_last(&self->third);
    out.eps = eps_of(self);
    return out;
}

void third_integration_tie(third_integration_t *self, const third_integration_config_t *config)
{
    (void)self;
    (void)config;
}

void third_integration_slow(third_integration_t *self, const third_integration_config_t *config,
                            const obs_in_t *in, const obs_out_t *out, pm_q_t weight)
{
    (void)out;
    third_slow(&self->third, &config->third, in);
    if (weight == PM_ONE) {
        const int32_t share = pm_frac_add(self->share, self->third.last.d - self->share, K_SHARE);
        self->share = pm_clamp(share, THIRD_Z_ONE / 2, THIRD_Z_ONE + THIRD_Z_ONE / 2);
    }
    set_speed(self, config, in);
    self->size = config->expects ? self->size : 0;
}
