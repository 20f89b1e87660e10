#include "firmware/params/maker.h"
#include "injection/stationary.h"

void make_stationary(maker_t *m, stationary_config_t *c, pm_num_t slope)
{
    const pm_num_t i_n = pm_num_div(slope, pm_num_mul(pm_num(2), m->base.i));
    c->i_n = fixed(m, i_n, Q_BITS, DRIVE_PARAM_v_injection);
    c->find = m->params->injection_post_comp != 0;
}
