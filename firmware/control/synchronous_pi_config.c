#include "firmware/control/synchronous_pi.h"

#include "firmware/params/maker.h"

static pm_pi_config_t make_current_pi(maker_t *m, drive_param_id_t L)
{
    const pm_num_t bandwidth = angular(m, DRIVE_PARAM_current_bandwidth);
    const pm_num_t kp = pm_num_div(pm_num_mul(bandwidth, si(m, L)), m->impedance);
    const pm_num_t ki = pm_num_div(mul3(bandwidth, si(m, DRIVE_PARAM_R_s), m->base.t_s), m->impedance);
    return (pm_pi_config_t){
        .kp = gain(m, kp, GAIN_BITS, DRIVE_PARAM_current_bandwidth),
        .ki = gain(m, ki, GAIN_BITS, DRIVE_PARAM_current_bandwidth),
        .kb = fixed(m, least(pm_num_div(ki, kp), pm_num_ratio(15, 16)), UNIT_BITS, DRIVE_PARAM_R_s),
    };
}

void make_synchronous_pi(maker_t *m, synchronous_pi_config_t *c)
{
    c->d = make_current_pi(m, DRIVE_PARAM_L_d);
    c->q = make_current_pi(m, DRIVE_PARAM_L_q);
    c->L_d = per_unit(m, DRIVE_PARAM_L_d, m->inductance);
    c->L_q = per_unit(m, DRIVE_PARAM_L_q, m->inductance);
    c->psi_m = per_unit(m, DRIVE_PARAM_psi_m, m->base.psi);
}

pm_num_t synchronous_pi_bandwidth(const maker_t *m)
{
    return si(m, DRIVE_PARAM_current_bandwidth);
}
