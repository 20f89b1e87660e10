#include "firmware/control/deadbeat.h"

#include "firmware/control/voltage_circle.h"
#include "firmware/math/compiler.h"

void deadbeat_reset(deadbeat_t *self, const deadbeat_config_t *config, pm_dq_t v, pm_dq_t i, pm_q_t omega)
{
    (void)config;
    (void)i;
    (void)omega;
    self->v = v;
}

void deadbeat_step(deadbeat_t *self, const deadbeat_config_t *config, const regulator_in_t *in,
                   regulator_out_t *out)
{
    const deadbeat_config_t *c = config;
    const pm_dq_t i = winding_after(&c->model, self->v, in->i, in->omega);
    const pm_dq_t against = winding_against(&c->model, i, in->omega);
    const pm_dq_t e = {.d = pm_sub_sat(in->i_ref.d, i.d), .q = pm_sub_sat(in->i_ref.q, i.q)};
    pm_dq_t u = {.d = pm_widen(against.d) + pm_shl(pm_mulh(e.d, c->k_d), 1),
                 .q = pm_widen(against.q) + pm_shl(pm_mulh(e.q, c->k_q), 1)};
    const pm_wide_t top = pm_widen(in->v_max);
    if (pm_rarely(voltage_beyond(u, top))) {
        u = voltage_within(u, top);
        out->limited = true;
    }
    out->v = u;
    self->v = (pm_dq_t){.d = pm_narrow(u.d), .q = pm_narrow(u.q)};
}

void deadbeat_slow_down(deadbeat_config_t *config, pm_unit_t share)
{
    config->k_d = pm_unit(config->k_d, share);
    config->k_q = pm_unit(config->k_q, share);
}
