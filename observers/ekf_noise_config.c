#include "observers/ekf_noise_config.h"

#include "firmware/math/kalman.h"

/* Most of a period's error is what the compensation of dead time leaves, of which more periods have more. */
#define TOLD_FOR_HZ 10000

ekf_noise_t ekf_noise(const maker_t *m)
{
    const pm_num_t root = pm_num_sqrt(m->base.t_s);
    const pm_num_t voltage =
        pm_num_mul(si(m, DRIVE_PARAM_v_dc_nominal), si(m, DRIVE_PARAM_ekf_voltage_noise));
    const pm_num_t acceleration = pm_num_mul(si(m, DRIVE_PARAM_acceleration), pole_pairs(m));
    return (ekf_noise_t){
        .current = si(m, DRIVE_PARAM_i_noise),
        .voltage = pm_num_mul(voltage, pm_num_mul(si(m, DRIVE_PARAM_f_pwm), pm_num_ratio(1, TOLD_FOR_HZ))),
        .speed = mul3(acceleration, si(m, DRIVE_PARAM_ekf_speed_noise), root),
        .angle = pm_num_mul(si(m, DRIVE_PARAM_ekf_angle_noise), root),
        .u = mul3(si(m, DRIVE_PARAM_psi_m), m->base.omega, m->base.t_s),
    };
}

/* (sigma / unit)^2, clamped to what keeps the covariance in range. */
static int32_t variance(pm_num_t sigma, pm_num_t unit, int32_t least, int32_t most)
{
    int32_t x;
    (void)pm_num_to_fixed(square(pm_num_div(sigma, unit)), PM_KALMAN_BITS, &x);
    return pm_clamp(x, least, most);
}

int32_t ekf_process(pm_num_t sigma, pm_num_t unit, int32_t least)
{
    return variance(sigma, unit, least, PM_KALMAN_MOST_Q);
}

int32_t ekf_measurement(pm_num_t sigma, pm_num_t unit)
{
    return variance(sigma, unit, PM_KALMAN_LEAST_R, PM_KALMAN_MOST_R);
}
