#include "firmware/math/trig.h"
#include "injection/saliency_config.h"
#include "injection/zero_anti_rotating.h"
#include "injection/zero_pulsating.h"
#include "injection/zero_rotating.h"

#if PM_CARRIES(NEEDS_NEUTRAL)

#define V_BITS    22
#define LINK_BITS 25

/* h: the nearest whole number of periods to half a carrier. */
static int32_t half_of(const maker_t *m)
{
    int32_t h = 0;
    (void)pm_num_to_fixed(
        pm_num_div(si(m, DRIVE_PARAM_f_pwm), pm_num_mul(pm_num(2), si(m, DRIVE_PARAM_f_injection))), 0, &h);
    return h;
}

static pm_num_t ratio_of_sums(const inductances_t *L)
{
    const pm_num_t D = pm_num_sub(pm_num_mul(L->L_d, L->L_q), square(L->L_dq));
    return pm_num_div(pm_num_mul(pm_num_add(L->L_d, L->L_q), pm_num_ratio(1, 2)), D);
}

/* Of two sets, whose carriers are 90 degrees apart (zero_pair.h): the current of a set against that of the drive's inductances,
 * which are L + M,
 *   (L + M) L / (L^2 - M^2) = L / (L - M) */
static pm_num_t of_a_set(const maker_t *m)
{
#if PM_HAS(two_sets)
    if (m->params->winding == 2) {
        const pm_num_t M = si(m, DRIVE_PARAM_M_d);
        const pm_num_t L = pm_num_sub(si(m, DRIVE_PARAM_L_d), M);
        return pm_num_div(L, pm_num_sub(L, M));
    }
#endif
    (void)m;
    return pm_num(1);
}

/* A without load, V: dL_0 V_h L_sa / (2 D). */
static pm_num_t amplitude(const maker_t *m)
{
    const inductances_t L = inductances_at_zero(m);
    const pm_num_t one = mul3(si(m, DRIVE_PARAM_dL_0), si(m, DRIVE_PARAM_v_injection), ratio_of_sums(&L));
    return mul3(one, of_a_set(m), pm_num_ratio(1, 2));
}

pm_num_t zero_unit(const maker_t *m)
{
    return pm_num_mul(pm_num(8), amplitude(m));
}

static pm_num_t magnitude(pm_num_t x)
{
    return pm_num_cmp(x, pm_num(0)) < 0 ? pm_num_neg(x) : x;
}

/* kappa = sqrt(L_sd^2 + L_dq^2) / L_sa */
static pm_num_t kappa_of(const inductances_t *L)
{
    const pm_num_t twice = pm_num_add(square(pm_num_sub(L->L_q, L->L_d)), mul3(pm_num(4), L->L_dq, L->L_dq));
    return pm_num_div(pm_num_sqrt(twice), pm_num_add(L->L_q, L->L_d));
}

/* e^{-x}, 1/2 <= x <= 2: the eighth power of a fraction that is exact to 1e-6. */
static pm_num_t decay(pm_num_t x)
{
    const pm_num_t y = pm_num_mul(x, pm_num_ratio(1, 8));
    const pm_num_t even = pm_num_add(pm_num(1), pm_num_mul(square(y), pm_num_ratio(1, 12)));
    const pm_num_t odd = pm_num_mul(y, pm_num_ratio(1, 2));
    return square(square(square(pm_num_div(pm_num_sub(even, odd), pm_num_add(even, odd)))));
}

static pm_num_t periods_of_filter(const maker_t *m)
{
    const pm_num_t rc = si(m, DRIVE_PARAM_neutral_filter);
    return rc.m > 0 ? pm_num_div(m->base.t_s, rc) : pm_num(0);
}

pm_num_t zero_decay(const maker_t *m)
{
    const pm_num_t x = periods_of_filter(m);
    return x.m > 0 ? decay(x) : pm_num(0);
}

