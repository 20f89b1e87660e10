/* Zero-sequence voltage of two sets of windings, carrier along an axis that turns back at twice the speed (METHODS.md 7.2.3.3,
 * row 83): that of zero_anti_rotating.h on both sets.
 *
 * Forms, eps, delay: zero_pair.h. Functions as injection.h says. Tests: tests/unit/injection/zero_pair_test.cpp,
 * tests/scenario/zero_pair.yaml. */
#ifndef INJECTION_ZERO_PAIR_ANTI_ROTATING_H
#define INJECTION_ZERO_PAIR_ANTI_ROTATING_H

#include "injection/zero_pair.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef zero_config_t zero_pair_anti_rotating_config_t;
typedef zero_t zero_pair_anti_rotating_t;

#if PM_CARRIES(NEEDS_NEUTRAL) && PM_CARRIES(NEEDS_SECOND_SET)
static inline void zero_pair_anti_rotating_step(zero_pair_anti_rotating_t *self,
                                                const zero_pair_anti_rotating_config_t *config,
                                                const injection_in_t *in, injection_out_t *out)
{
    const pm_dq_t i = pm_park_half(in->i, in->dir);
    const pm_unit_t next = zero_cosine(self, config);
    const zero_sequence_sample_t sample = zero_pair_sample(self, config, in, i);
    zero_close(self, config, i, sample, out);
    out->carrier = zero_pair_carrier(carrier_anti_rotating(zero_amplitude(config, next), in->ahead));
}
#endif

static inline void zero_pair_anti_rotating_reset(zero_pair_anti_rotating_t *self,
                                                 const zero_pair_anti_rotating_config_t *config,
                                                 const obs_in_t *in)
{
    zero_reset(self, config, in);
}

static inline void zero_pair_anti_rotating_slow(zero_pair_anti_rotating_t *self,
                                                const zero_pair_anti_rotating_config_t *config,
                                                const obs_in_t *in)
{
    zero_slow(self, config, in);
}

static inline obs_out_t zero_pair_anti_rotating_last(const zero_pair_anti_rotating_t *self,
                                                     const zero_pair_anti_rotating_config_t *config)
{
    return zero_last(self, config);
}

void make_zero_pair_anti_rotating(maker_t *m, zero_pair_anti_rotating_config_t *c);

static inline injection_limits_t zero_pair_anti_rotating_limits(const maker_t *m)
{
    return zero_limits(m);
}

static inline pm_num_t zero_pair_anti_rotating_answer(const maker_t *m)
{
    return zero_answer(m);
}

#ifdef __cplusplus
}
#endif

#endif
