/* Configuration of the position sources. */
#include "firmware/drive/config_maker.h"

/* Current control is slowed while a low-speed source asks for it; a position loop that is too fast for the
 * source is refused. */
static void make_low_speed(maker_t *m, position_config_t *c)
{
    injection_limits_t limits = {{0, 0}, {0, 0}};
    make_injection(m, &c->injection, &limits);
    const pm_num_t pll = si(m, DRIVE_PARAM_injection_bandwidth);
    const pm_num_t current = si(m, DRIVE_PARAM_current_bandwidth);
    if (limits.pll_max.m != 0 && pm_num_cmp(pll, limits.pll_max) > 0) {
        refuse(m, DRIVE_PARAM_injection_bandwidth,
               "too fast for the window of the carrier: raise f_injection");
    }
    if (limits.current_max.m != 0 && pm_num_cmp(current, limits.current_max) > 0) {
        c->current_low =
            fixed(m, pm_num_div(limits.current_max, current), UNIT_BITS, DRIVE_PARAM_f_injection);
    }
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
    c->injects = injection;
    c->current_low = PM_UNIT_MAX;
    c->omega_low = speed(m, DRIVE_PARAM_speed_low);
    c->omega_high = speed(m, DRIVE_PARAM_speed_high);
    make_loop(m, &c->loop, &c->pll_low, &c->pll_high);
    make_second_harmonic(m, &c->second_harmonic);
    make_mismatch(m, &c->mismatch);
    make_speed(m, &c->speed);
    c->speed.k_theta = c->pll_low.k_theta;
    c->corrects = c->second_harmonic.id != SECOND_HARMONIC_STAYS || c->mismatch.id != MISMATCH_OFF ||
                  c->loop.id != LOOP_PLL || c->speed.id != SPEED_LOOP;
    if (m->params->speed_high <= m->params->speed_low) {
        refuse(m, DRIVE_PARAM_speed_high, "must be above speed_low");
        return;
    }
    c->per_span = per_span(m);
    if (injection) {
        make_low_speed(m, c);
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
