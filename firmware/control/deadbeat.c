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

/* Where the acting voltage takes the current by the end of the period. */
static inline pm_dq_t predicted(const deadbeat_t *self, const deadbeat_config_t *c, pm_dq_t i, pm_q_t omega)
{
    const pm_q_t psi_d = c->psi_m + pm_mul(c->L_d, i.d);
    const pm_q_t psi_q = pm_mul(c->L_q, i.q);
    const pm_q_t w_d = self->v.d - pm_mul(c->R, i.d) + pm_mul(omega, psi_q);
    const pm_q_t w_q = self->v.q - pm_mul(c->R, i.q) - pm_mul(omega, psi_d);
    return (pm_dq_t){.d = i.d + pm_mul(c->per_L_d, w_d), .q = i.q + pm_mul(c->per_L_q, w_q)};
}

void deadbeat_step(deadbeat_t *self, const deadbeat_config_t *config, const regulator_in_t *in,
                   regulator_out_t *out)
{
    const deadbeat_config_t *c = config;
    const pm_q_t omega = in->omega;
    const pm_dq_t i = predicted(self, c, in->i, omega);
    const pm_q_t psi_d = c->psi_m + pm_mul(c->L_d, i.d);
    const pm_q_t psi_q = pm_mul(c->L_q, i.q);
    const pm_q_t model_d = pm_mul(c->R, i.d) - pm_mul(omega, psi_q);
    const pm_q_t model_q = pm_mul(c->R, i.q) + pm_mul(omega, psi_d);
    pm_dq_t u = {.d = pm_gain_add(pm_widen(model_d), in->i_ref.d - i.d, c->k_d),
                 .q = pm_gain_add(pm_widen(model_q), in->i_ref.q - i.q, c->k_q)};
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
