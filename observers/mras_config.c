#include "observers/mras.h"

#include "observers/model_config.h"

/* The adapted quantity at 50 Hz, twice the loop; the error signal fades below a quarter of the speed at which
 * the observer takes over. The speed in the reactive term lags by twice what stability needs at rated
 * current, and by 0.2 rad at least. */
void make_mras(maker_t *m, mras_config_t *c)
{
    const pm_num_t L = pm_num_div(si(m, DRIVE_PARAM_L_d), m->inductance);
    const pm_num_t step = pm_num_mul(m->base.t_s, m->base.omega);
    make_model(m, &c->model);
    (void)fixed(m, pm_num_div(L, step), 24, DRIVE_PARAM_L_d);
    (void)fixed(m, pm_num_div(step, L), 30, DRIVE_PARAM_L_d);
    c->k = fixed(m, mul3(PM_NUM_TWO_PI, pm_num(50), m->base.t_s), FRAC_BITS, DRIVE_PARAM_f_pwm);
    const pm_q_t tied =
        fixed(m, least(pm_num_div(OBSERVER_TIE, m->base.omega), pm_num(1)), Q_BITS, DRIVE_PARAM_speed_trip);
    c->emf_min = pm_max(1, pm_mul(speed(m, DRIVE_PARAM_speed_low) / 4, c->model.psi_m));
    c->emf_tied = pm_max(c->emf_min, pm_mul(tied, c->model.psi_m));
    const pm_num_t dL = pm_num_sub(si(m, DRIVE_PARAM_L_q), si(m, DRIVE_PARAM_L_d));
    const pm_num_t saliency = pm_num_sqrt(square(dL)); /* of either sign */
    const pm_num_t needed =
        pm_num_div(pm_num_mul(saliency, si(m, DRIVE_PARAM_i_rated)), si(m, DRIVE_PARAM_psi_m));
    const pm_num_t lag = pm_num_add(pm_num_mul(pm_num(2), needed), pm_num_ratio(1, 5));
    const pm_num_t turn = pm_num_div(pm_num_mul(m->base.omega, m->t_slow), lag);
    c->turn = fixed(m, least(turn, pm_num_ratio(49, 100)), FRAC_BITS, DRIVE_PARAM_f_pwm);
}
