/* Zero-sequence voltage of a carrier along an axis that turns back at twice the speed (METHODS.md 6.4 and
 * 6.6; rows 73 to 77).
 *
 * Added (carrier.h): V_h r along chi = 90 degrees - 2 theta^, with r = cos 2 pi k / N, or +-1 for N = 2:
 *   v_0 = A r [sin 2 e - kappa sin(6 theta^ + theta_m + 4 e)],  e: position error
 * There the first part is none at e = 0 whatever the position is, at standstill too. The second has the told
 * kappa and theta_m (`told`), or is the current's negative sequence as the neutral sees it (`measured`).
 * Under load the lock moves by 1/2 atan(L_c0 / dL_0), which zero_L_c0 takes away (6.4.3, 6.6.3).
 *
 * Forms, eps, misfit, delay: zero_sequence.h. Functions as injection.h says.
 * Tests: tests/unit/injection/zero_sequence_test.cpp, tests/scenario/zero_anti_rotating.yaml. */
#ifndef INJECTION_ZERO_ANTI_ROTATING_H
#define INJECTION_ZERO_ANTI_ROTATING_H

#include "injection/zero_sequence.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef zero_config_t zero_anti_rotating_config_t;
typedef zero_t zero_anti_rotating_t;

void zero_anti_rotating_step(zero_anti_rotating_t *self, const zero_anti_rotating_config_t *config,
                             const injection_in_t *in, injection_out_t *out);

static inline void zero_anti_rotating_reset(zero_anti_rotating_t *self,
                                            const zero_anti_rotating_config_t *config, const obs_in_t *in)
{
    zero_reset(self, config, in);
}

static inline void zero_anti_rotating_slow(zero_anti_rotating_t *self,
                                           const zero_anti_rotating_config_t *config, const obs_in_t *in)
{
    zero_slow(self, config, in);
}

static inline obs_out_t zero_anti_rotating_last(const zero_anti_rotating_t *self,
                                                const zero_anti_rotating_config_t *config)
{
    return zero_last(self, config);
}

void make_zero_anti_rotating(maker_t *m, zero_anti_rotating_config_t *c);

static inline injection_limits_t zero_anti_rotating_limits(const maker_t *m)
{
    return zero_limits(m);
}

static inline pm_num_t zero_anti_rotating_answer(const maker_t *m)
{
    return zero_answer(m);
}

#ifdef __cplusplus
}
#endif

#endif
