#include "injection/saliency_config.h"
#include "injection/stationary_sine.h"

injection_limits_t stationary_sine_limits(const maker_t *m)
{
    return sine_limits(m);
}

static pm_num_t slope(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    return slope_sequence(&L, sine_flux(m));
}

void make_stationary_sine(maker_t *m, stationary_sine_config_t *c)
{
    make_sine(m, &c->sine);
    make_stationary(m, &c->stationary, slope(m), (uint16_t)(c->sine.n + 2U));
    make_saliency_sequence(m, &c->saliency, sine_flux(m));
    const pm_num_t tau = pm_num_mul(pm_num_ratio((int32_t)c->sine.n - 1, 2), m->base.t_s);
    c->tau = fixed(m, pm_num_mul(tau, m->base.omega), Q_BITS, DRIVE_PARAM_f_pwm);
    c->phase_measured = m->params->injection_post_comp != 0;
}

pm_num_t stationary_sine_answer(const maker_t *m)
{
    return sine_answer(m, pm_num_div(slope(m), pm_num(2))); /* I_n */
}
