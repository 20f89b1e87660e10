#include "observers/ekf_full.h"

#include "firmware/math/pair.h"
#include "firmware/math/root.h"

#define SEED_DELTA PM_SCALED(0.16, 1073741824.0)   /* 0.1 rad */
#define SEED_OMEGA PM_SCALED(0.0064, 1073741824.0) /* 0.02 of the base speed */

static void set_operating_point(ekf_full_t *self, const ekf_full_config_t *config, pm_dq_t i)
{
    dq_flux_set(&self->flux, &config->model, i);
    self->b = pm_small(pm_div(self->flux.psi_a, config->model.psi_m) / 4);
}

static void set_covariance(ekf_full_t *self, const ekf_full_config_t *config)
{
    for (unsigned k = 0; k < PM_KALMAN_SIZE(EKF_STATES); k++) {
        self->P[k] = 0;
    }
    self->P[PM_KALMAN_AT(EKF_LAMBDA_D, EKF_LAMBDA_D)] = config->r_d;
    self->P[PM_KALMAN_AT(EKF_LAMBDA_Q, EKF_LAMBDA_Q)] = config->r_q;
    self->P[PM_KALMAN_AT(EKF_OMEGA, EKF_OMEGA)] = SEED_OMEGA;
    self->P[PM_KALMAN_AT(EKF_DELTA, EKF_DELTA)] = SEED_DELTA;
}

void ekf_full_reset(ekf_full_t *self, const ekf_full_config_t *config, const obs_in_t *in)
{
    *self = (ekf_full_t){.omega = in->omega};
    set_operating_point(self, config, in->i_dq);
    set_covariance(self, config);
    const pm_dq_t magnet = {.d = config->model.psi_m, .q = 0};
    dq_flux_keep(&self->flux, dq_flux_lambda(&self->flux, in->i, in->dir), magnet, in->dir);
}

/* P <- F P F' + Q; names: row and column in the order of the states. */
static inline void predict(ekf_full_t *self, const ekf_full_config_t *config, pm_q_t omega)
{
    const int32_t s = pm_small(pm_frac(omega, config->model.t_s));
    const int32_t w = pm_small(pm_frac(omega, self->b));
    const int32_t b = self->b;
    const int32_t t = config->model.t_s;
    int32_t *P = self->P;
    const int32_t P11 = P[0], P21 = P[1], P22 = P[2], P31 = P[3], P32 = P[4], P33 = P[5];
    const int32_t P41 = P[6], P42 = P[7], P43 = P[8], P44 = P[9];
    /* F P */
    const int32_t A1 = pm_mulh_add(pm_mulh_add(P11, P21, s), P41, w);
    const int32_t A2 = pm_mulh_add(pm_mulh_add(P21, P22, s), P42, w);
    const int32_t A3 = pm_mulh_add(pm_mulh_add(P31, P32, s), P43, w);
    const int32_t A4 = pm_mulh_add(pm_mulh_add(P41, P42, s), P44, w);
    const int32_t B1 = pm_mulh_sub(pm_mulh_sub(P21, P11, s), P31, b);
    const int32_t B2 = pm_mulh_sub(pm_mulh_sub(P22, P21, s), P32, b);
    const int32_t B3 = pm_mulh_sub(pm_mulh_sub(P32, P31, s), P33, b);
    const int32_t B4 = pm_mulh_sub(pm_mulh_sub(P42, P41, s), P43, b);
    const int32_t D3 = pm_mulh_add(P43, P33, t);
    const int32_t D4 = pm_mulh_add(P44, P43, t);
    /* ... F' */
    P[0] = pm_mulh_add(pm_mulh_add(A1, A2, s), A4, w) + config->q_lambda;
    P[1] = pm_mulh_sub(pm_mulh_sub(A2, A1, s), A3, b);
    P[2] = pm_mulh_sub(pm_mulh_sub(B2, B1, s), B3, b) + config->q_lambda;
    P[3] = A3;
    P[4] = B3;
    P[5] = P33 + config->q_omega;
    P[6] = pm_mulh_add(A4, A3, t);
    P[7] = pm_mulh_add(B4, B3, t);
    P[8] = D3;
    P[9] = pm_mulh_add(D4, D3, t) + config->q_delta;
}

/* An innovation in the filter's unit, Q26: with the units of the angle and the speed their corrections are
 * Q28. */
static inline int32_t in_units(const ekf_full_config_t *config, pm_q_t y)
{
    return pm_shl(pm_sat(pm_mulh(pm_small(y), config->per_unit), 25), 6);
}

static inline void describe(const ekf_full_t *self, obs_out_t *out)
{
    out->eps = self->delta;
    out->misfit = self->misfit;
    out->vector = (pm_dq_t){.d = self->flux.psi_a, .q = pm_mul(self->flux.psi_a, self->delta)};
}

