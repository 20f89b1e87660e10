#include "bldc/third_missing.h"

#define SETTLED 4U /* samples behind the freewheeling */
#define OF_MEAN 8

static void begin(third_swing_t *self, pm_q_t x)
{
    *self = (third_swing_t){.mean = x, .least = x, .most = x};
}

static pm_q_t follow(third_swing_t *self, pm_q_t x)
{
    self->mean += (x - self->mean) / OF_MEAN;
    self->least = pm_min(self->least, self->mean);
    self->most = pm_max(self->most, self->mean);
    return self->most - self->least;
}

void third_missing_step(third_missing_t *self, const third_missing_config_t *config,
                        const third_missing_in_t *in)
{
    const zero_sample_t *sample = in->sample;
    const pm_q_t v = sample->v[in->leg];
    const pm_q_t within = in->legs == ZERO_LEGS_HIGH ? -config->rail : config->rail;
    const uint8_t place = (uint8_t)(in->sector * 4U + (uint8_t)in->legs);
    if (place != self->place || v <= config->rail || v >= sample->v_dc - within) {
        self->place = place;
        self->samples = 0;
        return;
    }
    const pm_q_t e = v - pm_half((int32_t)in->legs * sample->v_dc);
    if (self->samples < SETTLED) {
        self->samples++;
        begin(&self->terminal, e);
        begin(&self->zero, in->v_zero);
        return;
    }
    const pm_q_t asked = pm_mul_sat(follow(&self->terminal, e), config->share);
    const pm_q_t shown = follow(&self->zero, in->v_zero);
    if (asked > config->least) {
        self->missing = shown < asked;
    }
}
