#include "injection/pulse_choice.h"

#if PM_HAS(pulse_choice)

static pm_num_t most(pm_num_t a, pm_num_t b)
{
    return pm_num_cmp(a, b) > 0 ? a : b;
}

static pm_num_t as_told(maker_t *m)
{
    if (m->params->i_pulse > m->params->i_limit) {
        refuse(m, DRIVE_PARAM_i_pulse, "beyond what the board bears: schematic");
    }
    return si(m, DRIVE_PARAM_i_pulse);
}

pm_num_t pulse_choice_current(maker_t *m)
{
    if (m->params->pulse_choice == 0) {
        return as_told(m);
    }
    const pm_num_t L_d = si(m, DRIVE_PARAM_L_d);
    const pm_num_t L_q = si(m, DRIVE_PARAM_L_q);
    const pm_num_t i_rated = si(m, DRIVE_PARAM_i_rated);
    const pm_num_t bears = least(si(m, DRIVE_PARAM_i_trip), si(m, DRIVE_PARAM_i_limit));
    const pm_num_t v = pm_num_mul(pm_num_ratio(2, 3), si(m, DRIVE_PARAM_v_dc_nominal));
    const pm_num_t saliency = pm_num_sub(L_q, L_d);
    const pm_num_t noise = mul3(pm_num(29), si(m, DRIVE_PARAM_i_noise), L_q);
    pm_num_t i =
        most(i_rated, pm_num_div(noise, saliency)); /* without a saliency: 0, and pulses are not the start */
    i = least(i, pm_num_mul(pm_num_ratio(5, 4), i_rated));
    i = least(i, pm_num_mul(pm_num_ratio(2, 3), bears));
    return least(i,
                 mul3(v, pm_num_sqrt(pm_num_div(L_q, L_d)), pm_num_div(pm_num(1), si(m, DRIVE_PARAM_R_s))));
}

#endif
