#include "firmware/params/maker.h"
#include "injection/stationary.h"

void make_stationary(maker_t *m, stationary_config_t *c, pm_num_t slope, uint16_t settling)
{
    const pm_num_t i_n = pm_num_div(slope, pm_num_mul(pm_num(2), m->base.i));
    c->i_n = fixed(m, i_n, Q_BITS, DRIVE_PARAM_v_injection);
    const pm_num_t between = pm_num_add(pm_num_mul(pm_num(STATIONARY_ON_ONE), m->t_slow),
                                        pm_num_mul(pm_num(settling), m->base.t_s));
    c->between = fixed(m, pm_num_mul(between, m->base.omega), SMALL_BITS, DRIVE_PARAM_f_pwm);
    c->find = m->params->injection_post_comp != 0;
}
