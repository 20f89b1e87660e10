#include "injection/basic_pulses.h"

#define PULSES 6

void basic_pulses_reset(basic_pulses_t *self)
{
    *self = (basic_pulses_t){0};
}

pm_procedure_t basic_pulses_step(basic_pulses_t *self, const pulses_config_t *config, pm_abc_t i,
                                 pulses_out_t *out)
{
    const uint32_t axis = self->train.pulse / 2U;
    const bool reverse = (self->train.pulse & 1U) != 0U;
    const pm_procedure_t result = pulses_step(&self->train, config, axis, reverse, i, out);
    if (result != PM_DONE) {
        return result;
    }
    pulses_add(&self->train, axis, reverse);
    self->difference[axis] +=
        pulses_leg(&self->train.i, axis); /* P_x+ - P_x-: the current of - is negative */
    return self->train.pulse < PULSES ? PM_RUNNING : PM_DONE;
}

/* w is two thirds of that of six vectors. */
primary_config_t basic_pulses_limits(const pulses_config_t *config)
{
    return (primary_config_t){.s_min = config->s_min,
                              .pole = {.bridge = pm_mul(PM_Q(2.0 / 3), config->i_bridge),
                                       .noise = pm_max(pm_mul(PM_Q(1.155), config->i_noise), 1),
                                       .reversed = config->reversed}};
}

pm_procedure_t basic_pulses_find(basic_pulses_t *self, const pulses_config_t *config)
{
    const primary_config_t limits = basic_pulses_limits(config);
    primary_t response;
    for (uint32_t x = 0; x < PULSES_AXES; x++) {
        response.sum[x] = self->train.e[x][x];
        response.difference[x] = self->difference[x];
    }
    return primary_locate(&response, &limits, &self->train.found);
}
