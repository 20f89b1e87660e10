#include "firmware/control/modulator.h"

#include "firmware/params/maker.h"

void make_modulator(maker_t *m, modulator_config_t *c)
{
    const pm_num_t duty = pm_num_mul(si(m, DRIVE_PARAM_dead_time), si(m, DRIVE_PARAM_f_pwm));
    const pm_num_t zone = pm_num_div(si(m, DRIVE_PARAM_comp_zone), m->base.i);
    c->counts = m->params->timer_counts;
    c->dead = fixed(m, duty, PM_SHARE_BITS, DRIVE_PARAM_dead_time);
    c->drop = per_unit(m, DRIVE_PARAM_device_drop, m->base.v);
    const pm_num_t per_zone = pm_num_div(pm_num(1), zone);
    const int bits = PM_ZONE_BITS + 32 - (Q_BITS - 2);
    c->zone_alpha = fixed(m, per_zone, bits, DRIVE_PARAM_comp_zone);
    c->zone_beta =
        fixed(m, pm_num_mul(per_zone, pm_num_sqrt(pm_num_ratio(3, 4))), bits, DRIVE_PARAM_comp_zone);
    c->compensate = m->params->dead_time_comp != 0;
}
