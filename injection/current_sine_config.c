#include "firmware/math/image.h"
#include "injection/current_sine.h"
#include "injection/saliency_config.h"

#if PM_HAS(current_sine)

injection_limits_t current_sine_limits(const maker_t *m)
{
    return (injection_limits_t){.pll_max = sine_limits(m).pll_max};
}

/* I_h = v_injection T_s / (2 sin(a / 2) L_d); within 1e-4 for N >= 8. */
static pm_num_t i_carrier(const maker_t *m)
{
    const pm_num_t a = pm_num_mul(sine_omega(m), m->base.t_s);
    const pm_num_t less = pm_num_sub(pm_num(1), pm_num_div(square(a), pm_num(24)));
    const pm_num_t change =
        pm_num_div(pm_num_mul(si(m, DRIVE_PARAM_v_injection), m->base.t_s), si(m, DRIVE_PARAM_L_d));
    return pm_num_div(change, pm_num_mul(a, less));
}

/* L_q / T_s through the incremental values without load and at rated current. */
static void make_across(maker_t *m, current_sine_config_t *c)
{
    const pm_num_t per_L = pm_num_mul(m->impedance, m->base.t_s);
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    const pm_num_t zero = pm_num_div(inductances_at_zero(m).L_q, per_L);
    const pm_num_t rated = pm_num_div(inductances_at_rated(m).L_q, per_L);
    c->k_0 = fixed(m, zero, CURRENT_SINE_K_BITS, DRIVE_PARAM_L_q);
    c->k_2 = fixed(m, pm_num_div(pm_num_sub(rated, zero), square(i_rated)), CURRENT_SINE_K_2_BITS,
                   DRIVE_PARAM_L_qh_rated);
}

#if PM_HAS(counted_carrier)
/* 2 sin(3/4 a) I_h; within 1e-3 for N >= 8. */
static pm_num_t later(const maker_t *m)
{
    const pm_num_t x = mul3(pm_num_ratio(3, 4), sine_omega(m), m->base.t_s);
    const pm_num_t less = pm_num_sub(pm_num(1), pm_num_div(square(x), pm_num(6)));
    return mul3(pm_num_mul(pm_num(2), i_carrier(m)), x, less);
}
#endif

void make_current_sine(maker_t *m, current_sine_config_t *c)
{
    make_sine(m, &c->sine);
    c->sine.lag = 5U * (c->sine.step / 2U) - PM_TURN(0.25); /* of V_d: two periods and a half behind i_d* */
    make_saliency_held(m, &c->saliency);
    make_across(m, c);
    c->i_h = fixed(m, pm_num_div(i_carrier(m), m->base.i), Q_BITS, DRIVE_PARAM_v_injection);
#if PM_HAS(counted_carrier)
    c->i_later = fixed(m, pm_num_div(later(m), m->base.i), Q_BITS, DRIVE_PARAM_v_injection);
#endif
    c->v_d = per_unit(m, DRIVE_PARAM_v_injection, m->base.v);
    c->half_turn =
        fixed(m, pm_num_div(pm_num_mul(m->base.omega, m->base.t_s), pm_num(2)), Q_BITS, DRIVE_PARAM_f_pwm);
    c->voltage_read = m->params->injection_post_comp != 0;
}

/* (L_q - L_d) / (2 L_q) I_h; of a difference over one period of the carrier the noise is a third of that of the window's
 * sample. */
pm_num_t current_sine_answer(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    const pm_num_t share = pm_num_div(pm_num_sub(L.L_q, L.L_d), pm_num_mul(pm_num(2), L.L_q));
    return pm_num_mul(sine_answer(m, pm_num_mul(i_carrier(m), share)), pm_num_ratio(1, 2));
}

#endif
