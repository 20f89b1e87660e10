/* Zero-sequence voltage of a rotating carrier (METHODS.md 6.2; row 71).
 *
 * Added (carrier.h): V_h along the axis phi_k = 2 pi k / N of the stator:
 *   v_0 = -A [cos(2 theta + phi) + kappa cos(4 theta + theta_m - phi)]
 *   told form   q = 2 theta^ + phi_k-2:  d = x + A [cos q + kappa cos(6 theta^ + theta_m - q)],  s = 2 A sin q
 * The told form takes the voltage for what was commanded: resistance and dead time turn it, by half of which the
 * position errs, 4.5 degrees on IPM-1000 at 500 Hz without load, and spoil the decoupling. So the source begins
 * with the measured form.
 *
 * What tells the poles apart looks at the voltage itself. x holds the last period of the carrier, N samples, whose harmonics
 * of it are free of each other and of the EMF:
 *   along   -2/N sum x_k cos q                A [1 + kappa cos(6 theta + theta_m)]: polarity by d-current
 *   second   2/N sum x_k e^{-j 2 phi_k-2}     z of zero_second.h: polarity by the second harmonic
 * at 1 kHz, 500 instructions with N = 20, the second twice that. A period may come between two of the samples and renew
 * one: it is of the same phase.
 *
 * The answer has the same size at any position. So it shows a lead to the star point that has come off: with P of either form,
 *   x~ = x_k - x_k-h
 *   m = 2 sqrt(mean of x~^2 / P)
 *   misfit = 4 m - 1                where m < 1/4
 * m is 1 without kappa where dL_0 is told right, and with kappa between (1 - kappa) / (1 + kappa) and its inverse.
 *
 * Forms, eps, other misfit, delay: zero_sequence.h. Functions as injection.h says.
 * Tests: tests/unit/injection/zero_sequence_test.cpp, tests/scenario/zero_rotating.yaml. */
#ifndef INJECTION_ZERO_ROTATING_H
#define INJECTION_ZERO_ROTATING_H

#include "injection/polarity.h"
#include "injection/zero_sequence.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef zero_config_t zero_rotating_config_t;

typedef struct {
    zero_t zero;
    pm_q_t x[2U * ZERO_HALF_MOST]; /* by the phase of the voltage that is commanded when they come */
} zero_rotating_t;

void zero_rotating_step(zero_rotating_t *self, const zero_rotating_config_t *config, const injection_in_t *in,
                        injection_out_t *out);

void zero_rotating_reset(zero_rotating_t *self, const zero_rotating_config_t *config, const obs_in_t *in);

void zero_rotating_slow(zero_rotating_t *self, const zero_rotating_config_t *config, const obs_in_t *in);

static inline obs_out_t zero_rotating_last(const zero_rotating_t *self, const zero_rotating_config_t *config)
{
    return zero_last(&self->zero, config);
}

/* In phase with the carrier as the position theta shows it at the neutral, per unit as x. */
pm_q_t zero_rotating_along(const zero_rotating_t *self, const zero_rotating_config_t *config,
                           pm_angle_t theta);

/* The second harmonic: alpha in phase with twice the carrier, beta a quarter of a turn ahead. */
pm_ab_t zero_rotating_second(const zero_rotating_t *self, const zero_rotating_config_t *config);

/* Of the maker's configuration, for polarity. */
polarity_carrier_t zero_rotating_polarity(maker_t *m, const zero_rotating_config_t *c);

void make_zero_rotating(maker_t *m, zero_rotating_config_t *c);

static inline injection_limits_t zero_rotating_limits(const maker_t *m)
{
    return zero_limits(m);
}

static inline pm_num_t zero_rotating_answer(const maker_t *m)
{
    return zero_answer(m);
}

#ifdef __cplusplus
}
#endif

#endif
