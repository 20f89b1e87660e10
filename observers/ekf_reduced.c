#include "observers/ekf_reduced.h"

#include "firmware/math/pair.h"
#include "firmware/math/root.h"

#define SEED_DELTA PM_SCALED(0.01, 1073741824.0)   /* 0.1 rad */
#define SEED_OMEGA PM_SCALED(0.0004, 1073741824.0) /* 0.02 of the base speed */
#define MOST_R     PM_SCALED(1.25, 1073741824.0)

static void set_operating_point(ekf_reduced_t *self, const ekf_reduced_config_t *config, pm_q_t omega,
                                pm_dq_t i)
{
    dq_flux_set(&self->flux, &config->model, i);
    const pm_q_t speed = pm_min(pm_abs(omega), PM_Q(2.0));
    const pm_q_t reach = pm_max(speed, config->omega_min);
    const pm_q_t share = pm_div(speed, reach);
    const pm_q_t square = pm_mul(self->flux.psi_a, self->flux.psi_a) + pm_mul(self->flux.eta, self->flux.eta);
    const pm_q_t size = pm_max(square, PM_Q(0.0001));
    const pm_q_t u = pm_max(pm_frac(pm_mul_sat(size, reach), config->model.t_s), 1);
    const pm_q_t fading = omega < 0 ? -share : share;
    self->per_d = pm_mul_sat(pm_div(self->flux.psi_a / 1024, u), -fading); /* Q28 / 1024 = Q18 */
    self->per_q = pm_mul_sat(pm_div(self->flux.eta / 1024, u), fading);
    const pm_q_t ratio = pm_div(pm_mul(config->model.psi_m, config->model.psi_m), size);
    self->r_delta = pm_min(pm_mul_sat(pm_div(pm_div(config->r, reach), reach), ratio), MOST_R);
}

static void set_covariance(ekf_reduced_t *self)
{
    self->P[PM_KALMAN_AT(EKF_REDUCED_OMEGA, EKF_REDUCED_OMEGA)] = SEED_OMEGA;
    self->P[PM_KALMAN_AT(EKF_REDUCED_DELTA, EKF_REDUCED_OMEGA)] = 0;
    self->P[PM_KALMAN_AT(EKF_REDUCED_DELTA, EKF_REDUCED_DELTA)] = SEED_DELTA;
}

void ekf_reduced_reset(ekf_reduced_t *self, const ekf_reduced_config_t *config, const obs_in_t *in)
{
    *self = (ekf_reduced_t){.omega = in->omega};
    set_covariance(self);
    set_operating_point(self, config, in->omega, in->i_dq);
    const pm_dq_t magnet = {.d = config->model.psi_m, .q = 0};
    dq_flux_keep(&self->flux, dq_flux_lambda(&self->flux, in->i, in->dir), magnet, in->dir);
}

static inline void predict(int32_t *P, const ekf_reduced_config_t *config)
{
    const int32_t t = config->model.t_s;
    const int32_t cross = pm_mulh_add(P[1], P[0], t);
    P[2] = pm_mulh_add(pm_mulh_add(P[2], P[1], t), cross, t) + config->q_delta;
    P[1] = cross;
    P[0] += config->q_omega;
}

static inline void describe(const ekf_reduced_t *self, pm_q_t delta, obs_out_t *out)
{
    out->eps = delta;
    out->misfit = self->misfit;
    out->vector = (pm_dq_t){.d = self->flux.psi_a, .q = pm_mul(self->flux.psi_a, delta)};
}

/* The flux of a period, Q34: +-1/8. */
static inline int32_t small_flux(pm_q_t rho)
{
    return pm_shl(pm_sat(rho, 25), 6);
}

/* z, clamped to +-4, which leaves room for its noise at low speed. */
static inline pm_q_t angle_of(const ekf_reduced_t *self, pm_dq_t rho)
{
    const int32_t along_d = pm_mulh(small_flux(rho.d), self->per_d);
    return pm_shl(pm_sat(pm_mulh_add(along_d, small_flux(rho.q), self->per_q), 22), 8);
}

void ekf_reduced_step(ekf_reduced_t *self, const ekf_reduced_config_t *config, const obs_in_t *in,
                      obs_out_t *out)
{
    const pm_dir_t dir = in->dir;
    const pm_frac_t t_s = config->model.t_s;
    const pm_q_t psi_m = config->model.psi_m;
    const pm_dq_t psi = dq_flux_advance(&self->flux, t_s, in->v, dir);
    const pm_dq_t lambda = dq_flux_lambda(&self->flux, in->i, dir);
    const pm_dq_t rho = {.d = pm_sub_sat(psi.d - psi_m, lambda.d), .q = pm_sub_sat(psi.q, lambda.q)};
    pm_q_t omega = self->omega;
    pm_q_t delta = pm_frac_add(self->delta, omega, t_s) - pm_dir_turn(self->flux.dir, dir);
    dq_flux_keep(&self->flux, lambda, (pm_dq_t){.d = psi_m, .q = 0}, dir);

    predict(self->P, config);
    const pm_q_t y = angle_of(self, rho) - delta;
    const pm_kalman_gain_t g =
        pm_kalman_measure(self->P, EKF_REDUCED_STATES, EKF_REDUCED_DELTA, self->r_delta);
    pm_kalman_hold(self->P, EKF_REDUCED_STATES, EKF_REDUCED_OMEGA);
    pm_kalman_hold(self->P, EKF_REDUCED_STATES, EKF_REDUCED_DELTA);
    omega = pm_mulh_add(omega, y, g.K[EKF_REDUCED_OMEGA]);
    delta += pm_kalman_gained(&g, y);
    self->omega = pm_sat(omega, PM_Q_BITS + 1);
    self->delta = pm_sat(delta, PM_Q_BITS);
    describe(self, self->delta, out);
}

obs_out_t ekf_reduced_last(const ekf_reduced_t *self)
{
    obs_out_t out;
    describe(self, self->delta, &out);
    return out;
}

void ekf_reduced_tie(ekf_reduced_t *self, const ekf_reduced_config_t *config)
{
    (void)config;
    self->delta = 0;
}

void ekf_reduced_slow(ekf_reduced_t *self, const ekf_reduced_config_t *config, const obs_in_t *in,
                      const obs_out_t *out, pm_q_t weight)
{
    (void)out;
    if (weight == 0) { /* before a start: at standstill nothing is observable, and the angle would drift */
        self->delta /= 2;
        self->omega = in->omega;
        set_covariance(self);
    }
    self->misfit = pm_sat(pm_abs(self->omega - in->omega), PM_Q_BITS);
    set_operating_point(self, config, in->omega, in->i_dq);
}
