#include "observers/third_pair_flux.h"

#include "firmware/math/root.h"

static void set_speed(third_pair_flux_t *self, const third_pair_flux_config_t *config, pm_q_t omega)
{
    const pm_q_t speed = third_speed(&config->third, omega);
    self->leak = pm_small(pm_mul(config->g, pm_frac(speed, config->third.t_s)));
    self->lift = pm_shl(pm_sat(omega < 0 ? -speed : speed, PM_Q_BITS + 1), 1);
    self->back = pm_shl(omega < 0 ? -config->g : config->g, 2);
}

/* What the sums hold of a rotor at the present position: the fluxes times 1 / (1 - j g sgn omega). */
static void seed(third_pair_flux_t *self, const third_pair_flux_config_t *config, const obs_in_t *in)
{
    const third_point_t at = third_point(&config->third, in);
    const pm_half_dir_t dir = third_dir(in->dir);
    const pm_q_t g = in->omega < 0 ? -config->g : config->g;
    const pm_q_t shrink = pm_div(pm_mul(config->third.psi_3, pm_div(PM_ONE, PM_ONE + pm_mul(g, g))),
                                 PM_ONE + pm_mul(at.x, at.x));
    /* L (1 - j x) (1 + j g), L = l.d - j l.q */
    const pm_dq_t turned = {.d = at.l.d - pm_mul(at.x, at.l.q), .q = -at.l.q - pm_mul(at.x, at.l.d)};
    const pm_dq_t held = {.d = turned.d - pm_mul(g, turned.q), .q = turned.q + pm_mul(g, turned.d)};
    const pm_q_t re = pm_mul(shrink, held.d);
    const pm_q_t im = pm_mul(shrink, held.q);
    const pm_q_t a = pm_shl(pm_mulh(re, dir.cos) - pm_mulh(im, dir.sin), 2);
    const pm_q_t b = pm_shl(pm_mulh(re, dir.sin) + pm_mulh(im, dir.cos), 2);
    self->psi_1 = pm_shl(pm_sat(a, PM_Q_BITS - 1), 30 - PM_Q_BITS);
    self->psi_2 = pm_shl(pm_sat(b, PM_Q_BITS - 1), 30 - PM_Q_BITS);
}

void third_pair_flux_reset(third_pair_flux_t *self, const third_pair_flux_config_t *config,
                           const obs_in_t *in)
{
    third_reset(&self->third, &config->third, in);
    set_speed(self, config, in->omega);
    seed(self, config, in);
}

static inline int32_t add(const third_pair_flux_t *self, int32_t psi, int32_t x, pm_frac_t t_s)
{
    return pm_add_sat(pm_mulh_sub(psi, psi, self->leak), pm_mulh(x, t_s));
}

void third_pair_flux_step(third_pair_flux_t *self, const third_pair_flux_config_t *config, const obs_in_t *in,
                          obs_out_t *out)
{
    const pm_frac_t t_s = config->third.t_s;
    self->psi_1 = add(self, self->psi_1, third_seen(&self->third, in), t_s);
    self->psi_2 = add(self, self->psi_2, third_seen_second(in), t_s);
    const int32_t re = self->psi_1 + pm_shl(pm_mulh(self->psi_2, self->back), 2);
    const int32_t im = self->psi_2 - pm_shl(pm_mulh(self->psi_1, self->back), 2);
    const int32_t q = pm_shl_sat(pm_mulh(re, self->lift), 3, 30);
    const int32_t y = -pm_shl_sat(pm_mulh(im, self->lift), 3, 30);
    third_compare(&self->third, third_dir(in->dir), y, q, out);
}

obs_out_t third_pair_flux_last(const third_pair_flux_t *self)
{
    return third_last(&self->third);
}

void third_pair_flux_tie(third_pair_flux_t *self, const third_pair_flux_config_t *config)
{
    (void)self;
    (void)config;
}

void third_pair_flux_slow(third_pair_flux_t *self, const third_pair_flux_config_t *config, const obs_in_t *in,
                          const obs_out_t *out, pm_q_t weight)
{
    (void)out;
    (void)weight;
    third_slow(&self->third, &config->third, in);
    set_speed(self, config, in->omega);
}
