/* Magnetic polarity by the second harmonic of the voltage at the neutral that a rotating carrier makes (METHODS.md 8.4.3,
 * row 97; METHODS-ADDENDUM.md Z11).
 *
 * On top of position control by injection with zero_rotating, at i_dq = 0. z of zero_second.h over a whole number of the
 * carrier's periods, in the direction in which the magnet's north would have it:
 *   r      = of_pole(theta^)
 *   x + jy = (z - of_either(theta^)) r* / |r|
 *   margin = (|mean x| - max(|r| / 2, |mean y|)) / sigma            polarity.h, of 8 values of 24 ms
 * x is |r| at the north and -|r| at the south, and y nothing. A linear machine leaves neither: it is half of what was found
 * that must be seen, and what stands across, which saturation does not make, counts against it. Compensation of dead time
 * by the mean current, which is zero, would only swing and is off meanwhile.
 *
 * 30 ms in which the carrier's answer settles, 192 ms. Peak current: the carrier's, no other; no movement. It is the
 * carrier that is weak or strong: 70 V at 250 Hz on IPM-1000 makes 17 to 34 mV at the neutral, 35 V at 500 Hz two.
 * PM_FAILED_POLARITY: below five sigma, as with a linear machine; PM_FAILED_NO_CURRENT: no answer of the carrier at the
 * neutral; PM_FAILED_SALIENCY: the frame has left its axis by 30 degrees. Nothing is done in the control period. Each
 * period of the carrier 2000 instructions with N = 40, each value 500, at 1 kHz. Tests: tests/unit/drive/polarity_test.cpp,
 * tests/scenario/polarity_zero_secondary.yaml. */
#ifndef DRIVE_PROCEDURES_SECONDARY_VOLTAGE_H
#define DRIVE_PROCEDURES_SECONDARY_VOLTAGE_H

#include "injection/polarity.h"
#include "injection/zero_second.h"

typedef struct {
    polarity_mean_t x, y; /* along the expected one, and across */
    pm_ab_t sum;          /* of z, in the present value */
    pm_q_t r;             /* |r| of the last value */
    pm_angle_t theta;     /* of the frame at first */
    uint16_t ms;
    uint8_t count; /* of sum */
} secondary_voltage_t;

#endif
