/* Configuration of the extended Kalman filters. */
#include "firmware/drive/config_maker.h"

/* Noise of the Kalman filters, standard deviations. */
typedef struct {
    pm_num_t current; /* of a sample, A */
    pm_num_t voltage; /* of a period's mean, V */
    pm_num_t speed;   /* change of the electrical speed in a period, rad/s */
    pm_num_t angle;   /* rad, likewise */
    pm_num_t u;       /* unit of flux: EMF of base speed in a period, Wb */
} ekf_noise_t;

static ekf_noise_t ekf_noise(const maker_t *m)
{
    const pm_num_t root = pm_num_sqrt(m->base.t_s);
    const pm_num_t acceleration = pm_num_mul(si(m, DRIVE_PARAM_acceleration), pole_pairs(m));
    return (ekf_noise_t){
        .current = si(m, DRIVE_PARAM_i_noise),
        .voltage = pm_num_mul(si(m, DRIVE_PARAM_v_dc_nominal), si(m, DRIVE_PARAM_ekf_voltage_noise)),
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

static int32_t process(pm_num_t sigma, pm_num_t unit, int32_t least)
{
    return variance(sigma, unit, least, PM_KALMAN_MOST_Q);
}

static int32_t measurement(pm_num_t sigma, pm_num_t unit)
{
    return variance(sigma, unit, PM_KALMAN_LEAST_R, PM_KALMAN_MOST_R);
}

void make_ekf_full(maker_t *m, ekf_full_config_t *c)
{
    const ekf_noise_t noise = ekf_noise(m);
    const pm_num_t quarter = pm_num_ratio(1, 4);
    const int32_t lowest = PM_KALMAN_LEAST(EKF_STATES);
    make_model(m, &c->model);
    c->per_unit = fixed(m, pm_num_div(m->base.psi, noise.u), SMALL_BITS, DRIVE_PARAM_psi_m);
    c->q_lambda = process(pm_num_mul(noise.voltage, m->base.t_s), noise.u, lowest);
    c->q_omega = process(noise.speed, pm_num_mul(quarter, m->base.omega), lowest);
    c->q_delta = process(noise.angle, quarter, lowest);
    c->r_d = measurement(pm_num_mul(si(m, DRIVE_PARAM_L_d), noise.current), noise.u);
    c->r_q = measurement(pm_num_mul(si(m, DRIVE_PARAM_L_q), noise.current), noise.u);
}

void make_ekf_reduced(maker_t *m, ekf_reduced_config_t *c)
{
    const ekf_noise_t noise = ekf_noise(m);
    const int32_t lowest = PM_KALMAN_LEAST(EKF_REDUCED_STATES);
    /* a current enters the flux of a period twice */
    const pm_num_t voltage = square(pm_num_mul(noise.voltage, m->base.t_s));
    const pm_num_t current = square(pm_num_mul(si(m, DRIVE_PARAM_L_d), noise.current));
    const pm_num_t rho = pm_num_sqrt(pm_num_add(voltage, pm_num_mul(pm_num(2), current)));
    make_model(m, &c->model);
    c->r = measurement(rho, noise.u);
    c->q_omega = process(noise.speed, m->base.omega, lowest);
    c->q_delta = process(noise.angle, pm_num(1), lowest);
    /* from there on the variance of the angle is below 1 rad^2 */
    const pm_q_t visible = fixed(m, pm_num_div(rho, noise.u), Q_BITS, DRIVE_PARAM_i_noise);
    c->omega_min = pm_max(visible, PM_Q(0.02));
}