static void make_channel(maker_t *m, zero_config_t *c, pm_num_t unit)
{
    const pm_num_t x = periods_of_filter(m);
    if (pm_num_cmp(x, pm_num_ratio(49, 100)) < 0 || pm_num_cmp(x, pm_num_ratio(201, 100)) > 0) {
        refuse(m, DRIVE_PARAM_neutral_filter,
               "the zero-sequence voltage needs an RC of half a PWM period to two");
        return;
    }
    const pm_num_t a = decay(x);
    const pm_num_t now = pm_num_div(m->base.v, pm_num_mul(unit, pm_num_sub(pm_num(1), a)));
    c->v_now = fixed(m, now, V_BITS, DRIVE_PARAM_dL_0);
    c->v_past = fixed(m, pm_num_mul(now, a), V_BITS, DRIVE_PARAM_dL_0);
}

/* c / T_s of a current per unit, in `unit`. */
static pm_num_t link(const maker_t *m, pm_num_t c, pm_num_t unit)
{
    return pm_num_div(pm_num_mul(c, m->base.i), pm_num_mul(m->base.t_s, unit));
}

/* What a current of one per unit to the `power` adds to c / T_s. `id`: c at the rated current; 0: as without. */
static int32_t move(maker_t *m, drive_param_id_t id, drive_param_id_t without, int power, pm_num_t unit)
{
    const pm_num_t rated = si(m, id);
    if (rated.m == 0) {
        return 0;
    }
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    const pm_num_t by = pm_num_div(link(m, pm_num_sub(rated, si(m, without)), unit), i_rated);
    return fixed(m, power == 2 ? pm_num_div(by, i_rated) : by, LINK_BITS, id);
}

static void make_link(maker_t *m, zero_config_t *c)
{
    const pm_num_t unit = zero_unit(m);
    c->c_re = fixed(m, link(m, si(m, DRIVE_PARAM_dL_0), unit), SMALL_BITS, DRIVE_PARAM_dL_0);
    c->c_im = pm_sub_sat(
        0, fixed(m, link(m, si(m, DRIVE_PARAM_zero_L_c0), unit), SMALL_BITS, DRIVE_PARAM_zero_L_c0));
    c->c_d = move(m, DRIVE_PARAM_zero_dL_0_d, DRIVE_PARAM_dL_0, 1, unit);
    c->c_q = move(m, DRIVE_PARAM_zero_dL_0_q, DRIVE_PARAM_dL_0, 2, unit);
    c->c_cross = pm_sub_sat(0, move(m, DRIVE_PARAM_zero_L_c0_q, DRIVE_PARAM_zero_L_c0, 1, unit));
}

static void make_kappa(maker_t *m, zero_config_t *c)
{
    const inductances_t zero = inductances_at_zero(m);
    const inductances_t rated = inductances_at_rated(m);
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    const pm_num_t rise = pm_num_div(pm_num_sub(kappa_of(&rated), kappa_of(&zero)), square(i_rated));
    c->kappa_0 = fixed(m, kappa_of(&zero), Q_BITS, DRIVE_PARAM_L_q);
    c->kappa_2 = fixed(m, rise, Q_BITS, DRIVE_PARAM_L_qh_rated);
}

static void make_carrier(maker_t *m, zero_config_t *c)
{
    const int32_t h = half_of(m);
    if (h < 1 || h > (int32_t)ZERO_HALF_MOST) {
        refuse(m, DRIVE_PARAM_f_injection, "must lie between a fortieth and half of f_pwm");
        return;
    }
    c->half = (uint32_t)h;
    c->step = PM_TURN(0.5) / (uint32_t)h;
    for (uint32_t n = 0; n < c->half; n++) {
        c->swing[n] = pm_dir(n * c->step).cos;
    }
    c->v_h =
        fixed(m, pm_num_div(si(m, DRIVE_PARAM_v_injection), m->base.v), UNIT_BITS, DRIVE_PARAM_v_injection);
    c->power_0 = (h == 1 ? PM_Q(1.0 / 64) : PM_Q(1.0 / 128)) * h; /* Q24: s~ has the amplitude 1/2 */
    c->warm = (uint16_t)((2U * c->half + 1U) / m->slow_divider + 2U);
}

