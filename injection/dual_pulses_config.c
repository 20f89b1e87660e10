#include "firmware/math/root.h"
#include "firmware/params/maker.h"
#include "injection/dual_pulses.h"

/* Share of a period in which a leg may be on: the rest is for its dead time. */
static pm_num_t on_most(const maker_t *m)
{
    return least(pm_num_ratio(seen_on_time(m), PM_SHARE_ONE), pm_num_ratio(95, 100));
}

/* e^-x by its inverse's series within 2 %, 0 <= x <= 1 */
static pm_q_t falls_to(pm_q_t x)
{
    const pm_q_t half_square = pm_mul(x, x) / 2;
    return pm_div(PM_ONE / 4, (PM_ONE + x + half_square + pm_mul(half_square, x / 3)) / 4);
}

/* Beyond a time constant nothing is left after the pause, whatever this says. */
PM_APART static void make_decay(maker_t *m, dual_pulses_config_t *c)
{
    const pm_num_t L_per_R = pm_num_div(si(m, DRIVE_PARAM_L_d), si(m, DRIVE_PARAM_R_s));
    const pm_num_t exact = pm_num_div(pm_num_mul(pm_num(c->periods), m->base.t_s), L_per_R);
    const pm_q_t once = falls_to(fixed(m, least(exact, pm_num(1)), Q_BITS, DRIVE_PARAM_R_s));
    const pm_q_t thrice = pm_mul(once, pm_mul(once, once));
    c->decay = pm_shl((once + thrice) / 2 - 1, UNIT_BITS - Q_BITS);
}

PM_APART static void make_limits(maker_t *m, dual_pulses_config_t *c)
{
    const pm_num_t noise = pm_num_div(si(m, DRIVE_PARAM_i_noise), m->base.i);
    /* root(2/3) of a current's noise along an axis: of four, and of two that count twice, each the mean of four */
    c->noise = pm_max(fixed(m, pm_num_mul(noise, pm_num(2)), Q_BITS, DRIVE_PARAM_i_noise), 1);
    c->i_zero = fixed(m, pm_num_mul(pm_num(5), noise), Q_BITS, DRIVE_PARAM_i_noise);
    c->i_zero = pm_max(c->i_zero, PM_Q(8.0 / 4096.0));
    c->i_least = per_unit(m, DRIVE_PARAM_i_pulse, m->base.i) / 4;
}

PM_APART static void make_ringing(maker_t *m, dual_pulses_config_t *c)
{
    const pm_num_t per = pm_num_div(si(m, DRIVE_PARAM_leg_capacitance), si(m, DRIVE_PARAM_L_d));
    const pm_num_t i = mul3(pm_num(2), si(m, DRIVE_PARAM_v_dc_nominal), pm_num_sqrt(per));
    c->ringing = fixed(m, pm_num_div(i, m->base.i), Q_BITS, DRIVE_PARAM_leg_capacitance);
    c->i_zero = pm_max(c->i_zero, c->ringing); /* a current that rings has ended */
}

/* False: there is no such pulse. */
PM_APART static bool make_length(maker_t *m, dual_pulses_config_t *c)
{
    const pm_num_t flux = pm_num_mul(si(m, DRIVE_PARAM_i_pulse), si(m, DRIVE_PARAM_L_d));
    const pm_num_t per_period = pm_num_div(flux, pm_num_mul(si(m, DRIVE_PARAM_v_dc_nominal), m->base.t_s));
    const pm_num_t most = pm_num_sub(on_most(m), pm_num_ratio(1, 2)); /* of v_dc */
    int32_t n;
    if (pm_num_cmp(most, pm_num_ratio(1, 10)) < 0) {
        refuse(m, DRIVE_PARAM_polarity, "shunts leave no voltage about half duty");
        return false;
    }
    if (!pm_num_to_fixed(pm_num_add(pm_num_div(per_period, most), pm_num(1)), 0, &n) || n > 1000) {
        refuse(m, DRIVE_PARAM_i_pulse, "pulse longer than 1000 periods");
        return false;
    }
    c->periods = (uint16_t)n;
    c->timeout = (uint16_t)(8 * n + 500);
    c->amplitude = fixed(m, pm_num_div(per_period, pm_num(n)), Q_BITS, DRIVE_PARAM_i_pulse);
    return true;
}

void make_dual_pulses(maker_t *m, dual_pulses_config_t *c)
{
    if (make_length(m, c)) {
        make_decay(m, c);
        make_limits(m, c);
        make_ringing(m, c);
        c->reversed = m->params->L_d_falls != 0;
    }
}
