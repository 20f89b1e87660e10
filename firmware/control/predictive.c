#include "firmware/control/predictive.h"

#include "firmware/control/switch_states.h"

#if REGULATION_HOLDS

void predictive_reset(predictive_t *self, const predictive_config_t *config, pm_dq_t v, pm_dq_t i,
                      pm_q_t omega)
{
    (void)config;
    (void)i;
    (void)omega;
    self->v = v;
    self->legs = PM_LEGS_ALL(PM_LEG_LOW);
}

/* A state and what it leaves to the reference. */
typedef struct {
    pm_q_t cost;
    pm_dq_t v;
    uint16_t legs;
} choice_t;

static inline pm_q_t cost_of(pm_q_t d, pm_q_t q)
{
    return pm_add_sat(pm_abs(d), pm_abs(q));
}

/* Error that no voltage would leave, and what a voltage takes from it. */
typedef struct {
    pm_dq_t e;
    pm_q_t per_d, per_q;
} costs_t;

/* The states of a sector and of the one opposite. */
static inline choice_t better(choice_t best, const costs_t *c, uint32_t sector, const regulator_in_t *in)
{
    const pm_dq_t v = switch_voltage(sector, in->v_dc, in->ahead);
    const pm_q_t d = pm_mul_sat(c->per_d, v.d);
    const pm_q_t q = pm_mul_sat(c->per_q, v.q);
    const pm_q_t along = cost_of(pm_sub_sat(c->e.d, d), pm_sub_sat(c->e.q, q));
    const pm_q_t against = cost_of(pm_add_sat(c->e.d, d), pm_add_sat(c->e.q, q));
    choice_t x = best;
    if (along < x.cost) {
        x = (choice_t){.cost = along, .v = v, .legs = switch_legs[sector]};
    }
    if (against < x.cost) {
        x = (choice_t){
            .cost = against, .v = {.d = -v.d, .q = -v.q}, .legs = switch_legs[sector + SWITCH_SECTORS / 2U]};
    }
    return x;
}

/* From i to the reference, or `share` of it, at no voltage. */
static inline pm_dq_t error_from(pm_dq_t i, const predictive_config_t *config, const regulator_in_t *in)
{
    const pm_dq_t zero = winding_after(&config->model, (pm_dq_t){.d = 0, .q = 0}, i, in->omega);
    const pm_dq_t way = {.d = pm_sub_sat(in->i_ref.d, i.d), .q = pm_sub_sat(in->i_ref.q, i.q)};
    return (pm_dq_t){.d = pm_sub_sat(pm_add_sat(i.d, pm_unit(way.d, config->share)), zero.d),
                     .q = pm_sub_sat(pm_add_sat(i.q, pm_unit(way.q, config->share)), zero.q)};
}

void predictive_step(predictive_t *self, const predictive_config_t *config, const regulator_in_t *in,
                     regulator_out_t *out)
{
    const winding_model_t *m = &config->model;
    const pm_dq_t i = config->compensates ? winding_after(m, self->v, in->i, in->omega) : in->i;
    costs_t c = {.e = error_from(i, config, in), .per_d = m->per_L_d, .per_q = m->per_L_q};
    if (winding_beyond(m, c.e, in->v_dc)) {
        out->limited = true;
        c.e.d = pm_mul_sat(c.e.d, config->weight_d);
        c.per_d = m->per_L_q;
    }
    choice_t best = {.cost = cost_of(c.e.d, c.e.q), .v = {.d = 0, .q = 0}, .legs = switch_zero(self->legs)};
    for (uint32_t sector = 0; sector < SWITCH_SECTORS / 2U; ++sector) {
        best = better(best, &c, sector, in);
    }
    self->v = best.v;
    self->legs = best.legs;
    out->v = (pm_dq_t){.d = pm_widen(best.v.d), .q = pm_widen(best.v.q)};
    out->legs = best.legs;
}

void predictive_slow_down(predictive_config_t *config, pm_unit_t share)
{
    config->share = pm_unit(config->share, share);
}

#endif
