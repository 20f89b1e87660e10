#include "injection/pulsating_sine.h"
#include "injection/saliency_config.h"

injection_limits_t pulsating_sine_limits(const maker_t *m)
{
    return sine_limits(m);
}

void make_pulsating_sine(maker_t *m, pulsating_sine_config_t *c)
{
    const pm_num_t h_d = pm_num_div(pm_num_div(sine_flux(m), si(m, DRIVE_PARAM_L_d)), m->base.i);
    make_sine(m, &c->sine);
    make_saliency_across(m, &c->saliency, sine_flux(m));
    c->h_d = gain(m, h_d, Q_BITS, DRIVE_PARAM_v_injection);
    c->phase_measured = m->params->injection_post_comp != 0;
}

/* F (L_q - L_d) / (2 L_d L_q) */
pm_num_t pulsating_sine_answer(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    return sine_answer(m, pm_num_div(slope_across(&L, sine_flux(m)), pm_num(2)));
}
