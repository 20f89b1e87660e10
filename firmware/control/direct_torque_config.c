#include "firmware/control/direct_torque.h"

#include "firmware/control/deadbeat.h"
#include "firmware/params/maker.h"

#define DRIFT_HZ 500 /* faster than a rotor swings in open loop, where the frame is not the rotor's */

void make_direct_torque(maker_t *m, direct_torque_config_t *c)
{
    const pm_num_t two_pi = {PM_NUM_TWO_PI_M, PM_NUM_TWO_PI_E};
    deadbeat_config_t same = {.k_d = 0};
    make_deadbeat(m, &same);
    c->model = same.model;
    c->per_period = gain(m, pm_num_mul(m->base.t_s, m->base.omega), Q_BITS, DRIVE_PARAM_speed_trip);
    const pm_num_t drift = mul3(two_pi, pm_num(DRIFT_HZ), m->base.t_s);
    c->k_drift = gain(m, least(drift, pm_num_ratio(2, 5)), FRAC_BITS, DRIVE_PARAM_f_pwm);
    const pm_num_t rated = pm_num_mul(pm_num_div(si(m, DRIVE_PARAM_psi_m), m->base.psi),
                                      pm_num_div(si(m, DRIVE_PARAM_i_rated), m->base.i));
    c->torque_band =
        gain(m, pm_num_mul(rated, si(m, DRIVE_PARAM_torque_band)), Q_BITS, DRIVE_PARAM_torque_band);
}

pm_num_t direct_torque_bandwidth(const maker_t *m)
{
    return deadbeat_bandwidth(m);
}