void ekf_full_step(ekf_full_t *self, const ekf_full_config_t *config, const obs_in_t *in, obs_out_t *out)
{
    const pm_dir_t dir = in->dir;
    const pm_frac_t t_s = config->model.t_s;
    const pm_dq_t psi = dq_flux_advance(&self->flux, t_s, in->v, dir);
    const pm_dq_t measured = dq_flux_lambda(&self->flux, in->i, dir);

    pm_q_t omega = self->omega;
    pm_q_t delta = pm_frac_add(self->delta, omega, t_s) - pm_dir_turn(self->flux.dir, dir);
    delta = pm_sat(delta, PM_Q_BITS);
    const pm_q_t square = pm_mul(delta, delta);
    const pm_q_t sine = delta - pm_mul(pm_frac(delta, PM_FRAC(0.166666666666666667)), square);
    pm_dq_t angle = {.d = config->model.psi_m - pm_shl(pm_mulh(config->model.psi_m, square), 3) +
                          pm_mul(self->flux.eta, sine),
                     .q = pm_mul(self->flux.psi_a, sine)};
    pm_dq_t lambda = {.d = pm_sub_sat(psi.d, angle.d), .q = pm_sub_sat(psi.q, angle.q)};

    predict(self, config, in->omega);
    const pm_q_t y_d = pm_sub_sat(measured.d, lambda.d);
    const int32_t u_d = in_units(config, y_d);
    const pm_kalman_gain_t d = pm_kalman_measure(self->P, EKF_STATES, EKF_LAMBDA_D, config->r_d);
    lambda.q = pm_mulh_add(lambda.q, y_d, d.K[EKF_LAMBDA_Q]);
    const pm_q_t y_q = pm_sub_sat(measured.q, lambda.q);
    const int32_t u_q = in_units(config, y_q);
    const pm_kalman_gain_t q = pm_kalman_measure(self->P, EKF_STATES, EKF_LAMBDA_Q, config->r_q);
    pm_kalman_hold(self->P, EKF_STATES, EKF_OMEGA);
    pm_kalman_hold(self->P, EKF_STATES, EKF_DELTA);

    lambda.d = pm_mulh_add(lambda.d + pm_kalman_gained(&d, y_d), y_q, q.K[EKF_LAMBDA_D]);
    lambda.d = pm_sat(lambda.d, PM_Q_BITS + 2);
    lambda.q = pm_sat(lambda.q + pm_kalman_gained(&q, y_q), PM_Q_BITS + 2);
    omega = pm_mulh_add(pm_mulh_add(omega, u_d, d.K[EKF_OMEGA]), u_q, q.K[EKF_OMEGA]);
    const pm_q_t wanted = pm_mulh_add(pm_mulh(u_d, d.K[EKF_DELTA]), u_q, q.K[EKF_DELTA]);
    const pm_q_t change = pm_sat(wanted, PM_Q_BITS);
    angle.d += pm_mul(self->flux.eta, change);
    angle.q += pm_mul(self->flux.psi_a, change);
    self->omega = pm_sat(omega, PM_Q_BITS + 1);
    self->delta = pm_sat(pm_add_sat(delta, change), PM_Q_BITS);
    self->misfit = pm_shl(pm_sat(pm_magnitude(u_q), 26), 2);
    dq_flux_keep(&self->flux, lambda, angle, dir);
    describe(self, out);
}

obs_out_t ekf_full_last(const ekf_full_t *self)
{
    obs_out_t out;
    describe(self, &out);
    return out;
}

/* Another angle at the same current. */
static void move_angle(ekf_full_t *self, pm_q_t change)
{
    const pm_dq_t move = {.d = pm_mul(self->flux.eta, change), .q = pm_mul(self->flux.psi_a, change)};
    const pm_ab_t turned = pm_park_inverse(move, self->flux.dir);
    self->flux.psi.alpha += turned.alpha;
    self->flux.psi.beta += turned.beta;
    self->delta += change;
}

void ekf_full_tie(ekf_full_t *self, const ekf_full_config_t *config)
{
    (void)config;
    move_angle(self, -self->delta);
}

void ekf_full_slow(ekf_full_t *self, const ekf_full_config_t *config, const obs_in_t *in,
                   const obs_out_t *out, pm_q_t weight)
{
    (void)out;
    if (weight == 0) { /* before a start: at standstill nothing is observable, and the angle would drift */
        move_angle(self, -(self->delta / 2));
        self->omega = in->omega;
        set_covariance(self, config);
    }
    set_operating_point(self, config, in->i_dq);
}
