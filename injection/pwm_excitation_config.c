#include "injection/pwm_excitation.h"
#include "injection/saliency_config.h"

static pm_num_t flux(const maker_t *m)
{
    return pm_num_mul(si(m, DRIVE_PARAM_v_injection), pm_num_mul(m->base.t_s, pm_num_ratio(1, 2)));
}

injection_limits_t pwm_excitation_limits(const maker_t *m)
{
    return (injection_limits_t){.pll_max = axes_pll_max(m)};
}

void make_pwm_excitation(maker_t *m, pwm_excitation_config_t *c)
{
    make_axes(m, &c->axes, flux(m));
    c->v_h = per_unit(m, DRIVE_PARAM_v_injection, m->base.v);
    c->between = (uint16_t)m->params->timer_counts;
}

/* The mean of a round of differences, of one sample and the mean of two, has the noise of one / sqrt(8). */
pm_num_t pwm_excitation_answer(const maker_t *m)
{
    return pm_num_mul(axes_amplitude(m, flux(m)), pm_num_sqrt(pm_num(8)));
}
