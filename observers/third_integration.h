/* Third harmonic by integration (METHODS.md 11.4.1, row 127): the third harmonic's flux, without drift and without lag.
 *
 *   psi' += T (v_zero - w_c (psi' - psi^/2)),   w_c = g 3 |omega|,   psi^ = a Re(L e^{j 3 theta} / (1 + j x))
 *   psi_0 = (1 + g h) psi' - h v_zero / (3 |omega|),   h = g / (2 + g^2)
 * psi^ is what the position expects of it, a = Re z of third.h in the mean over 256 ms, 1/2 to 3/2. The second line is exact at 3
 * omega, as (1 - j g) / (1 - j g/2) is what the first does to a flux that the position is right about. So the removal of the drift
 * turns the flux of another speed half as much as without psi^; with all of it, it would not at all, but an offset would stay, as
 * a position that errs with it expects it, where the loop is faster than 3 omega. g = third_drift; with 0 an offset dv
 * leaves dv T in each period: it drifts away. Of an error of the position that stays, the flux shows 1 / (1 + g^2/4).
 *
 * The pair of third.h is y = v_zero, q = 3 omega psi_0. Of the flux no speed is asked, of v_zero it is: where the loop's is off by
 * eta, y is off by eta, Im z by eta s c and Re z by eta s^2, c and s being the direction of 3 theta + arg(L / (1 + j x)). So
 *   eps = (Im z + s c (1 + c^2) (a - Re z)) / 3
 * errs by eta s c^5 / 3 only: half as much, and none but where the flux peaks and says nothing of the position.
 * y is the mean of two periods, which cancels a carrier of half the sampling frequency. It lies half a period before k, and so
 * does the sum before the period is added to it: x takes that with the RC.
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
    pm_q_t lead;      /* h */
    bool expects;     /* else without psi^ and with h = g */
    pm_frac_t centre; /* of what the period adds, to the instant of what is removed: 1/4, 1/2 without psi^ */
} third_integration_config_t;

typedef struct {
    third_t third;
    int32_t x;           /* v_zero at k-1, per-unit, Q30 */
    int32_t psi;         /* psi' half a period after k-1, per-unit, Q30 */
    int32_t leak;        /* w_c T, Q32 */
    int32_t lift;        /* 3 omega (1 + g h), Q29 */
    int32_t back;        /* h sgn omega, Q30 */
    pm_half_dir_t along; /* conjugate of L / (1 + j x), its direction */
    int32_t size;        /* a |L / (1 + j x)|, per-unit, Q30 */
    int32_t share;       /* a, Q17 */
    int32_t seen;        /* 3 eps of the last step, Q17 */
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
