#include "injection/saliency_config.h"

#include "firmware/math/image.h"
#include "firmware/math/trig.h"

/* The gain follows the saliency as it saturates, but no further than this: it would only amplify noise. */
#define GAIN_RISE pm_num_ratio(5, 2)

inductances_t inductances_at_zero(const maker_t *m)
{
    return (inductances_t){si(m, DRIVE_PARAM_L_d), si(m, DRIVE_PARAM_L_q), pm_num(0)};
}

inductances_t inductances_at_rated(const maker_t *m)
{
    return (inductances_t){si(m, DRIVE_PARAM_L_dh_rated), si(m, DRIVE_PARAM_L_qh_rated),
                           si(m, DRIVE_PARAM_L_dqh_rated)};
}

pm_num_t flux_of_period(const maker_t *m)
{
    return pm_num_mul(si(m, DRIVE_PARAM_v_injection), m->base.t_s);
}

static pm_num_t saliency_d(const inductances_t *L)
{
    return pm_num_sub(pm_num_mul(L->L_d, L->L_q), square(L->L_dq));
}

static pm_num_t saliency_k(const inductances_t *L)
{
    const pm_num_t L_sd = pm_num_div(pm_num_sub(L->L_q, L->L_d), pm_num(2));
    return pm_num_sqrt(pm_num_add(square(L_sd), square(L->L_dq)));
}

/* F [(L_q - L_d) + 2 L_dq^2 / L_q] / D */
pm_num_t slope_across(const inductances_t *L, pm_num_t flux)
{
    const pm_num_t cross = pm_num_mul(pm_num(2), pm_num_div(square(L->L_dq), L->L_q));
    return pm_num_div(pm_num_mul(flux, pm_num_add(pm_num_sub(L->L_q, L->L_d), cross)), saliency_d(L));
}

pm_num_t slope_sequence(const inductances_t *L, pm_num_t flux)
{
    return pm_num_div(mul3(pm_num(2), flux, saliency_k(L)), saliency_d(L));
}

/* Slopes: current per radian without load and at rated current, where nothing may be left of it. */
static void make_gain(maker_t *m, saliency_config_t *c, pm_num_t slope_0, pm_num_t slope_r)
{
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    const pm_num_t gain_0 = pm_num_div(m->base.i, slope_0);
    const pm_num_t most = pm_num_mul(GAIN_RISE, gain_0);
    const pm_num_t gain_r = slope_r.m > 0 ? least(pm_num_div(m->base.i, slope_r), most) : most;
    c->gain_0 = fixed(m, gain_0, SMALL_BITS, DRIVE_PARAM_v_injection);
    c->gain_2 = fixed(m, pm_num_div(pm_num_sub(gain_r, gain_0), square(i_rated)), SMALL_BITS - 4,
                      DRIVE_PARAM_v_injection);
}

/* i_q (a + b |i_q|) through half and full at i_rated / 2 and i_rated. */
static void make_parabola(maker_t *m, pm_num_t half, pm_num_t full, pm_q_t *a, pm_q_t *b)
{
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    const pm_num_t first = pm_num_sub(pm_num_mul(pm_num(4), half), full);
    const pm_num_t second = pm_num_mul(pm_num(2), pm_num_sub(full, pm_num_mul(pm_num(2), half)));
    *a = fixed(m, pm_num_div(first, i_rated), Q_BITS, DRIVE_PARAM_L_dqh_rated);
    *b = fixed(m, pm_num_div(second, square(i_rated)), Q_BITS, DRIVE_PARAM_L_dqh_rated);
}

/* theta_m / 2 = atan2(-L_dq, L_sd) / 2; only the ratio counts. */
static pm_num_t shift_of(maker_t *m, const inductances_t *L)
{
    const pm_num_t L_sd = pm_num_div(pm_num_sub(L->L_q, L->L_d), pm_num(2));
    const int32_t x = fixed(m, pm_num_div(L_sd, L->L_q), Q_BITS, DRIVE_PARAM_L_qh_rated);
    const int32_t y = fixed(m, pm_num_div(pm_num_neg(L->L_dq), L->L_q), Q_BITS, DRIVE_PARAM_L_dqh_rated);
    return pm_num_from_fixed(pm_angle_to_rad((int32_t)pm_atan2(y, x)), Q_BITS + 1);
}

