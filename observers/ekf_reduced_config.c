#include "observers/ekf_reduced.h"

#include "observers/ekf_noise_config.h"
#include "observers/model_config.h"

void make_ekf_reduced(maker_t *m, ekf_reduced_config_t *c)
{
    const ekf_noise_t noise = ekf_noise(m);
    const int32_t lowest = PM_KALMAN_LEAST(EKF_REDUCED_STATES);
    /* a current enters the flux of a period twice */
    const pm_num_t voltage = square(pm_num_mul(noise.voltage, m->base.t_s));
    const pm_num_t current = square(pm_num_mul(si(m, DRIVE_PARAM_L_d), noise.current));
    const pm_num_t rho = pm_num_sqrt(pm_num_add(voltage, pm_num_mul(pm_num(2), current)));
    make_model(m, &c->model);
    c->r = ekf_measurement(rho, noise.u);
    c->q_omega = ekf_process(noise.speed, m->base.omega, lowest);
    c->q_delta = ekf_process(noise.angle, pm_num(1), lowest);
    /* from there on the variance of the angle is below 1 rad^2 */
    const pm_q_t visible = fixed(m, pm_num_div(rho, noise.u), Q_BITS, DRIVE_PARAM_i_noise);
    c->omega_min = pm_max(visible, PM_Q(0.02));
}
