/* Extended Kalman filter of full order (METHODS.md 12.4.1 to 12.4.3, row 142).
 *
 * States: both currents as fluxes lambda, the speed omega, and the error delta of the present position:
 *   lambda = (L + R T_s / 2) i
 *   delta  = theta_rotor - theta
 * The present frame moves with the loop, and delta by as much in the other direction, so the Jacobian has no
 * sine or cosine and the covariance is nearly constant. Model in the present frame:
 *   eta      = (L_d - L_q) i_q
 *   psi_d    = lambda_d + psi_m cos delta + eta sin delta
 *   psi_q    = lambda_q + psi_a sin delta
 *   psi(k)   = psi(k-1) turned back by the frame's turn + T_s v - T_s R (i(k-1) + i(k)) / 2
 *   omega(k) = omega(k-1)
 *   delta(k) = delta(k-1) + T_s omega - turn
 * The stator flux is advanced exactly, in the stationary frame, so nothing of omega T_s is neglected. L_d is
 * constant, L_q(i) renewed at 1 kHz, R a parameter; round and salient machines cost the same. Both currents
 * are measured, one after the other, which avoids the inverse of a matrix.
 *
 * Covariance: firmware/math/kalman.h (and why Joseph's form), with F at delta = 0, states in the order above:
 *   F = [  1  s  0   w ]      s = omega T_s
 *       [ -s  1 -b   0 ]      w = omega b
 *       [  0  0  1   0 ]      b = psi_a / (4 psi_m)
 *       [  0  0  T_s 1 ]
 * Units: 0.25 rad, 0.25 of the base speed, and u = psi_m T_s w_base, the EMF of base speed over one period.
 * Variances, in these units squared, per period:
 *   q_lambda   voltage error (dead time, DC link)
 *   q_omega    acceleration
 *   q_delta    whatever else the model neglects in the angle
 *   r_d, r_q   noise of the current samples
 * How to choose them: tools/ekf_tune/tune.py, docs/results/ekf_tuning.md. The filter uses the length of the
 * EMF as well as its direction, so psi_m wrong by 10 % moves the angle by degrees (docs/methods_notes.md).
 *
 * Called each period; the result belongs to k. Range: |psi| < 4, L < 4, |delta| <= 1, |omega| < 2; an
 * innovation saturates at 32 u. At weight 0, delta is halved every slow step; omega and P start anew.
 * misfit: |innovation of the q-axis| / u. vector: active flux. Cost: 492 instructions with loop.
 * Tests: tests/unit/observers/ekf_test.cpp (against Eigen in double precision), tests/scenario. */
#ifndef OBSERVERS_EKF_FULL_H
#define OBSERVERS_EKF_FULL_H

#include "firmware/math/kalman.h"
#include "observers/dq_flux.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { EKF_LAMBDA_D, EKF_LAMBDA_Q, EKF_OMEGA, EKF_DELTA, EKF_STATES };

typedef struct {
    observer_model_t model;
    int32_t per_unit; /* 1 / u, Q20 */
    /* variances, Q30 */
    int32_t q_lambda, q_omega, q_delta; /* >= PM_KALMAN_LEAST(4) */
    int32_t r_d, r_q;                   /* >= 2^-20 */
} ekf_full_config_t;

typedef struct {
    int32_t P[PM_KALMAN_SIZE(EKF_STATES)];
    dq_flux_t flux;
    pm_q_t omega, delta; /* delta in rad */
    pm_frac_t b;         /* Q32 */
    pm_q_t misfit;       /* of the last step */
} ekf_full_t;

void ekf_full_reset(ekf_full_t *self, const ekf_full_config_t *config, const obs_in_t *in);
void ekf_full_step(ekf_full_t *self, const ekf_full_config_t *config, const obs_in_t *in, obs_out_t *out);
obs_out_t ekf_full_last(const ekf_full_t *self);
void ekf_full_tie(ekf_full_t *self, const ekf_full_config_t *config);
void ekf_full_slow(ekf_full_t *self, const ekf_full_config_t *config, const obs_in_t *in,
                   const obs_out_t *out, pm_q_t weight);

void make_ekf_full(maker_t *m, ekf_full_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
