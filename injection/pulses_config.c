#include "injection/pulse_choice.h"
#include "injection/pulses.h"

/* Flux that gives the pulse current along the d-axis, by whole periods at a duty at which the currents are seen.
 * Each part is apart: their numbers would be on the stack at once. */
PM_APART static bool make_duration(maker_t *m, pm_num_t i_peak, pulses_config_t *c)
{
    const pm_num_t flux = pm_num_mul(i_peak, si(m, DRIVE_PARAM_L_d));
    const pm_num_t per_period = mul3(pm_num_ratio(2, 3), si(m, DRIVE_PARAM_v_dc_nominal), m->base.t_s);
    const pm_num_t exact = pm_num_div(flux, per_period);
    const pm_num_t most = pm_num_ratio(seen_on_time(m), PM_SHARE_ONE);
    int32_t whole;
    if (!pm_num_to_fixed(pm_num_add(pm_num_div(exact, most), pm_num_ratio(1, 2)), 0, &whole) ||
        whole > 10000) {
        refuse(m, DRIVE_PARAM_i_pulse, "pulse longer than 10000 periods");
        return false;
    }
    whole = whole < 1 ? 1 : whole;
    c->periods = (uint16_t)whole;
    c->timeout = (uint16_t)(8 * whole + 50);
    c->duty = fixed(m, least(pm_num_div(exact, pm_num(whole)), most), Q_BITS, DRIVE_PARAM_i_pulse);
    return true;
}

/* Half of what L_d and L_q make of it: the data may be off by 15 % each. */
PM_APART static void make_s_min(maker_t *m, pulses_config_t *c)
{
    const pm_num_t L_d = si(m, DRIVE_PARAM_L_d);
    const pm_num_t L_q = si(m, DRIVE_PARAM_L_q);
    const pm_num_t s = pm_num_div(pm_num_sub(L_q, L_d), pm_num_add(L_q, L_d));
    c->s_min = fixed(m, pm_num_div(s, pm_num(2)), Q_BITS, DRIVE_PARAM_L_q);
}

/* Currents that noise and bridge make by themselves. What rings with the legs' capacitance between two pulses is no current
 * that has not ended. */
PM_APART static void make_errors(maker_t *m, pulses_config_t *c)
{
    const pm_num_t noise = pm_num_div(si(m, DRIVE_PARAM_i_noise), m->base.i);
    const pm_num_t L_d = si(m, DRIVE_PARAM_L_d);
    const pm_num_t edges =
        pm_num_mul(pm_num_ratio(4 * c->periods, 3), pm_num_div(si(m, DRIVE_PARAM_dead_time), L_d));
    const pm_num_t ringing =
        pm_num_sqrt(pm_num_div(pm_num_mul(pm_num(4), si(m, DRIVE_PARAM_leg_capacitance)), L_d));
    const pm_num_t v_dc = pm_num_div(si(m, DRIVE_PARAM_v_dc_nominal), m->base.i);
    c->i_bridge = fixed(m, pm_num_mul(v_dc, pm_num_add(edges, ringing)), Q_BITS, DRIVE_PARAM_i_pulse);
    c->i_zero = fixed(m, pm_num_mul(pm_num(5), noise), Q_BITS, DRIVE_PARAM_i_noise);
    c->i_zero = pm_max(c->i_zero, PULSES_STEPS);
    c->i_zero = pm_max(c->i_zero, fixed(m, pm_num_mul(v_dc, ringing), Q_BITS, DRIVE_PARAM_leg_capacitance));
    c->i_noise = pm_max(fixed(m, noise, Q_BITS, DRIVE_PARAM_i_noise), 1);
}

void make_pulses(maker_t *m, pulses_config_t *c)
{
    const pm_num_t i_peak = pulse_choice_current(m);
    if (make_duration(m, i_peak, c)) {
        make_s_min(m, c);
        make_errors(m, c);
        c->reversed = m->params->L_d_falls != 0;
    }
}
