#include "firmware/control/speed_control.h"

#include "firmware/params/maker.h"

/* kp = w_s J / (1.5 P^2 psi), in base currents per base electrical speed. */
void make_speed_control(maker_t *m, speed_control_config_t *c)
{
    const pm_num_t bandwidth = angular(m, DRIVE_PARAM_speed_bandwidth);
    const pm_num_t k_t = mul3(torque_share(m->params), square(pole_pairs(m)), si(m, DRIVE_PARAM_psi_m));
    const pm_num_t inertia = pm_num_div(si(m, DRIVE_PARAM_J), k_t); /* A per rad/s2 electrical */
    const pm_num_t unit = pm_num_div(m->base.omega, m->base.i);
    const pm_num_t kp = mul3(bandwidth, inertia, unit);
    const pm_num_t ki = pm_num_mul(mul3(kp, bandwidth, m->t_slow), pm_num_ratio(1, 4));
    const pm_num_t slope = pm_num_mul(si(m, DRIVE_PARAM_acceleration), pole_pairs(m)); /* rad/s2 electrical */
    c->pi.kp = gain(m, kp, GAIN_BITS, DRIVE_PARAM_speed_bandwidth);
    c->pi.ki = gain(m, ki, GAIN_BITS, DRIVE_PARAM_speed_bandwidth);
    c->pi.kb = fixed(m, pm_num_div(ki, kp), UNIT_BITS, DRIVE_PARAM_speed_bandwidth);
    c->slope =
        fixed(m, pm_num_div(pm_num_mul(slope, m->t_slow), m->base.omega), Q_BITS, DRIVE_PARAM_acceleration);
    c->i_per_slope =
        fixed(m, pm_num_div(pm_num_mul(slope, inertia), m->base.i), Q_BITS, DRIVE_PARAM_acceleration);
}
