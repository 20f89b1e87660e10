/* Initial position by four voltage pulses (METHODS.md 9.4.2; METHODS-ADDENDUM.md E16, E18; row 101): two
 * thirds of the time, noise and movement of six, for a polarity that is seen 1.4 times less clearly.
 *
 * Pulses A+ B+ C+, then the opposite of that of them which lies nearest to the magnet's axis, either pole, as
 * the first three say. With i the current vectors, and D the difference of the currents in leg X of its pulses
 * + and - (the sum of both, as they flow in opposite directions):
 *   y = sum i e^{j g} = 3 I_2 e^{j 2 theta} + 3 B e^{-j theta}
 *   D = 6 B (cos x + r cos 3 x),  x = theta - g_X,  |x| <= 30 degrees or |x - 180| <= 30 degrees
 * The sign of D cos x is the polarity, and B, the saturation of first order, is what D says it is: it is taken
 * off y, three times, each with the angle that the one before has given. Without that up to 5 degrees remain
 * on IPM-1000. r, the third harmonic of the saturation, is 0.11 there and from -0.2 to 0.33 in general; as
 * cos 3 x is small where x is large, B errs by at most 0.25 of itself.
 *   margin of saliency = |y| / (2.1 i_noise)
 *   margin of polarity = (|D| - i_bridge / 2) / (1.4 i_noise)      i_bridge: of one pair of the three, pulses.h
 * D is that of one leg, and of a machine with L_q below L_d, whose q-axis is found, it is not zero. The sum of the first three
 * vectors is:
 *   w = 3/4 F^2 (b + c) e^{j theta}
 * It must lie within 45 degrees of the pole that D tells: else there is none.
 * Use as initial_pulses.h; the same reasons and peak. Duration: about 4 (2 n + 5) periods and 9 ms: 16 ms on IPM-1000. Movement:
 * 0.1 degrees mechanical with IPM-1000 and SPM-400, as two of the pulses have no opposite.
 * Tests: tests/unit/injection/four_pulses_test.cpp, tests/scenario/four_pulses.yaml. */
#ifndef INJECTION_FOUR_PULSES_H
#define INJECTION_FOUR_PULSES_H

#include "injection/pulses.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pulses_t train;
    uint16_t axis; /* nearest to the magnet's */
    pm_ab_t y;
    pm_q_t D;
} four_pulses_t;

void four_pulses_reset(four_pulses_t *self);
pm_procedure_t four_pulses_step(four_pulses_t *self, const pulses_config_t *config, pm_abc_t i,
                                pulses_out_t *out);
pm_procedure_t four_pulses_find(four_pulses_t *self, const pulses_config_t *config);

#ifdef __cplusplus
}
#endif

#endif
