#include "firmware/params/maker.h"
#include "injection/basic_pulses.h"
#include "injection/dc_link_pulses.h"

/* 1 - (1 - e^-u) / u within 5 % for u up to 3. */
static pm_num_t settled(pm_num_t u)
{
    const pm_num_t half = pm_num_div(u, pm_num(2));
    return pm_num_div(half, pm_num_add(pm_num(1), pm_num_div(u, pm_num(3))));
}

static pm_num_t real(pm_q_t x)
{
    return pm_num_from_fixed(x, Q_BITS);
}

void make_dc_link_pulses(maker_t *m, const pulses_config_t *pulses, dc_link_pulses_config_t *c)
{
    const pm_num_t R = si(m, DRIVE_PARAM_dc_resistance);
    const pm_num_t time = pm_num_mul(R, si(m, DRIVE_PARAM_dc_capacitance));
    const pm_num_t length = pm_num_mul(pm_num(pulses->periods), m->base.t_s);
    if (pm_num_cmp(pm_num_mul(pm_num(3), time), length) < 0) {
        refuse(m, DRIVE_PARAM_dc_resistance,
               "with dc_capacitance below a third of the pulse: the link's voltage shows too little");
        return;
    }
    const int32_t repeats = m->params->dc_link_repeats;
    int32_t recharge = 0;
    if (!pm_num_to_fixed(pm_num_div(pm_num_mul(pm_num(5), time), m->base.t_s), 0, &recharge) ||
        recharge > 20000) {
        refuse(m, DRIVE_PARAM_dc_capacitance, "recharges in more than 20000 periods");
        return;
    }
    c->periods = pulses->periods;
    c->duty = pulses->duty;
    c->wait = (uint16_t)(recharge + 3 * (int32_t)pulses->periods / 2 + 5);
    c->pulses = (uint16_t)(6 * repeats);
    /* volts per ampere, per unit */
    const pm_num_t k =
        mul3(pm_num_div(mul3(real(pulses->duty), R, settled(pm_num_div(length, time))), m->impedance),
             pm_num(repeats), pm_num(1));
    const primary_config_t currents = basic_pulses_limits(pulses);
    c->limits.s_min = currents.s_min;
    c->limits.pole.bridge =
        fixed(m, pm_num_mul(k, real(currents.pole.bridge)), Q_BITS, DRIVE_PARAM_dc_link_repeats);
    /* 0.6 of a step of a 12-bit converter; sqrt(1 + 1/4) of it in a drop, 1.155 of that in y */
    const pm_num_t step = pm_num_div(pm_num_div(si(m, DRIVE_PARAM_v_full_scale), m->base.v), pm_num(4096));
    const pm_num_t noise = mul3(pm_num_ratio(775, 1000), step, pm_num_sqrt(pm_num(repeats)));
    c->limits.pole.reversed = currents.pole.reversed;
    c->limits.pole.noise = pm_max(fixed(m, noise, Q_BITS, DRIVE_PARAM_dc_link_repeats), 1);
}
