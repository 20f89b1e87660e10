#include "observers/third_sogi.h"

#include "firmware/math/trig.h"

static void set_speed(third_sogi_t *self, const third_sogi_config_t *config, pm_q_t omega)
{
    const pm_q_t turn = 3 * pm_frac(omega, config->third.t_s); /* rad */
    self->turn = pm_dir((pm_angle_t)pm_rad_to_angle(turn));
    const pm_q_t least = pm_frac(third_speed(&config->third, omega), config->third.t_s);
    self->k = pm_small(pm_mul(config->k, least));
}

void third_sogi_reset(third_sogi_t *self, const third_sogi_config_t *config, const obs_in_t *in)
{
    third_reset(&self->third, &config->third, in);
    set_speed(self, config, in->omega);
    const pm_dq_t seed = third_seed(&config->third, in);
    self->sogi = (pm_sogi_t){.y = -seed.q, .q = seed.d, .half = 0};
}

void third_sogi_step(third_sogi_t *self, const third_sogi_config_t *config, const obs_in_t *in,
                     obs_out_t *out)
{
    (void)config;
    const int32_t x = third_seen(&self->third, in);
    pm_sogi_step(&self->sogi, pm_pair_dir(&self->turn), self->k, x);
    third_learn(&self->third, in, x - self->sogi.y);
    third_compare(&self->third, third_dir(in->dir), self->sogi.y, self->sogi.q, out);
}

obs_out_t third_sogi_last(const third_sogi_t *self)
{
    return third_last(&self->third);
}

void third_sogi_tie(third_sogi_t *self, const third_sogi_config_t *config)
{
    (void)self;
    (void)config;
}

void third_sogi_slow(third_sogi_t *self, const third_sogi_config_t *config, const obs_in_t *in,
                     const obs_out_t *out, pm_q_t weight)
{
    (void)out;
    (void)weight;
    third_slow(&self->third, &config->third, in);
    set_speed(self, config, in->omega);
}
