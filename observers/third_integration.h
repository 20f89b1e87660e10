/* Third harmonic by integration (METHODS.md 11.4.1, row 127): the third harmonic's flux, without drift and without lag.
 *
 *   psi' += T (v_zero - w_c (psi' + T v_zero/2)),   w_c = g 3 |omega|
 *   psi_0 = (1 + g^2) psi' - g v_zero / (3 |omega|)
 * exact at 3 omega, since (1 + g^2) psi' - g (v_zero / 3 |omega|) turns and stretches psi' back by 1 - j g sgn omega. The pair
 * of third.h is y = v_zero, q = 3 omega psi_0: the quotient of both in place of the arc cosine of psi_0 with the branch by the
 * sign of v_zero, which is the same angle but for the amplitude, and not blunt where psi_0 peaks. g = third_drift; with 0 an
 * offset dv leaves dv T in each period: it drifts away.
 * y is the mean of two periods, which cancels a carrier of half the sampling frequency. It lies half a period before k, and so
 * does the sum before the period is added to it: x of third.h takes that with the RC.
 *
 * Called each period; the result belongs to k. v_zero is not filtered but by the loop. Tests:
 * tests/unit/observers/third_test.cpp, tests/scenario/third_harmonic.yaml. */
#ifndef OBSERVERS_THIRD_INTEGRATION_H
#define OBSERVERS_THIRD_INTEGRATION_H

#include "observers/third.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    third_config_t third;
    pm_q_t g;
} third_integration_config_t;

typedef struct {
    third_t third;
    int32_t x;    /* v_zero at k-1, per-unit, Q30 */
    int32_t psi;  /* psi' half a period after k-1, per-unit, Q30 */
    int32_t leak; /* w_c T, Q32 */
    int32_t lift; /* 3 omega (1 + g^2), Q29 */
    int32_t back; /* g sgn omega, Q30 */
} third_integration_t;

void third_integration_reset(third_integration_t *self, const third_integration_config_t *config,
                             const obs_in_t *in);
void third_integration_step(third_integration_t *self, const third_integration_config_t *config,
                            const obs_in_t *in, obs_out_t *out);
obs_out_t third_integration_last(const third_integration_t *self);
void third_integration_tie(third_integration_t *self, const third_integration_config_t *config);
void third_integration_slow(third_integration_t *self, const third_integration_config_t *config,
                            const obs_in_t *in, const obs_out_t *out, pm_q_t weight);

void make_third_integration(maker_t *m, third_integration_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
