#include "observers/third_pair.h"

void third_pair_reset(third_pair_t *self, const third_pair_config_t *config, const obs_in_t *in)
{
    third_reset(&self->third, &config->third, in);
}

void third_pair_step(third_pair_t *self, const third_pair_config_t *config, const obs_in_t *in,
                     obs_out_t *out)
{
    (void)config;
    third_compare(&self->third, third_dir(in->dir), third_seen(&self->third, in), third_seen_second(in), out);
}

obs_out_t third_pair_last(const third_pair_t *self)
{
    return third_last(&self->third);
}

void third_pair_tie(third_pair_t *self, const third_pair_config_t *config)
{
    (void)self;
    (void)config;
}

void third_pair_slow(third_pair_t *self, const third_pair_config_t *config, const obs_in_t *in,
                     const obs_out_t *out, pm_q_t weight)
{
    (void)out;
    (void)weight;
    third_slow(&self->third, &config->third, in);
}
