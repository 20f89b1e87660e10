#include "firmware/control/finite_set.h"

#include "firmware/control/switch_states.h"

#if REGULATION_HOLDS

/* Wide enough for any voltage that deadbeat control asks for. */
#define V_ANY PM_Q(7.9)

void finite_set_reset(finite_set_t *self, const finite_set_config_t *config, pm_dq_t v, pm_dq_t i,
                      pm_q_t omega)
{
    deadbeat_reset(&self->deadbeat, &config->deadbeat, v, i, omega);
    self->legs = PM_LEGS_ALL(PM_LEG_LOW);
}

void finite_set_step(finite_set_t *self, const finite_set_config_t *config, const regulator_in_t *in,
                     regulator_out_t *out)
{
    regulator_in_t any = *in;
    any.v_max = V_ANY;
    regulator_out_t wanted = {.limited = false};
    deadbeat_step(&self->deadbeat, &config->deadbeat, &any, &wanted);
    /* Q25 with a direction of Q30: Q23. Far beyond the link, only the direction counts. */
    const pm_dq_t v = {.d = pm_shl(pm_sat(wanted.v.d, 28), 3), .q = pm_shl(pm_sat(wanted.v.q, 28), 3)};
    const switch_nearest_t n = switch_nearest(pm_park_inverse_quarter(v, in->ahead));
    const pm_q_t third = pm_frac(in->v_dc, PM_FRAC(1.0 / 3 / 32)); /* Q23 */
    self->deadbeat.v = (pm_dq_t){.d = 0, .q = 0};
    if (n.along > third) {
        self->deadbeat.v = switch_voltage(n.sector, in->v_dc, in->ahead);
        self->legs = switch_legs[n.sector];
    } else {
        self->legs = switch_zero(self->legs);
    }
    out->v = (pm_dq_t){.d = pm_widen(self->deadbeat.v.d), .q = pm_widen(self->deadbeat.v.q)};
    out->legs = self->legs;
    const pm_wide_t beyond = pm_widen(in->v_dc);
    out->limited = out->limited || pm_abs(wanted.v.d) > beyond || pm_abs(wanted.v.q) > beyond;
}

void finite_set_slow_down(finite_set_config_t *config, pm_unit_t share)
{
    deadbeat_slow_down(&config->deadbeat, share);
}

#endif
