#include "injection/rotating_sine.h"
#include "injection/saliency_config.h"

/* R / (omega_h L_p), L_p = D / L_sa: half the sum of R / (omega_h L) of both axes. */
static pm_num_t rho(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    const pm_num_t per_L = pm_num_add(pm_num_div(pm_num(1), L.L_d), pm_num_div(pm_num(1), L.L_q));
    return pm_num_div(mul3(si(m, DRIVE_PARAM_R_s), per_L, pm_num_ratio(1, 2)), sine_omega(m));
}

/* 1 + kappa^2, kappa = (L_q - L_d) / (L_q + L_d): of a resistance in all phases the positive sequence shows so
 * much. */
static pm_num_t seen_share(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    const pm_num_t kappa = pm_num_div(pm_num_sub(L.L_q, L.L_d), pm_num_add(L.L_q, L.L_d));
    return pm_num_add(pm_num(1), square(kappa));
}

/* What dead time and devices can take of the carrier, and R where it is half as large again. */
static pm_num_t most_beyond(const maker_t *m)
{
    const pm_num_t lost = pm_num_add(dead_voltage(m), si(m, DRIVE_PARAM_device_drop));
    const pm_num_t of_inverter =
        pm_num_mul(pm_num_div(lost, si(m, DRIVE_PARAM_v_injection)), pm_num_ratio(5, 4));
    return pm_num_add(of_inverter, pm_num_mul(rho(m), pm_num_ratio(1, 2)));
}

/* Below I_p the carrier governs the signs of the currents, and a compensation by the fundamental disturbs both
 * sequences there. */
injection_limits_t rotating_sine_limits(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    const pm_num_t per_L = pm_num_add(pm_num_div(pm_num(1), L.L_d), pm_num_div(pm_num(1), L.L_q));
    injection_limits_t limits = sine_limits(m);
    if (m->params->injection_pre_comp == 0) {
        limits.comp_zone = mul3(pm_num_ratio(3, 2), sine_flux(m), per_L); /* three times I_p */
    }
    return limits;
}

/* kappa = (L_q - L_d) / (L_q + L_d) >= 0.1 */
static bool load_counts(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    const pm_num_t least_difference = pm_num_mul(pm_num_add(L.L_q, L.L_d), pm_num_ratio(1, 10));
    return pm_num_cmp(pm_num_sub(L.L_q, L.L_d), least_difference) >= 0;
}

void make_rotating_sine(maker_t *m, rotating_sine_config_t *c)
{
    make_sine(m, &c->sine);
    make_saliency_sequence(m, &c->saliency, sine_flux(m));
    c->rho_0 = fixed(m, rho(m), Q_BITS, DRIVE_PARAM_R_s);
    c->rho_m0 = fixed(m, pm_num_mul(rho(m), seen_share(m)), Q_BITS, DRIVE_PARAM_R_s);
    c->most = fixed(m, most_beyond(m), Q_BITS, DRIVE_PARAM_v_injection);
    c->with_load = load_counts(m);
    c->positive_sequence = m->params->injection_post_comp != 0;
    c->counted_in = m->params->injection_pre_comp != 0;
}

pm_num_t rotating_sine_answer(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    return sine_answer(m, pm_num_div(slope_sequence(&L, sine_flux(m)), pm_num(2))); /* I_n */
}
