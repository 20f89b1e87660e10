#include "injection/dc_link_pulses.h"

#define PER_TRAIN 6U
#define BEFORE    4 /* samples */

void dc_link_pulses_reset(dc_link_pulses_t *self)
{
    *self = (dc_link_pulses_t){0};
}

static void add(dc_link_pulses_t *self, uint32_t axis, bool reverse, pm_q_t v)
{
    self->response.sum[axis] += v;
    self->response.difference[axis] += reverse ? -v : v;
}

/* As in drive_pulse() of pulses.c: what is commanded in n steps ends at step n + 2, and a zero vector follows it. */
pm_procedure_t dc_link_pulses_step(dc_link_pulses_t *self, const dc_link_pulses_config_t *config, pm_q_t v_dc,
                                   pulses_out_t *out)
{
    const uint32_t place = self->pulse % PER_TRAIN;
    const uint32_t axis = place / 2U;
    const bool reverse = (place & 1U) != 0U;
    *out = (pulses_out_t){.driven = false};
    self->timer++;
    if (self->timer <= config->wait) {
        self->before += self->timer + (uint32_t)BEFORE > config->wait ? v_dc : 0;
        return PM_RUNNING;
    }
    const uint32_t at = (uint32_t)self->timer - config->wait;
    if (at <= config->periods) {
        pulses_apply(out, axis, reverse, config->duty);
        return PM_RUNNING;
    }
    if (at == config->periods + 1U) {
        out->driven = true;
        return PM_RUNNING;
    }
    add(self, axis, reverse, self->before / BEFORE - v_dc);
    self->before = 0;
    self->timer = 0;
    self->pulse++;
    return self->pulse < config->pulses ? PM_RUNNING : PM_DONE;
}

pm_procedure_t dc_link_pulses_find(dc_link_pulses_t *self, const dc_link_pulses_config_t *config)
{
    for (uint32_t x = 0; x < PULSES_AXES; x++) {
        if (self->response.sum[x] < 5 * config->limits.pole.noise) {
            return PM_FAILED_OPEN;
        }
    }
    return primary_locate(&self->response, &config->limits, &self->found);
}
