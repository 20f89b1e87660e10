/* Third harmonic of the EMF from the terminals alone, where no wire leads to the star point (METHODS.md 11.2.2, 11.3.2.2;
 * rows 123 and 126).
 *
 * The mean of the terminals against the negative rail less what the legs put there, n v_dc / 2 with n = 0, 1, 2 as both
 * driven legs are low, apart or high (zero_legs_t):
 *   e_0 = (v_A + v_B + v_C) / 3 - n v_dc / 2 = (f / 3) e        f = 3/2 for a sine, 1 for a trapezoid
 * e of the open leg: half of the sine's, a third of the trapezoid's about its crossing, upwards in even sectors,
 * downwards in odd ones.
 *
 * Envelope: the mean jumps by v_dc / 2 with every edge of the carrier. It is sampled once a period, late in the on or off
 * time as patterns.h says, and what is subtracted is that of the sample's own instant: the samples of on and off times join
 * to one signal, whose crossing lies between two of them with their instants (zero_crossing.h). No low-pass, no lag.
 *
 * Of the terminals only their mean is used. What it says of the open one, which rests at a rail while it freewheels, is
 *   v_open = 3 e_0 + n v_dc / 2
 * and goes into zero_crossing.h in its place, against n v_dc / 2 (ZERO_LINK). So a board may bring three equal resistors'
 * star to one channel and give its code for all three terminals. What it costs is the sum of three: against the open
 * terminal's, per volt of e, the noise of the channels counts 1.7 times, an error of v_dc's divider or of all three 3
 * times, and a diode that carries the off time, v_diode, 3 times.
 *
 * Q28 per-unit, within +-8. 8 instructions. Tests: tests/unit/bldc/virtual_third_test.cpp,
 * tests/scenario/six_step_virtual.yaml. */
#ifndef BLDC_VIRTUAL_THIRD_H
#define BLDC_VIRTUAL_THIRD_H

#include "bldc/zero_crossing.h"

/* v_open */
static inline pm_q_t virtual_third_terminal(const zero_sample_t *in, zero_legs_t legs)
{
    return in->v[0] + in->v[1] + in->v[2] - (int32_t)legs * in->v_dc;
}

#endif