void make_zero_sequence(maker_t *m, zero_config_t *c)
{
    const pm_num_t unit = zero_unit(m);
    if (pm_num_cmp(magnitude(unit), pm_num_mul(m->base.v, pm_num_ratio(8, 1000))) < 0) {
        refuse(m, DRIVE_PARAM_dL_0, "leaves no answer at the neutral");
        return;
    }
    make_saliency_sequence(m, &c->saliency, flux_of_period(m));
    make_carrier(m, c);
    make_channel(m, c, unit);
    make_kappa(m, c);
    make_link(m, c);
    c->form = (uint8_t)m->params->zero_form;
    c->told_first = m->params->zero_form != (int32_t)ZERO_MEASURED;
    c->turn6 =
        fixed(m, pm_num_mul(pm_num(6), pm_num_mul(m->base.t_s, m->base.omega)), Q_BITS, DRIVE_PARAM_f_pwm);
}

void make_zero_anti_rotating(maker_t *m, zero_anti_rotating_config_t *c)
{
    make_zero_sequence(m, c);
    c->anti_rotating = 1U;
}

/* sin^2 3 theta in the mean, over 0.2 s. */
void make_zero_pulsating(maker_t *m, zero_pulsating_config_t *c)
{
    make_zero_sequence(m, c);
    const pm_num_t k = pm_num_add(pm_num(1), pm_num_from_fixed(c->kappa_0, Q_BITS));
    c->power_0 = pm_mul(c->power_0 / 2, fixed(m, square(k), Q_BITS, DRIVE_PARAM_L_q));
    c->told_first = c->told_first && c->form != (uint8_t)ZERO_BEGINS_TOLD;
    c->k_power = PM_FRAC(1.0 / 200);
    c->omega_least = fixed(m, pm_num_div(pm_num(8), m->base.omega), Q_BITS, DRIVE_PARAM_speed_trip);
}

void make_zero_rotating(maker_t *m, zero_rotating_config_t *c)
{
    make_zero_sequence(m, c);
    if (c->half < 4U) {
        refuse(m, DRIVE_PARAM_f_injection,
               "a rotating carrier needs at least eight periods: an eighth of f_pwm");
    }
    c->told_first = c->told_first && c->form != (uint8_t)ZERO_BEGINS_TOLD;
}

/* Half a step of the converter and what rounding adds, of an amplitude; A is 1/8. */
polarity_carrier_t zero_rotating_polarity(maker_t *m, const zero_rotating_config_t *c)
{
    if (m->params->polarity == 2 && m->params->zero_falls == 2) {
        refuse(m, DRIVE_PARAM_zero_falls,
               "the pole by the answer at the neutral: which way that goes must be found first, identify "
               "--only neutral");
    }
    const uint32_t n = 2U * c->half;
    const pm_num_t one = pm_num_mul(pm_num_div(si(m, DRIVE_PARAM_neutral_full_scale), m->base.v),
                                    pm_num_from_fixed(c->v_now, V_BITS));
    const pm_num_t share = pm_num_mul(pm_num_sqrt(pm_num_ratio(2, (int32_t)n)), pm_num_ratio(10, 35500));
    return (polarity_carrier_t){.periods = n,
                                .noise =
                                    fixed(m, pm_num_mul(one, share), Q_BITS, DRIVE_PARAM_neutral_full_scale),
                                .h_d = PM_Q(0.125),
                                .reversed = m->params->zero_falls == 1};
}

/* eps is h periods old; 0.3 rad of phase. The current is h / 2 periods old. */
static pm_num_t bandwidth(const maker_t *m, pm_num_t phase, int32_t half_periods)
{
    return pm_num_div(pm_num_mul(pm_num(2), phase), mul3(PM_NUM_TWO_PI, pm_num(half_periods), m->base.t_s));
}

injection_limits_t zero_limits(const maker_t *m)
{
    const int32_t h = half_of(m);
    return (injection_limits_t){.pll_max = bandwidth(m, pm_num_ratio(3, 10), 2 * h),
                                .current_max = bandwidth(m, pm_num_ratio(4, 10), h + 2)};
}

/* Against two steps of a converter of twelve bits, as if that were the noise of the currents. */
pm_num_t zero_answer(const maker_t *m)
{
    const pm_num_t steps = pm_num_div(si(m, DRIVE_PARAM_neutral_full_scale), pm_num(1024));
    return pm_num_div(pm_num_mul(magnitude(amplitude(m)), si(m, DRIVE_PARAM_i_noise)), steps);
}

#endif
