#include "firmware/control/modulator.h"

#include "firmware/params/maker.h"

/* 1.7 C v_dc / T_dt, A. */
static pm_num_t zone_of_capacitance(const maker_t *m)
{
    const pm_num_t charge = pm_num_mul(si(m, DRIVE_PARAM_leg_capacitance), si(m, DRIVE_PARAM_v_dc_nominal));
    if (m->params->dead_time == 0) {
        return pm_num(0);
    }
    return pm_num_mul(pm_num_div(charge, si(m, DRIVE_PARAM_dead_time)), pm_num_ratio(17, 10));
}

static int32_t per_edge(maker_t *m, pm_num_t edge)
{
    const int bits = PM_ZONE_BITS + 32 - (Q_BITS - 2);
    return fixed(m, pm_num_div(m->base.i, edge), bits, DRIVE_PARAM_comp_zone);
}

/* T_s / (4 L edge), as |v| is m 2/3 v_dc; with the mean of L_d and L_q. 0 where r stays within the edge: at its most, half of the
 * link's voltage, |v| (1 - m) is a sixth of that. */
static int32_t make_ripple(maker_t *m, pm_num_t edge)
{
    const pm_num_t whole = pm_num_mul(pm_num_add(si(m, DRIVE_PARAM_L_d), si(m, DRIVE_PARAM_L_q)), edge);
    const pm_num_t edges = pm_num_div(mul3(m->base.t_s, m->base.v, pm_num_ratio(1, 2)), whole);
    const int32_t ripple = fixed(m, least(edges, pm_num(8000)), PM_ZONE_BITS + 32 - Q_BITS, DRIVE_PARAM_L_d);
    const pm_q_t most = per_unit(m, DRIVE_PARAM_v_dc_max, m->base.v);
    return pm_mulh(most, ripple) > 6 * PM_ZONE_EDGE ? ripple : 0;
}

void make_modulator(maker_t *m, modulator_config_t *c)
{
    const pm_num_t duty = pm_num_mul(si(m, DRIVE_PARAM_dead_time), si(m, DRIVE_PARAM_f_pwm));
    const pm_num_t told = si(m, DRIVE_PARAM_comp_zone);
    const pm_num_t least_zone = pm_num_cmp(m->comp_zone, told) > 0 ? m->comp_zone : told;
    const pm_num_t by_capacitance = zone_of_capacitance(m);
    const bool two_parts = pm_num_cmp(by_capacitance, least_zone) > 0;
    m->comp_zone = two_parts ? by_capacitance : least_zone;
    c->ripple = make_ripple(m, m->comp_zone);
    c->per_zone[0] = per_edge(m, m->comp_zone);
    c->far[0] = two_parts ? 1U : 0U;
    c->per_zone[1] = c->per_zone[0];
    c->far[1] = c->far[0];
    if (pm_num_cmp(m->swing, m->comp_zone) > 0) {
        c->per_zone[1] = per_edge(m, m->swing);
        c->far[1] = 0U;
        if (c->per_zone[1] < c->per_zone[0] / 4) { /* a quarter of the swing is beyond the zone */
            c->per_zone[1] *= 4;
            c->far[1] = 2U;
        }
    }
    c->counts = m->params->timer_counts;
    c->whole = pm_share_whole(c->counts);
    c->top = seen_on_time(m);
    if (c->top < PM_SHARE_HALF) { /* more would be no use */
        refuse(m, DRIVE_PARAM_t_settle, "leaves less than half of a period at f_pwm");
    }
    c->dead = fixed(m, duty, PM_SHARE_BITS, DRIVE_PARAM_dead_time);
    c->drop = per_unit(m, DRIVE_PARAM_device_drop, m->base.v);
    if (m->params->dead_time_comp == 0) {
        c->per_zone[0] = 0;
        c->per_zone[1] = 0;
        c->ripple = 0;
    }
}

pm_unit_t modulator_reach(maker_t *m, const modulator_config_t *c)
{
    if (c->top == PM_SHARE_ONE) {
        return PM_UNIT_MAX;
    }
    const pm_q_t v_dc = per_unit(m, DRIVE_PARAM_v_dc_min, m->base.v);
    const int32_t lost = c->dead + pm_mulh(c->drop, pm_per_volt(pm_max(v_dc, PM_Q(0.0625))));
    const int32_t top = c->top - c->dead - 2 * lost - MODULATOR_ROUNDING;
    return pm_unit(pm_share_to_unit(top), PM_UNIT(2.0 / 3.0));
}
