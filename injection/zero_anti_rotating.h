/* Zero-sequence voltage of a carrier along an axis that turns back at twice the speed (METHODS.md 6.4 and
 * 6.6; rows 73 to 77).
 *
 * Added (carrier.h): V_h r along chi = 90 degrees - 2 theta^, with r = cos 2 pi k / N, or +-1 for N = 2:
 *   v_0 = A r [sin 2 e - kappa sin(6 theta^ + theta_m + 4 e)],  e: position error
 *   told form   d = x + A kappa r sin(6 theta^ + theta_m),  s = 2 A r [1 - 2 kappa cos(6 theta^ + theta_m)]
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

#if PM_CARRIES(NEEDS_NEUTRAL)
static inline void zero_anti_rotating_step(zero_anti_rotating_t *self,
                                           const zero_anti_rotating_config_t *config,
                                           const injection_in_t *in, injection_out_t *out)
{
    const pm_q_t x = zero_voltage(self, config, in);
    const pm_dq_t i = pm_park_half(in->i, in->dir);
    const pm_unit_t next = zero_cosine(self, config);
    zero_sequence_sample_t sample;
    if (self->measured != 0U) {
        sample = zero_measured(self, config, in, i, x);
    } else {
        const pm_unit_t r = zero_swing(self, next);
        self->told.q += self->rate.q;
        sample.d = x + pm_unit(self->told.q, r);
        sample.s = pm_unit(self->s_told, r);
    }
    zero_close(self, config, i, sample, out);
    out->carrier = excitation_of(carrier_anti_rotating(zero_amplitude(config, next), in->ahead));
}
#endif

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
