/* Zero-sequence voltage of two sets of windings, the second 30 degrees on (METHODS.md 7.2.3): what zero_pair_anti_rotating.h and
 * zero_pair_rotating.h have in common.
 *
 * The second set has the carrier of the first turned back by 90 degrees, v_2 = -j v_1. In axes of its own that is 240 degrees, and its
 * zero sequence is that of the first with the other sign, but for the term with kappa, which has the same: the difference holds twice
 * the answer and none of kappa. With psi_0 of a set as in zero_sequence.h, u_2 = -j c i_2 e^{j 2 theta} in axes of the machine, so
 * that of half the difference
 *   x = (x_1 - x_2) / 2
 *   u = c i e^{j 2 theta^}
 *   i = (i_1 + j i_2) / 2
 * and all else is the measured form of zero_sequence.h: it needs neither the mutual inductance of the sets nor kappa, of which M
 * leaves some in the difference. The told form is not offered: the start aligns the rotor.
 * Half of the carrier is in the difference of the sets, against L - M: its current and torque ripple there. The control of the
 * difference is slowed to an eighth meanwhile (drive/two_sets.h).
 *
 * State as zero_sequence.h. Tests: tests/unit/injection/zero_pair_test.cpp. */
#ifndef INJECTION_ZERO_PAIR_H
#define INJECTION_ZERO_PAIR_H

#include "injection/zero_sequence.h"

#ifdef __cplusplus
extern "C" {
#endif

#if PM_CARRIES(NEEDS_NEUTRAL) && PM_CARRIES(NEEDS_SECOND_SET)

/* x, and what the currents of both sets make of it. */
static inline zero_sequence_sample_t zero_pair_sample(zero_t *self, const zero_config_t *config,
                                                      const injection_in_t *in, pm_dq_t i)
{
    const obs_more_t *more = in->more;
    obs_more_t half = *more;
    half.v_zero = pm_half(more->v_zero - more->v_zero_second);
    injection_in_t pair = *in;
    pair.more = &half;
    const pm_q_t x = zero_voltage(self, config, &pair);
    /* i_1 and i_2 are the mean and half of the difference, added and taken away */
    const pm_ab_t first = {in->i.alpha + more->apart.alpha, in->i.beta + more->apart.beta};
    const pm_ab_t second = {in->i.alpha - more->apart.alpha, in->i.beta - more->apart.beta};
    pair.i.alpha = pm_half(first.alpha - second.beta);
    pair.i.beta = pm_half(first.beta + second.alpha);
    return zero_measured(self, config, &pair, i, x);
}

/* Voltage of the first set, with that of the second. */
static inline excitation_t zero_pair_carrier(pm_ab_t v)
{
    excitation_t e = excitation_of(v);
    e.apart.alpha = v.beta - v.alpha;
    e.apart.beta = -v.alpha - v.beta;
    return e;
}

#endif

/* zero_pair_config.c */
void make_zero_pair(maker_t *m, zero_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
