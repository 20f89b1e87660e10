#include "injection/rotating_sine.h"
#include "injection/saliency_config.h"

#define WINDOW_LEAST 8

/* The nearest whole number of periods. */
static int32_t periods(const maker_t *m)
{
    int32_t n = 0;
    const pm_num_t exact = pm_num_div(si(m, DRIVE_PARAM_f_pwm), si(m, DRIVE_PARAM_f_injection));
    (void)pm_num_to_fixed(pm_num_add(exact, pm_num_ratio(1, 2)), 0, &n);
    return n;
}

static pm_num_t omega_h(const maker_t *m)
{
    return pm_num_div(PM_NUM_TWO_PI, pm_num_mul(pm_num(periods(m)), m->base.t_s));
}

/* The voltage is a staircase, which makes the flux at the samples larger than V_h / omega_h by x / sin x,
 * x = pi / N; within 1e-5 of its series for N >= 8. */
static pm_num_t flux(const maker_t *m)
{
    const pm_num_t x = pm_num_div(PM_NUM_TWO_PI, pm_num(2 * periods(m)));
    const pm_num_t x2 = square(x);
    const pm_num_t more =
        pm_num_mul(x2, pm_num_add(pm_num_ratio(1, 6), pm_num_mul(x2, pm_num_ratio(7, 360))));
    return pm_num_mul(pm_num_div(si(m, DRIVE_PARAM_v_injection), omega_h(m)), pm_num_add(pm_num(1), more));
}

/* From the position to the error signal: half a window and 1.5 periods. */
static pm_num_t delay(const maker_t *m)
{
    return pm_num_mul(pm_num_ratio(periods(m) + 2, 2), m->base.t_s);
}

static pm_num_t bandwidth(const maker_t *m, pm_num_t phase)
{
    return pm_num_div(phase, pm_num_mul(PM_NUM_TWO_PI, delay(m)));
}

/* R / (omega_h L_p), L_p = D / L_sa: half the sum of R / (omega_h L) of both axes. */
static pm_num_t rho(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    const pm_num_t per_L = pm_num_add(pm_num_div(pm_num(1), L.L_d), pm_num_div(pm_num(1), L.L_q));
    return pm_num_div(mul3(si(m, DRIVE_PARAM_R_s), per_L, pm_num_ratio(1, 2)), omega_h(m));
}

/* 1 + kappa^2, kappa = (L_q - L_d) / (L_q + L_d): of a resistance in all phases the positive sequence shows so
 * much. */
static pm_num_t seen_share(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    const pm_num_t kappa = pm_num_div(pm_num_sub(L.L_q, L.L_d), pm_num_add(L.L_q, L.L_d));
    return pm_num_add(pm_num(1), square(kappa));
}

injection_limits_t rotating_sine_limits(const maker_t *m)
{
    return (injection_limits_t){.pll_max = bandwidth(m, pm_num_ratio(3, 10)),
                                .current_max = bandwidth(m, pm_num_ratio(4, 10))};
}

static void make_carrier(maker_t *m, rotating_sine_config_t *c, int32_t n)
{
    c->v_h = per_unit(m, DRIVE_PARAM_v_injection, m->base.v);
    c->rho_0 = fixed(m, rho(m), Q_BITS, DRIVE_PARAM_R_s);
    c->rho_m0 = fixed(m, pm_num_mul(rho(m), seen_share(m)), Q_BITS, DRIVE_PARAM_R_s);
    c->n = (uint16_t)n;
    c->per_n = fixed(m, pm_num_ratio(1, n), FRAC_BITS, DRIVE_PARAM_f_injection);
    c->step = UINT32_MAX / (uint32_t)n;
    c->lag = 3U * (c->step / 2U) + PM_TURN(0.25);
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
    const int32_t n = periods(m);
    if (n < WINDOW_LEAST || n > WINDOW_MOST) {
        refuse(m, DRIVE_PARAM_f_injection, "must lie between a fortieth and an eighth of f_pwm");
        return;
    }
    make_saliency_sequence(m, &c->saliency, flux(m));
    make_carrier(m, c, n);
    c->with_load = load_counts(m);
    c->positive_sequence = m->params->injection_post_comp != 0;
}

/* I_n, of which the window leaves sqrt(2 / N) of a sample's noise. */
pm_num_t rotating_sine_answer(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    const pm_num_t I_n = pm_num_div(slope_sequence(&L, flux(m)), pm_num(2));
    return pm_num_mul(I_n, pm_num_sqrt(pm_num_ratio(periods(m), 2)));
}
