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

/* R i and the EMF of a current, saturated: what no machine has cannot overflow. */
static inline pm_dq_t opposing(const deadbeat_config_t *c, pm_dq_t i, pm_q_t omega)
{
    const pm_q_t psi_d = pm_add_sat(c->psi_m, pm_mul_sat(c->L_d, i.d));
    const pm_q_t psi_q = pm_mul_sat(c->L_q, i.q);
    return (pm_dq_t){.d = pm_sub_sat(pm_mul_sat(c->R, i.d), pm_mul_sat(omega, psi_q)),
                     .q = pm_add_sat(pm_mul_sat(c->R, i.q), pm_mul_sat(omega, psi_d))};
}

/* Where the acting voltage takes the current by the end of the period. */
static inline pm_dq_t predicted(const deadbeat_t *self, const deadbeat_config_t *c, pm_dq_t i, pm_q_t omega)
{
    const pm_dq_t against = opposing(c, i, omega);
    const pm_q_t change_d = pm_mul_sat(c->per_L_d, pm_sub_sat(self->v.d, against.d));
    const pm_q_t change_q = pm_mul_sat(c->per_L_q, pm_sub_sat(self->v.q, against.q));
    return (pm_dq_t){.d = pm_add_sat(i.d, change_d), .q = pm_add_sat(i.q, change_q)};
}

void deadbeat_step(deadbeat_t *self, const deadbeat_config_t *config, const regulator_in_t *in,
                   regulator_out_t *out)
{
    const deadbeat_config_t *c = config;
    const pm_dq_t i = predicted(self, c, in->i, in->omega);
    const pm_dq_t model = opposing(c, i, in->omega);
    const pm_dq_t e = {.d = pm_sub_sat(in->i_ref.d, i.d), .q = pm_sub_sat(in->i_ref.q, i.q)};
    pm_dq_t u = {.d = pm_widen(model.d) + pm_shl(pm_mulh(e.d, c->k_d), 1),
                 .q = pm_widen(model.q) + pm_shl(pm_mulh(e.q, c->k_q), 1)};
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
