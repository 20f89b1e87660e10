#include "observers/ekf_full.h"

#include "observers/ekf_noise_config.h"
#include "observers/model_config.h"

void make_ekf_full(maker_t *m, ekf_full_config_t *c)
{
    const ekf_noise_t noise = ekf_noise(m);
    const pm_num_t quarter = pm_num_ratio(1, 4);
    const int32_t lowest = PM_KALMAN_LEAST(EKF_STATES);
    make_model(m, &c->model);
    c->per_unit = fixed(m, pm_num_div(m->base.psi, noise.u), SMALL_BITS, DRIVE_PARAM_psi_m);
    c->q_lambda = ekf_process(pm_num_mul(noise.voltage, m->base.t_s), noise.u, lowest);
    c->q_omega = ekf_process(noise.speed, pm_num_mul(quarter, m->base.omega), lowest);
    c->q_delta = ekf_process(noise.angle, quarter, lowest);
    c->r_d = ekf_measurement(pm_num_mul(si(m, DRIVE_PARAM_L_d), noise.current), noise.u);
    c->r_q = ekf_measurement(pm_num_mul(si(m, DRIVE_PARAM_L_q), noise.current), noise.u);
}
