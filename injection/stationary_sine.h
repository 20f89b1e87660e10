/* Sine injection along alpha of the stator (METHODS.md 4.4.2, row 40), with the part of the answer that is
 * the same for all positions detected first and then taken away (4.4.2.2, row 41; stationary.h).
 *
 * Added along the axis g of stationary.h, with phi, phi' and F of sine.h:
 *   v = V_h cos phi_k e^{j g}
 * I_p is removed from each sample of the stationary frame, before anything else. What is left goes into the
 * window in the estimated frame, where the fundamental current is a constant and drops out, and is read in
 * phase with the answer:
 *   y   = 2/N sum (i - I_p' cos(phi' - delta) e^{j g}) e^{-j theta^} cos(phi' - delta)
 *   eps = gain(i_q) Im[y e^{-j theta^} e^{j g} e^{j (omega tau - theta_m)}],  gain = 1 / (2 I_n),  tau = (N - 1) / 2 T_s
 * delta, the phase of the whole answer along g, shows what dead time takes from it: the voltage that it adds
 * is in phase with the current, so
 *   I_p' = I_p cos delta
 * By that the I_p that was detected without load, where dead time counts most, serves under load too.
 *
 * Whatever the estimate is, the carrier is the same. eps is exact for small errors and 1/2 sin 2e beyond; it
 * is 0 in the first N + 2 steps after a reset and held in those after a change of the axis. misfit: |y|
 * against I_n, relative. Bandwidths: sine.h. Each period 180 instructions; I_p, delta and the turn at 1 kHz.
 * Functions as injection.h says. Tests: tests/unit/injection/stationary_test.cpp, stationary_sine_test.cpp,
 * tests/scenario/stationary_sine.yaml. */
#ifndef INJECTION_STATIONARY_SINE_H
#define INJECTION_STATIONARY_SINE_H

#include "injection/sine.h"
#include "injection/stationary.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    sine_config_t sine;
    stationary_config_t stationary;
    saliency_config_t saliency;
    pm_q_t tau;          /* times w_base: rad per unit of speed */
    bool phase_measured; /* delta from the answer; else 0 */
} stationary_sine_config_t;

typedef struct {
    sine_t sine;
    stationary_t stationary;
    pm_dir_t phase; /* e^{j delta} */
    pm_dir_t turn;  /* e^{j (omega tau - theta_m)} */
    int32_t gain;   /* rad per unit of current, Q20 */
    pm_q_t i_p;     /* I_p' */
    pm_dq_t y;      /* I_n e^{j (2 e + theta_m)} */
    pm_q_t eps;
    pm_q_t misfit;
} stationary_sine_t;

void stationary_sine_reset(stationary_sine_t *self, const stationary_sine_config_t *config,
                           const obs_in_t *in);
void stationary_sine_step(stationary_sine_t *self, const stationary_sine_config_t *config,
                          const injection_in_t *in, injection_out_t *out);
void stationary_sine_slow(stationary_sine_t *self, const stationary_sine_config_t *config,
                          const obs_in_t *in);
obs_out_t stationary_sine_last(const stationary_sine_t *self, const stationary_sine_config_t *config);

void make_stationary_sine(maker_t *m, stationary_sine_config_t *c);
injection_limits_t stationary_sine_limits(const maker_t *m);
pm_num_t stationary_sine_answer(const maker_t *m);

#ifdef __cplusplus
}
#endif

#endif
