#include "injection/initial_pulses.h"

#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#define PULSES 6

void initial_pulses_reset(initial_pulses_t *self)
{
    *self = (initial_pulses_t){0};
}

pm_procedure_t initial_pulses_step(initial_pulses_t *self, const pulses_config_t *config, pm_abc_t i,
                                   pulses_out_t *out)
{
    const uint32_t axis = self->train.pulse / 2U;
    const bool reverse = (self->train.pulse & 1U) != 0U;
    const pm_procedure_t result = pulses_step(&self->train, config, axis, reverse, i, out);
    if (result != PM_DONE) {
        return result;
    }
    pulses_add(&self->train, axis, reverse);
    const pm_ab_t vector = pm_clarke(self->train.i);
    self->w.alpha += vector.alpha;
    self->w.beta += vector.beta;
    return self->train.pulse < PULSES ? PM_RUNNING : PM_DONE;
}

static pm_procedure_t locate(initial_pulses_t *self, const pulses_config_t *config)
{
    pulses_found_t *found = &self->train.found;
    const pm_ab_t y = pulses_saliency(&self->train);
    const pm_q_t length = pm_hypot(y.alpha, y.beta);
    found->margin = pulses_margin(length, 3 * config->i_noise);
    const pm_procedure_t result =
        pulses_salient(length, pulses_sum(&self->train), config->s_min, found->margin);
    if (result != PM_DONE) {
        return result;
    }
    found->theta = pm_atan2(y.beta, y.alpha) / 2U;
    const pulses_pole_t limits = {
        .bridge = config->i_bridge, .noise = 2 * config->i_noise, .reversed = config->reversed};
    return pulses_pole(self->w, &limits, found);
}

pm_procedure_t initial_pulses_find(initial_pulses_t *self, const pulses_config_t *config)
{
    const pm_procedure_t balanced = pulses_balance(&self->train);
    if (balanced != PM_DONE) {
        return balanced;
    }
    return locate(self, config);
}
