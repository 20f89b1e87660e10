/* Third harmonic of two sets of windings by its EMFs (METHODS.md 11.5.2, 7.2.5; rows 131 and 88).
 *
 * The second set lies 30 degrees on, its third harmonic a quarter of a cycle:
 *   v_01 = -3 omega psi_3 sin 3 theta
 *   v_02 = 3 omega psi_3 cos 3 theta
 * so the pair of third.h is there without an integrator or a filter, y = v_01 and q = v_02, at any instant. A ninth harmonic has the
 * other sense, and adds
 *   (psi_9 / psi_3) sin 12 theta                   rad, before the loop
 * The loop alone filters the noise. Needs the star points of both sets.
 *
 * Called each period; the result belongs to k. Tests: tests/unit/observers/third_test.cpp, tests/scenario/third_pair.yaml. */
#ifndef OBSERVERS_THIRD_PAIR_H
#define OBSERVERS_THIRD_PAIR_H

#include "observers/third.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    third_config_t third;
} third_pair_config_t;

typedef struct {
    third_t third;
} third_pair_t;

/* Of the second set, per-unit, Q30. */
static inline int32_t third_seen_second(const obs_in_t *in)
{
#if PM_CARRIES(NEEDS_NEUTRAL) && PM_CARRIES(NEEDS_SECOND_SET)
    return pm_shl(pm_sat(in->more->v_zero_second, PM_Q_BITS - 1), 30 - PM_Q_BITS);
#else
    (void)in;
    return 0;
#endif
}

void third_pair_reset(third_pair_t *self, const third_pair_config_t *config, const obs_in_t *in);
void third_pair_step(third_pair_t *self, const third_pair_config_t *config, const obs_in_t *in,
                     obs_out_t *out);
obs_out_t third_pair_last(const third_pair_t *self);
void third_pair_tie(third_pair_t *self, const third_pair_config_t *config);
void third_pair_slow(third_pair_t *self, const third_pair_config_t *config, const obs_in_t *in,
                     const obs_out_t *out, pm_q_t weight);

void make_third_pair(maker_t *m, third_pair_config_t *c);

/* What third_pair_flux.h needs as well. */
void third_pair_check(maker_t *m);

#ifdef __cplusplus
}
#endif

#endif
