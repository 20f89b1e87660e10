#include "injection/saliency_config.h"
#include "injection/stationary_square.h"

/* The mean of two samples is half a period old: as pulsating_square_limits(). */
injection_limits_t stationary_square_limits(const maker_t *m)
{
    return (injection_limits_t){.current_max = pm_num_div(si(m, DRIVE_PARAM_f_pwm), pm_num(20))};
}

static pm_num_t slope(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    return slope_sequence(&L, flux_of_period(m));
}

void make_stationary_square(maker_t *m, stationary_square_config_t *c)
{
    make_stationary(m, &c->stationary, slope(m), STATIONARY_SQUARE_ANSWER + STATIONARY_SQUARE_SETTLED);
    make_saliency_sequence(m, &c->saliency, flux_of_period(m));
    c->v_h = per_unit(m, DRIVE_PARAM_v_injection, m->base.v);
    c->half_step = fixed(m, pm_num_mul(pm_num_mul(m->base.t_s, m->base.omega), pm_num_ratio(1, 2)), FRAC_BITS,
                         DRIVE_PARAM_f_pwm);
}

/* I_n, of one difference. */
pm_num_t stationary_square_answer(const maker_t *m)
{
    return pm_num_div(slope(m), pm_num(2));
}
