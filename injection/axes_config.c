#include "injection/axes.h"
#include "injection/saliency_config.h"

/* The mean age of a round's samples. */
static pm_num_t age(const maker_t *m)
{
    return pm_num_mul(pm_num(AXES_ROUND / 2U), m->base.t_s);
}

void make_axes(maker_t *m, axes_config_t *c, pm_num_t flux)
{
    make_saliency_sequence(m, &c->saliency, flux);
    c->lag = fixed(m, pm_num_mul(age(m), m->base.omega), Q_BITS, DRIVE_PARAM_f_pwm);
}

/* 0.3 rad. */
pm_num_t axes_pll_max(const maker_t *m)
{
    return pm_num_div(pm_num_ratio(3, 10), pm_num_mul(PM_NUM_TWO_PI, age(m)));
}

pm_num_t axes_amplitude(const maker_t *m, pm_num_t flux)
{
    const inductances_t L = inductances_at_zero(m);
    return pm_num_div(slope_sequence(&L, flux), pm_num(2));
}
