/* Zero-sequence voltage of a carrier along d of the estimated frame (METHODS.md 6.3 and 6.5; rows 72 and 75): the
 * conventional pulsating injection.
 *
 * Added (carrier.h): V_h r along d, with r = cos 2 pi k / N, or +-1 for N = 2:
 *   v_0 = -A r [cos(3 theta^ + 2 e) + kappa cos(3 theta^ + theta_m + 4 e)],  e: position error
 *   told form   d = x,  s = 2 A (1 + 2 kappa) r sin 3 theta^
 * What is left at e = 0 swings with 6 theta^ and is as large as the answer: the told form needs a loop of 2 Hz
 * or so, the measured one has nothing left. Both are blind where sin 3 theta^ = 0, so P is a mean over 0.2 s and the
 * source must not be used at standstill: below 8 rad/s (electrical) misfit is 1, which ends as a lost position. It
 * starts with the rotor turning (flying_start).
 * Under load the told form is off by -kappa sin theta_m / (2 + 4 kappa cos theta_m).
 *
 * Forms, eps, delay: zero_sequence.h. Functions as injection.h says.
 * Tests: tests/unit/injection/zero_sequence_test.cpp, tests/scenario/zero_pulsating.yaml. */
#ifndef INJECTION_ZERO_PULSATING_H
#define INJECTION_ZERO_PULSATING_H

#include "injection/zero_sequence.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef zero_config_t zero_pulsating_config_t;
typedef zero_t zero_pulsating_t;

void zero_pulsating_step(zero_pulsating_t *self, const zero_pulsating_config_t *config,
                         const injection_in_t *in, injection_out_t *out);

static inline void zero_pulsating_reset(zero_pulsating_t *self, const zero_pulsating_config_t *config,
                                        const obs_in_t *in)
{
    zero_reset(self, config, in);
}

static inline void zero_pulsating_slow(zero_pulsating_t *self, const zero_pulsating_config_t *config,
                                       const obs_in_t *in)
{
    zero_slow(self, config, in);
}

static inline obs_out_t zero_pulsating_last(const zero_pulsating_t *self,
                                            const zero_pulsating_config_t *config)
{
    return zero_last(self, config);
}

void make_zero_pulsating(maker_t *m, zero_pulsating_config_t *c);

static inline injection_limits_t zero_pulsating_limits(const maker_t *m)
{
    return zero_limits(m);
}

static inline pm_num_t zero_pulsating_answer(const maker_t *m)
{
    return zero_answer(m);
}

#ifdef __cplusplus
}
#endif

#endif
