#include "firmware/params/maker.h"
#include "injection/saliency_config.h"
#include "injection/three_phase_hf.h"

#define RISE_MS 16U
#define WAIT_MS 8U
#define TIME_MS 64U

static void make_time(maker_t *m, three_phase_hf_config_t *c)
{
    const uint32_t n = c->sine.n;
    const uint32_t block = (2U * m->slow_divider + n - 1U) / n * n;
    c->block = (uint16_t)block;
    c->wanted = 8;
    while (c->wanted < 32U && 2U * c->wanted * block <= TIME_MS * m->slow_divider) {
        c->wanted = (uint16_t)(2U * c->wanted);
    }
    c->settled = (uint16_t)((RISE_MS + WAIT_MS) * m->slow_divider);
    c->rise = c->share / (int32_t)(RISE_MS * m->slow_divider) + 1;
}

/* The parts of the maker stand apart: together they would be the deepest stack of the image. */
PM_APART static void make_voltage(maker_t *m, three_phase_hf_config_t *c)
{
    const pm_num_t v_dc = si(m, DRIVE_PARAM_v_dc_nominal);
    c->share = fixed(m, pm_num_div(si(m, DRIVE_PARAM_v_injection), v_dc), Q_BITS, DRIVE_PARAM_v_injection);
    const int32_t most = pm_shl(seen_on_time(m) - PM_SHARE_HALF, Q_BITS - PM_SHARE_BITS);
    if (c->share > pm_min(most, PM_Q(0.45))) {
        refuse(m, DRIVE_PARAM_v_injection, "more than the legs can make about half duty");
    }
}

/* (L_q - L_d) / (L_q + L_d) */
PM_APART static pm_num_t kappa(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    return pm_num_div(pm_num_sub(L.L_q, L.L_d), pm_num_add(L.L_q, L.L_d));
}

/* R / (omega_h L_sa) */
PM_APART static pm_num_t resistance(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    const pm_num_t reactance = pm_num_mul(sine_omega(m), pm_num_add(L.L_d, L.L_q));
    return pm_num_div(pm_num_mul(pm_num(2), si(m, DRIVE_PARAM_R_s)), reactance);
}

/* L_sa / L_p = 1 / (1 - kappa^2) */
PM_APART static void make_angles(maker_t *m, three_phase_hf_config_t *c)
{
    const pm_num_t k = kappa(m);
    const pm_num_t more = pm_num_add(pm_num(1), square(k));
    const pm_num_t less = pm_num_sub(pm_num(1), square(k));
    const pm_num_t R = resistance(m);
    c->kappa = fixed(m, k, Q_BITS, DRIVE_PARAM_L_q);
    c->rho_R = fixed(m, R, Q_BITS, DRIVE_PARAM_R_s);
    c->rho_0 = fixed(m, pm_num_div(pm_num_mul(R, more), less), Q_BITS, DRIVE_PARAM_R_s);
    c->inverter = fixed(m, pm_num_div(less, pm_num_mul(pm_num(2), more)), Q_BITS, DRIVE_PARAM_L_q);
}

/* I_p / 2 = F (1 / L_d + 1 / L_q) / 4 */
PM_APART static void make_least(maker_t *m, three_phase_hf_config_t *c)
{
    const inductances_t L = inductances_at_zero(m);
    const pm_num_t per_L = pm_num_add(pm_num_div(pm_num(1), L.L_d), pm_num_div(pm_num(1), L.L_q));
    const pm_num_t half = mul3(sine_flux(m), per_L, pm_num_ratio(1, 4));
    c->i_least =
        fixed(m, pm_num_div(half, pm_num_mul(pm_num(4), m->base.i)), Q_BITS, DRIVE_PARAM_v_injection);
}

PM_APART static void make_noise(maker_t *m, three_phase_hf_config_t *c)
{
    const int32_t count = (int32_t)c->block * c->wanted;
    const pm_num_t noise = pm_num_mul(si(m, DRIVE_PARAM_i_noise), pm_num_sqrt(pm_num_ratio(2, 3 * count)));
    c->noise = pm_max(fixed(m, pm_num_div(noise, m->base.i), Q_BITS, DRIVE_PARAM_i_noise), 1);
}

void make_three_phase_hf(maker_t *m, three_phase_hf_config_t *c)
{
    make_sine(m, &c->sine);
    if (!m->result.ok) {
        return;
    }
    make_voltage(m, c);
    make_time(m, c);
    make_angles(m, c);
    make_least(m, c);
    make_noise(m, c);
    c->reversed = m->params->L_d_falls != 0;
}
