#include "firmware/drive/open_winding.h"

#include "firmware/math/compiler.h"
#include "firmware/params/maker.h"

#if PM_HAS(open_winding)

#define SLOWEST 10 /* of f_pwm, the loop of i_0 */

static void check(maker_t *m)
{
    if (m->params->L_0 == 0) {
        refuse(m, DRIVE_PARAM_L_0, "of an open winding must be known");
    } else {
        check_one_bridge(m);
    }
}

PM_APART void make_open_winding(maker_t *m, open_winding_config_t *c)
{
    *c = (open_winding_config_t){.held = m->params->zero_current == 1};
    require(m, NEEDS_BRIDGES, DRIVE_PARAM_winding);
    m->channels |= NEEDS_NEUTRAL; /* the currents tell what the star point does otherwise */
    check(m);
    if (!m->result.ok) {
        return;
    }
    const pm_num_t f =
        least(si(m, DRIVE_PARAM_current_bandwidth), pm_num_div(si(m, DRIVE_PARAM_f_pwm), pm_num(SLOWEST)));
    const pm_num_t two_pi = {PM_NUM_TWO_PI_M, PM_NUM_TWO_PI_E};
    const pm_num_t bandwidth = pm_num_mul(two_pi, f);
    const pm_num_t k_p = pm_num_div(pm_num_mul(bandwidth, si(m, DRIVE_PARAM_L_0)), m->impedance);
    const pm_num_t three = pm_num_mul(pm_num(3), m->base.omega);
    c->k_p = gain(m, k_p, Q_BITS, DRIVE_PARAM_L_0);
    c->k_r = gain(m, mul3(k_p, pm_num_div(bandwidth, pm_num(8)), m->base.t_s), Q_BITS, DRIVE_PARAM_L_0);
    c->R = fixed(m, pm_num_div(si(m, DRIVE_PARAM_R_s), m->impedance), Q_BITS - 1, DRIVE_PARAM_R_s);
    c->L = fixed(m, pm_num_div(si(m, DRIVE_PARAM_L_0), pm_num_mul(m->impedance, m->base.t_s)), BRIDGES_L_BITS,
                 DRIVE_PARAM_L_0);
    c->carrier = per_unit(m, DRIVE_PARAM_v_injection, m->base.v);
    c->turn = fixed(m, pm_num_mul(three, m->base.t_s), Q_BITS, DRIVE_PARAM_speed_trip);
    c->delay = fixed(m, mul3(three, pm_num_ratio(3, 2), m->base.t_s), Q_BITS, DRIVE_PARAM_speed_trip);
    c->ratio = fixed(m, least(pm_num_div(three, bandwidth), pm_num(7)), Q_BITS, DRIVE_PARAM_speed_trip);
}

#endif
