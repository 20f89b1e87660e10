#include "firmware/drive/procedures/torque_polarity.h"
#include "firmware/math/compiler.h"
#include "firmware/params/maker.h"

/* 3/2 p^2 psi_m step / J = 1/16 rad (2 pi injection_bandwidth)^2 */
PM_APART void make_torque_polarity(maker_t *m, torque_polarity_config_t *c)
{
    const pm_num_t follows =
        mul3(pm_num_ratio(1, 16), square(angular(m, DRIVE_PARAM_injection_bandwidth)), si(m, DRIVE_PARAM_J));
    const pm_num_t turns =
        mul3(torque_share(m->params), square(pole_pairs(m)), pm_num_mul(si(m, DRIVE_PARAM_psi_m), m->base.i));
    const pm_q_t i_max = per_unit(m, DRIVE_PARAM_i_max, m->base.i);
    const pm_q_t step =
        fixed(m, least(pm_num_div(follows, turns), pm_num(1)), Q_BITS, DRIVE_PARAM_injection_bandwidth);
    c->step = pm_clamp(step, i_max / 25, i_max / 8);
}
