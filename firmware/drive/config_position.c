/* Configuration of the position sources. */
#include "firmware/drive/config_maker.h"

typedef struct {
    pm_num_t L_d, L_q, L_dq;
} inductances_t;

/* The loop gain follows the saturating saliency, but no further than this: it would only amplify noise. */
#define GAIN_RISE pm_num_ratio(5, 2)

/* d eps-free signal / d angle: V_h T_s [(L_q - L_d) + 2 L_dq^2 / L_q] / D, a current per radian. */
static pm_num_t carrier_slope(const maker_t *m, inductances_t L)
{
    const pm_num_t flux = pm_num_mul(si(m, DRIVE_PARAM_v_injection), m->base.t_s);
    const pm_num_t cross = pm_num_mul(pm_num(2), pm_num_div(square(L.L_dq), L.L_q));
    const pm_num_t D = pm_num_sub(pm_num_mul(L.L_d, L.L_q), square(L.L_dq));
    return pm_num_div(pm_num_mul(flux, pm_num_add(pm_num_sub(L.L_q, L.L_d), cross)), D);
}

static inductances_t at_zero(const maker_t *m)
{
    return (inductances_t){si(m, DRIVE_PARAM_L_d), si(m, DRIVE_PARAM_L_q), pm_num(0)};
}

static inductances_t at_rated(const maker_t *m)
{
    return (inductances_t){si(m, DRIVE_PARAM_L_dh_rated), si(m, DRIVE_PARAM_L_qh_rated),
                           si(m, DRIVE_PARAM_L_dqh_rated)};
}

static bool positive(pm_num_t x)
{
    return pm_num_cmp(x, pm_num(0)) > 0;
}

/* Current per radian at no load, and how it falls with i_q^2. */
static void make_gain(maker_t *m, pulsating_square_config_t *c)
{
    const pm_num_t slope_0 = carrier_slope(m, at_zero(m));
    const pm_num_t slope_r = carrier_slope(m, at_rated(m));
    if (!positive(slope_0) || !positive(slope_r)) {
        refuse(m, DRIVE_PARAM_L_qh_rated, "leaves no saliency for injection at rated current");
        return;
    }
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    const pm_num_t gain_0 = pm_num_div(m->base.i, slope_0);
    const pm_num_t gain_r = least(pm_num_div(m->base.i, slope_r), pm_num_mul(GAIN_RISE, gain_0));
    c->gain_0 = fixed(m, gain_0, SMALL_BITS, DRIVE_PARAM_v_injection);
    c->gain_2 = fixed(m, pm_num_div(pm_num_sub(gain_r, gain_0), square(i_rated)), SMALL_BITS - 4,
                      DRIVE_PARAM_v_injection);
}

/* Parabola through lambda = 0, half, full at i_q = 0, i_rated/2, i_rated. */
static void make_cross(maker_t *m, pulsating_square_config_t *c)
{
    const pm_num_t i_rated = pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i);
    const pm_num_t full = pm_num_div(si(m, DRIVE_PARAM_L_dqh_rated), si(m, DRIVE_PARAM_L_qh_rated));
    const pm_num_t half = si(m, DRIVE_PARAM_cross_half);
    const pm_num_t a = pm_num_sub(pm_num_mul(pm_num(4), half), full);
    const pm_num_t b = pm_num_mul(pm_num(2), pm_num_sub(full, pm_num_mul(pm_num(2), half)));
    c->lambda_1 = fixed(m, pm_num_div(a, i_rated), Q_BITS, DRIVE_PARAM_L_dqh_rated);
    c->lambda_2 = fixed(m, pm_num_div(b, square(i_rated)), Q_BITS, DRIVE_PARAM_L_dqh_rated);
}

static void make_carrier(maker_t *m, pulsating_square_config_t *c)
{
    const pm_num_t flux = pm_num_mul(si(m, DRIVE_PARAM_v_injection), m->base.t_s);
    const pm_num_t h_d = pm_num_div(pm_num_div(flux, si(m, DRIVE_PARAM_L_d)), m->base.i);
    c->v_h = per_unit(m, DRIVE_PARAM_v_injection, m->base.v);
    c->h_d = fixed(m, h_d, Q_BITS, DRIVE_PARAM_v_injection);
    c->h_d_inverse = fixed(m, pm_num_div(pm_num(1), h_d), SMALL_BITS, DRIVE_PARAM_v_injection);
    c->half_step = fixed(m, pm_num_mul(pm_num_mul(m->base.t_s, m->base.omega), pm_num_ratio(1, 2)), FRAC_BITS,
                         DRIVE_PARAM_f_pwm);
}

static void make_square(maker_t *m, pulsating_square_config_t *c)
{
    make_gain(m, c);
    c->lambda_1 = 0;
    c->lambda_2 = 0;
    if (m->params->cross_coupling_comp != 0) {
        make_cross(m, c);
    }
    make_carrier(m, c);
}

