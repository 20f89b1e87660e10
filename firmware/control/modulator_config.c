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

void make_modulator(maker_t *m, modulator_config_t *c)
{
    const pm_num_t duty = pm_num_mul(si(m, DRIVE_PARAM_dead_time), si(m, DRIVE_PARAM_f_pwm));
    const pm_num_t told = si(m, DRIVE_PARAM_comp_zone);
    const pm_num_t least_zone = pm_num_cmp(m->comp_zone, told) > 0 ? m->comp_zone : told;
    const pm_num_t by_capacitance = zone_of_capacitance(m);
    const bool two_parts = pm_num_cmp(by_capacitance, least_zone) > 0;
    m->comp_zone = two_parts ? by_capacitance : least_zone;
    c->per_zone[0] = per_edge(m, m->comp_zone);
    c->far[0] = two_parts ? PM_FRAC(0.25) : 0;
    c->per_zone[1] = c->per_zone[0];
    c->far[1] = c->far[0];
    if (pm_num_cmp(m->swing, m->comp_zone) > 0) {
        c->per_zone[1] = per_edge(m, m->swing);
        c->far[1] = 0;
        if (c->per_zone[1] < c->per_zone[0] / 4) { /* a quarter of the swing is beyond the zone */
            c->per_zone[1] *= 4;
            c->far[1] = PM_FRAC(0.4999);
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
