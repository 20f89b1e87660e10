#include "injection/pulsating_square.h"
#include "injection/saliency_config.h"

/* The mean of two samples is half a period old: up to there control of the current overshoots by a tenth. From
 * -F / (2 L_d) to F / (2 L_d) in a period; a leg's edges are at both ends of that and in the next period in its middle. */
injection_limits_t pulsating_square_limits(const maker_t *m)
{
    return (injection_limits_t){
        .current_max = pm_num_div(si(m, DRIVE_PARAM_f_pwm), pm_num(20)),
        .swing = pm_num_div(flux_of_period(m), pm_num_mul(pm_num(4), si(m, DRIVE_PARAM_L_d))),
    };
}

void make_pulsating_square(maker_t *m, pulsating_square_config_t *c)
{
    const pm_num_t h_d = pm_num_div(pm_num_div(flux_of_period(m), si(m, DRIVE_PARAM_L_d)), m->base.i);
    make_saliency_across(m, &c->saliency, flux_of_period(m));
    c->v_h = per_unit(m, DRIVE_PARAM_v_injection, m->base.v);
    c->h_d = fixed(m, h_d, Q_BITS, DRIVE_PARAM_v_injection);
    c->h_d_inverse = fixed(m, pm_num_div(pm_num(1), h_d), SMALL_BITS, DRIVE_PARAM_v_injection);
    c->half_step = fixed(m, pm_num_mul(pm_num_mul(m->base.t_s, m->base.omega), pm_num_ratio(1, 2)), FRAC_BITS,
                         DRIVE_PARAM_f_pwm);
}

/* F (L_q - L_d) / (2 L_d L_q) */
pm_num_t pulsating_square_answer(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    return pm_num_div(slope_across(&L, flux_of_period(m)), pm_num(2));
}