/* Carrier and control share the voltage vector: at most 0.6 of v_dc / sqrt(3) may go to the carrier. */
static void check_carrier(maker_t *m)
{
    const pm_num_t linear = pm_num_mul(si(m, DRIVE_PARAM_v_dc_nominal), pm_num_sqrt(pm_num_ratio(1, 3)));
    if (pm_num_cmp(si(m, DRIVE_PARAM_v_injection), pm_num_mul(linear, pm_num_ratio(3, 5))) > 0) {
        refuse(m, DRIVE_PARAM_v_injection, "leaves too little of v_dc_nominal for control");
    }
}

/* The carrier's answer at 45 degrees of error must be four times the noise of a sample, the saliency 5 %, and
 * some of it must be left at rated current. */
bool salient(const maker_t *m)
{
    const pm_num_t L_d = si(m, DRIVE_PARAM_L_d);
    const pm_num_t L_q = si(m, DRIVE_PARAM_L_q);
    const pm_num_t flux = pm_num_mul(si(m, DRIVE_PARAM_v_injection), m->base.t_s);
    const pm_num_t dL = pm_num_sub(L_q, L_d);
    const pm_num_t signal = pm_num_div(pm_num_mul(flux, dL), pm_num_mul(pm_num(2), pm_num_mul(L_d, L_q)));
    const pm_num_t noise = pm_num_mul(pm_num(4), si(m, DRIVE_PARAM_i_noise));
    return pm_num_cmp(signal, noise) > 0 && pm_num_cmp(dL, pm_num_mul(L_q, pm_num_ratio(1, 20))) > 0 &&
           positive(carrier_slope(m, at_rated(m)));
}

static int32_t per_span(maker_t *m)
{
    const pm_num_t span = pm_num_sub(si(m, DRIVE_PARAM_speed_high), si(m, DRIVE_PARAM_speed_low));
    return fixed(m, pm_num_div(m->base.omega, pm_num_mul(span, pole_pairs(m))), SMALL_BITS,
                 DRIVE_PARAM_speed_high);
}

void make_position(maker_t *m, position_config_t *c, bool injection)
{
    make_observer(m, &c->observer);
    c->injection = injection;
    c->omega_low = speed(m, DRIVE_PARAM_speed_low);
    c->omega_high = speed(m, DRIVE_PARAM_speed_high);
    make_loop(m, &c->loop, &c->pll_low, &c->pll_high);
    make_second_harmonic(m, &c->second_harmonic);
    make_mismatch(m, &c->mismatch);
    if (m->params->speed_high <= m->params->speed_low) {
        refuse(m, DRIVE_PARAM_speed_high, "must be above speed_low");
        return;
    }
    c->per_span = per_span(m);
    if (injection) {
        check_carrier(m);
        make_square(m, &c->square);
    }
}

/* Flux that gives i_pulse along the d-axis, by whole periods at a duty <= 1. */
void make_pulses(maker_t *m, initial_pulses_config_t *c)
{
    const pm_num_t L_d = si(m, DRIVE_PARAM_L_d);
    const pm_num_t L_q = si(m, DRIVE_PARAM_L_q);
    const pm_num_t flux = pm_num_mul(si(m, DRIVE_PARAM_i_pulse), L_d);
    const pm_num_t per_period = mul3(pm_num_ratio(2, 3), si(m, DRIVE_PARAM_v_dc_nominal), m->base.t_s);
    const pm_num_t exact = pm_num_div(flux, per_period);
    int32_t whole;
    if (!pm_num_to_fixed(pm_num_add(exact, pm_num_ratio(1, 2)), 0, &whole) || whole > 10000) {
        refuse(m, DRIVE_PARAM_i_pulse, "pulse longer than 10000 periods");
        return;
    }
    whole = whole < 1 ? 1 : whole;
    c->periods = (uint16_t)whole;
    c->timeout = (uint16_t)(8 * whole + 50);
    const pm_num_t duty = pm_num_div(exact, pm_num(whole));
    c->duty = fixed(m, least(duty, pm_num(1)), Q_BITS, DRIVE_PARAM_i_pulse);
    const pm_num_t noise = pm_num_div(si(m, DRIVE_PARAM_i_noise), m->base.i);
    /* five times the noise, and no less than four steps of a 12-bit converter */
    c->i_zero = fixed(m, pm_num_mul(pm_num(5), noise), Q_BITS, DRIVE_PARAM_i_noise);
    c->i_zero = pm_max(c->i_zero, PM_Q(8.0 / 4096.0));
    /* y of the unsaturated machine is 3 i_pulse (L_q - L_d) / L_q */
    const pm_num_t share = pm_num_div(pm_num_sub(L_q, L_d), L_q);
    const pm_num_t i_pulse = pm_num_div(si(m, DRIVE_PARAM_i_pulse), m->base.i);
    c->y_min = fixed(m, mul3(share, i_pulse, pm_num_ratio(3, 4)), Q_BITS, DRIVE_PARAM_i_pulse);
    c->w_min = fixed(m, pm_num_mul(pm_num(10), noise), Q_BITS, DRIVE_PARAM_i_noise);
}
