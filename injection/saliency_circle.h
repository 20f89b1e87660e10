/* The saliency circle and the incremental inductances that it shows (METHODS.md 5.3.2, row 53; 4.2.2).
 *
 * A carrier V_h cos phi along an axis that is turned by eta drives, with theta the rotor's angle and F the flux of
 * the carrier:
 *   c(eta)  = I_p e^{j eta} + I_n e^{j (2 theta + theta_m - eta)}          stationary frame
 *   c e^{-j eta} = I_p + I_n e^{j (2 (theta - eta) + theta_m)}:            a circle about I_p of radius I_n
 * Over whole turns of eta its least-squares fit is
 *   I_p                          = mean(c e^{-j eta})
 *   I_n e^{j (2 theta + theta_m)} = mean(c e^{j eta})
 * and in the frame of theta, with the part g of the answer that is in phase with the voltage, as resistance, dead
 * time and leg capacitance make it:
 *   B = [I_p + n_d, n_q; n_q, I_p - n_d],  n = I_n e^{j theta_m};  G of g likewise
 *   [L_d, L_dq; L_dq, L_q] = F (B + G B^-1 G)^-1
 * which is exact for any symmetric G, not for small ones alone. Dead time takes 8 % of I_p from IPM-1000 without current; B +
 * G B^-1 G has them.
 *
 * saliency_circle_add() takes the answer at one of SALIENCY_CIRCLE_AXES axes, equally apart: 40 instructions at 1 kHz.
 * saliency_circle_inductances(): once a circle. Range: I_p from 1/256 to 2, |g| < I_p, I_n < I_p; where they are not,
 * all is 0. Tests: tests/unit/injection/saliency_circle_test.cpp, tests/scenario/saliency_map.yaml. */
#ifndef INJECTION_SALIENCY_CIRCLE_H
#define INJECTION_SALIENCY_CIRCLE_H

#include "firmware/math/frames.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SALIENCY_CIRCLE_AXES 384

/* Half of the amplitudes, as a window gives them. */
typedef struct {
    pm_dq_t p, n;     /* of what lags by a quarter: centre, and radius at its angle */
    pm_dq_t g_p, g_n; /* of what is in phase with the voltage */
} saliency_circle_t;

typedef struct {
    pm_q_t L_d, L_q, L_dq; /* incremental, psi / i */
} saliency_point_t;

void saliency_circle_reset(saliency_circle_t *self);

/* axis: direction of eta; the answer's parts with the cosine and the sine of the phase of a current that lags by a
 * quarter (sine.h), each half its amplitude; stationary frame. */
void saliency_circle_add(saliency_circle_t *self, pm_dir_t axis, pm_dq_t lagging, pm_dq_t in_phase);

/* Of the whole circle, without what is in phase with the voltage: I_p, I_n, and theta + theta_m / 2, less half a turn
 * or not. */
typedef struct {
    pm_q_t centre, radius;
    pm_angle_t angle;
} saliency_fit_t;

saliency_fit_t saliency_circle_fit(const saliency_circle_t *self);

saliency_point_t saliency_circle_inductances(const saliency_circle_t *self, pm_angle_t theta, pm_q_t flux);

#ifdef __cplusplus
}
#endif

#endif
