#include "observers/active_flux.h"

#include "observers/model_config.h"

/* R follows in 8 ms at rated current: docs/decisions/004-resistance.md. */
#define FOLLOW pm_num_ratio(1, 8)

void make_active_flux(maker_t *m, active_flux_config_t *c)
{
    const pm_num_t step = pm_num_mul(m->base.t_s, m->base.omega);
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    make_model(m, &c->model);
    make_resistance(m, &c->resistance,
                    pm_num_div(pm_num_mul(FOLLOW, OBSERVER_TIE), pm_num_mul(m->base.omega, square(i_rated))));
    c->g = fixed(m, pm_num_mul(si(m, DRIVE_PARAM_flux_gain), step), FRAC_BITS, DRIVE_PARAM_flux_gain);
    c->k_seed = fixed(m, pm_num_mul(OBSERVER_TIE, m->base.t_s), FRAC_BITS, DRIVE_PARAM_f_pwm);
}
