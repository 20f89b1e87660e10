#include "firmware/drive/procedures/flying_start.h"
#include "firmware/params/maker.h"

#define LONGEST_US 3200U  /* a pulse */
#define SPAN_US    15000U /* all of them */

static pm_q_t per_part(maker_t *m, pm_num_t v, drive_param_id_t blame)
{
    const pm_num_t per =
        pm_num_div(m->base.t_s, pm_num_mul(pm_num(2 * FLYING_START_PARTS), si(m, DRIVE_PARAM_L_q)));
    return fixed(m, least(pm_num_mul(v, per), pm_num(4)), Q_BITS, blame);
}

/* Of the open legs with the winding: v_dc root(C / L_d) at its most, and no more than an eighth of rated current. */
static pm_q_t make_ringing(maker_t *m)
{
    const pm_num_t per = pm_num_div(si(m, DRIVE_PARAM_leg_capacitance), si(m, DRIVE_PARAM_L_d));
    const pm_num_t i = pm_num_mul(si(m, DRIVE_PARAM_v_dc_nominal), pm_num_sqrt(per));
    const pm_num_t most = pm_num_div(si(m, DRIVE_PARAM_i_rated), pm_num(8));
    return fixed(m, pm_num_div(least(i, most), m->base.i), Q_BITS, DRIVE_PARAM_leg_capacitance);
}

/* (pi / 3) root(3) psi_m / v, with v = 2/3 v_dc_nominal. */
static uint16_t make_pause(maker_t *m)
{
    const pm_num_t turn = mul3(pm_num_ratio(2721, 1000), si(m, DRIVE_PARAM_psi_m),
                               pm_num_div(pm_num(1), si(m, DRIVE_PARAM_v_dc_nominal)));
    const pm_num_t most = pm_num(UINT16_MAX / 2);
    return (uint16_t)(2 + fixed(m, least(pm_num_div(turn, m->base.t_s), most), 0, DRIVE_PARAM_psi_m));
}

void make_flying_start(maker_t *m, flying_start_config_t *c)
{
    const uint32_t f = (uint32_t)m->params->f_pwm;
    c->on = m->params->flying_start != 0;
    const uint32_t fine = NEEDS_ONE_SWITCH | NEEDS_HALVES;
    c->shortest = (m->channels & fine) == fine ? 1U : (uint8_t)FLYING_START_PARTS;
    c->span = (uint16_t)(f / 1000U * SPAN_US / 1000U);
    c->pause = make_pause(m);
    c->longest = FLYING_START_PARTS;
    while (2UL * c->longest / FLYING_START_PARTS <= f / 1000U * LONGEST_US / 1000U) {
        c->longest = (uint16_t)(2U * c->longest);
    }
    /* 0.2 rad, since a pulse twice as long may follow */
    const pm_num_t turns =
        mul3(pm_num_ratio(1, 2), si(m, DRIVE_PARAM_psi_m), pm_num_div(pm_num(1), si(m, DRIVE_PARAM_L_q)));
    const pm_num_t i = pm_num_mul(least(si(m, DRIVE_PARAM_i_rated), turns), pm_num_ratio(1, 5));
    c->noise = pm_clamp(per_unit(m, DRIVE_PARAM_i_noise, m->base.i), PM_Q(0.5 / 4096.0),
                        PM_Q_MAX / FLYING_START_LEAST);
    c->i_enough = pm_max(fixed(m, pm_num_div(i, m->base.i), Q_BITS, DRIVE_PARAM_i_rated),
                         FLYING_START_LEAST * c->noise);
    c->i_zero = pm_max(5 * c->noise, PM_Q(8.0 / 4096.0));
    c->i_rings = pm_max(make_ringing(m), c->i_zero);
    c->decay = per_part(m, si(m, DRIVE_PARAM_R_s), DRIVE_PARAM_R_s);
    c->drop = per_part(m, pm_num_div(si(m, DRIVE_PARAM_device_drop), m->base.i), DRIVE_PARAM_device_drop);
}
