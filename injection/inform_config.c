#include "injection/inform.h"
#include "injection/saliency_config.h"

/* The fundamental current is half a period old in the mean, as that of the square wave. */
injection_limits_t inform_limits(const maker_t *m)
{
    return (injection_limits_t){.pll_max = axes_pll_max(m),
                                .current_max = pm_num_div(si(m, DRIVE_PARAM_f_pwm), pm_num(20))};
}

void make_inform(maker_t *m, inform_config_t *c)
{
    make_axes(m, &c->axes, flux_of_period(m));
    c->v_h = per_unit(m, DRIVE_PARAM_v_injection, m->base.v);
}

/* The mean of a round of differences of two samples has the noise of one / sqrt(6). */
pm_num_t inform_answer(const maker_t *m)
{
    return pm_num_mul(axes_amplitude(m, flux_of_period(m)), pm_num_sqrt(pm_num(6)));
}
