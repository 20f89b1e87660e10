#include "firmware/control/field_weakening.h"

#include "firmware/params/maker.h"

void make_field_weakening(maker_t *m, field_weakening_config_t *c)
{
    /* loop of 20 Hz where the voltage is omega L_d i_d at base speed */
    const pm_num_t L_d = pm_num_div(si(m, DRIVE_PARAM_L_d), m->inductance);
    const pm_num_t k = pm_num_div(mul3(PM_NUM_TWO_PI, pm_num(20), m->t_slow), L_d);
    c->k = fixed(m, least(k, pm_num_ratio(2, 5)), FRAC_BITS, DRIVE_PARAM_L_d);
    c->i_max = per_unit(m, DRIVE_PARAM_i_fw_max, m->base.i);
}