/* Half way L_d and L_q lie on parabolas in i_q; L_dq is known from cross_half = L_dq / L_q. */
static inductances_t at_half(const maker_t *m)
{
    const inductances_t zero = inductances_at_zero(m);
    const inductances_t rated = inductances_at_rated(m);
    const pm_num_t quarter = pm_num_ratio(1, 4);
    const pm_num_t L_q = pm_num_add(zero.L_q, pm_num_mul(quarter, pm_num_sub(rated.L_q, zero.L_q)));
    return (inductances_t){
        .L_d = pm_num_add(zero.L_d, pm_num_mul(quarter, pm_num_sub(rated.L_d, zero.L_d))),
        .L_q = L_q,
        .L_dq = pm_num_mul(si(m, DRIVE_PARAM_cross_half), L_q),
    };
}

/* F L_sa / D */
static pm_num_t i_p_of(const inductances_t *L, pm_num_t flux)
{
    const pm_num_t L_sa = pm_num_div(pm_num_add(L->L_d, L->L_q), pm_num(2));
    return pm_num_div(pm_num_mul(flux, L_sa), saliency_d(L));
}

static pm_num_t i_p_in_base(const maker_t *m, bool rated, pm_num_t flux)
{
    const inductances_t L = rated ? inductances_at_rated(m) : inductances_at_zero(m);
    return pm_num_div(i_p_of(&L, flux), m->base.i);
}

static void make_i_p(maker_t *m, saliency_config_t *c, pm_num_t flux)
{
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    const pm_num_t zero = i_p_in_base(m, false, flux);
    const pm_num_t rise = pm_num_div(pm_num_sub(i_p_in_base(m, true, flux), zero), square(i_rated));
    c->i_p_0 = fixed(m, zero, Q_BITS, DRIVE_PARAM_v_injection);
    c->i_p_2 = fixed(m, rise, Q_BITS, DRIVE_PARAM_v_injection);
}

static void make_lambda(maker_t *m, saliency_config_t *c)
{
    const inductances_t L = inductances_at_rated(m);
    make_parabola(m, si(m, DRIVE_PARAM_cross_half), pm_num_div(L.L_dq, L.L_q), &c->lambda_1, &c->lambda_2);
}

static void make_shift(maker_t *m, saliency_config_t *c)
{
    const inductances_t half = at_half(m);
    const inductances_t rated = inductances_at_rated(m);
    make_parabola(m, shift_of(m, &half), shift_of(m, &rated), &c->shift_1, &c->shift_2);
}

static void make_gain_across(maker_t *m, saliency_config_t *c, pm_num_t flux)
{
    const inductances_t zero = inductances_at_zero(m);
    const inductances_t rated = inductances_at_rated(m);
    make_gain(m, c, slope_across(&zero, flux), slope_across(&rated, flux));
}

static void make_gain_sequence(maker_t *m, saliency_config_t *c, pm_num_t flux)
{
    const inductances_t zero = inductances_at_zero(m);
    const inductances_t rated = inductances_at_rated(m);
    make_gain(m, c, slope_sequence(&zero, flux), slope_sequence(&rated, flux));
}

/* Directly compensated, the source reads across the axis of its own saliency. */
void make_saliency_across(maker_t *m, saliency_config_t *c, pm_num_t flux)
{
    *c = (saliency_config_t){0};
#if PM_HAS(injection_stages)
    if (m->params->cross_coupling_comp == 2) {
        make_gain_sequence(m, c, flux);
        make_shift(m, c);
        return;
    }
#else
    if (m->params->cross_coupling_comp == 2) {
        refuse(m, DRIVE_PARAM_cross_coupling_comp, "2 is not in this image");
    }
#endif
    make_gain_across(m, c, flux);
    if (m->params->cross_coupling_comp != 0) {
        make_lambda(m, c);
    }
}

#if PM_HAS(current_sine)
static pm_num_t slope_held(const maker_t *m, const inductances_t *L)
{
    return pm_num_mul(m->base.i, pm_num_div(pm_num_sub(L->L_q, L->L_d), L->L_d));
}

void make_saliency_held(maker_t *m, saliency_config_t *c)
{
    const inductances_t zero = inductances_at_zero(m);
    const inductances_t rated = inductances_at_rated(m);
    *c = (saliency_config_t){0};
    make_gain(m, c, slope_held(m, &zero), slope_held(m, &rated));
    if (m->params->cross_coupling_comp == 2) {
        refuse(m, DRIVE_PARAM_cross_coupling_comp, "2 turns a carrier of the voltage: 1");
    } else if (m->params->cross_coupling_comp != 0) {
        make_lambda(m, c);
    } else {
        /* not compensated */
    }
}
#endif

void make_saliency_sequence(maker_t *m, saliency_config_t *c, pm_num_t flux)
{
    *c = (saliency_config_t){0};
    make_gain_sequence(m, c, flux);
    make_i_p(m, c, flux);
    if (m->params->cross_coupling_comp != 0) {
        make_shift(m, c);
    }
}
