#include "observers/third_integration.h"

#include "firmware/math/root.h"

static void set_speed(third_integration_t *self, const third_integration_config_t *config, pm_q_t omega)
{
    const pm_q_t speed = third_speed(&config->third, omega);
    const pm_q_t lifted = pm_mul_sat(omega < 0 ? -speed : speed, PM_ONE + pm_mul(config->g, config->g));
    self->leak = pm_small(pm_mul(config->g, pm_frac(speed, config->third.t_s)));
    self->lift = pm_shl(pm_sat(lifted, PM_Q_BITS + 1), 1);
    self->back = pm_shl(omega < 0 ? -config->g : config->g, 2);
}

void third_integration_reset(third_integration_t *self, const third_integration_config_t *config,
                             const obs_in_t *in)
{
    third_reset(&self->third, &config->third, in);
    set_speed(self, config, in->omega);
    /* psi' = (q + g sgn omega y) / (3 omega (1 + g^2)) */
    const pm_dq_t seed = third_seed(&config->third, in);
    self->x = -seed.q;
    const int32_t sum = seed.d - pm_shl(pm_mulh(seed.q, self->back), 2);
    const pm_q_t per = pm_div(PM_ONE / 64, pm_abs(self->lift) / 2); /* of 1 / lift in Q22 */
    const int32_t psi = pm_shl(pm_sat(pm_mulh(sum, per), 20), 10);
    self->psi = in->omega < 0 ? -psi : psi;
}

void third_integration_step(third_integration_t *self, const third_integration_config_t *config,
                            const obs_in_t *in, obs_out_t *out)
{
    const int32_t x = third_seen(&self->third, in);
    const int32_t y = pm_mean(x, self->x);
    const int32_t psi = self->psi;
    self->x = x;
    const int32_t rise = pm_mulh(x, config->third.t_s);
    self->psi = pm_add_sat(pm_mulh_sub(psi, psi + pm_half(rise), self->leak), rise);
    const int32_t q = pm_shl_sat(pm_mulh(psi, self->lift), 3, 30) - pm_shl(pm_mulh(y, self->back), 2);
    third_compare(&self->third, in, y, q, out);
}

obs_out_t third_integration_last(const third_integration_t *self)
{
    return third_last(&self->third);
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
    (void)weight;
    third_slow(&self->third, &config->third, in);
    set_speed(self, config, in->omega);
}
