/* Extended Kalman filter of reduced order: speed and angle from the EMF (METHODS.md 12.4.4, row 143).
 *
 * States: omega and delta = theta_rotor - theta, the error of the present position, as in ekf_full.h.
 * Measured is rho, the part of the flux change over a period that the machine at the present position does
 * not explain:
 *   psi = (L_d i_d + psi_m, L_q i_q)
 *   eta = (L_d - L_q) i_q
 *   rho = psi(k-1) turned back by the frame's turn + T_s v - T_s R i - psi(k)
 *       = T_s omega delta (-psi_a, eta) + (T_s omega - turn) (eta, psi_a)
 * the EMF of the period against that of the present position, without an approximation in omega T_s. Angle
 * and speed act on rho at right angles. Only the part of the angle is measured:
 *   z      = (-psi_a rho_d + eta rho_q) / (T_s omega (psi_a^2 + eta^2)) = sin delta
 *   var(z) = r psi_m^2 / (psi_a^2 + eta^2) / omega^2        omega per-unit, r the variance of rho / u
 * The other part shows the speed, but so does the drift of delta, and with a measured speed a wrong psi_m
 * would move the angle considerably. (With rho_d alone the loop is unstable while a salient machine
 * generates: its first reaction moves the angle the wrong way.)
 * L_d is constant, L_q(i) renewed at 1 kHz, R a parameter; round and salient machines cost the same. The
 * noise of rho at successive samples is correlated (each current enters twice, with opposite signs), which
 * the filter does not model: r is then on the safe side.
 *
 * Covariance: firmware/math/kalman.h (and why Joseph's form), in units of 1 rad, the base speed and
 * u = psi_m T_s w_base:
 *   F = [  1  0 ]
 *       [ T_s 1 ]
 * Below omega_min, where var(z) no longer holds, z fades with (omega / omega_min)^2.
 *
 * Called each period; the result belongs to k. Range: |psi| < 4, L < 4, |delta| <= 1, |omega| < 2. At weight
 * 0, delta is halved every slow step; omega and P start anew. misfit: |omega of the filter - omega of the
 * loop|, relative to base speed, at 1 kHz. vector: active flux. Cost: 170 instructions with loop, 35 % of
 * ekf_full.h. Tests: tests/unit/observers/ekf_test.cpp (against Eigen in double precision), tests/scenario,
 * tests/target/observers. */
#ifndef OBSERVERS_EKF_REDUCED_H
#define OBSERVERS_EKF_REDUCED_H

#include "firmware/math/kalman.h"
#include "observers/dq_flux.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { EKF_REDUCED_OMEGA, EKF_REDUCED_DELTA, EKF_REDUCED_STATES };

typedef struct {
    observer_model_t model;
    pm_q_t omega_min; /* > 0 */
    /* variances, Q30 */
    int32_t q_omega, q_delta; /* >= PM_KALMAN_LEAST(2) */
    int32_t r;                /* of rho, in u^2; >= 2^-20 */
} ekf_reduced_config_t;

typedef struct {
    int32_t P[PM_KALMAN_SIZE(EKF_REDUCED_STATES)];
    dq_flux_t flux;      /* that the present position explains */
    pm_q_t omega, delta; /* delta in rad */
    int32_t per_d;       /* what z takes of rho, fading below omega_min, Q18 */
    int32_t per_q;
    int32_t r_delta; /* Q30 */
    pm_q_t misfit;
} ekf_reduced_t;

void ekf_reduced_reset(ekf_reduced_t *self, const ekf_reduced_config_t *config, const obs_in_t *in);
void ekf_reduced_step(ekf_reduced_t *self, const ekf_reduced_config_t *config, const obs_in_t *in,
                      obs_out_t *out);
obs_out_t ekf_reduced_last(const ekf_reduced_t *self);
void ekf_reduced_tie(ekf_reduced_t *self, const ekf_reduced_config_t *config);
void ekf_reduced_slow(ekf_reduced_t *self, const ekf_reduced_config_t *config, const obs_in_t *in,
                      const obs_out_t *out, pm_q_t weight);

void make_ekf_reduced(maker_t *m, ekf_reduced_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
