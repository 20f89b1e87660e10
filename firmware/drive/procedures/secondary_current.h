/* Magnetic polarity by the second harmonic of the current that a sine along d makes (METHODS.md 8.4.1, 8.4.2,
 * row 96; METHODS-ADDENDUM.md E19).
 *
 * On top of position control by injection with pulsating_sine, at i_dq = 0. With i_d = psi / L_dh + b psi^2 / 2 and the
 * carrier's flux F cos(phi' - delta), phi' of injection/sine.h:
 *   i_d = h_d cos(phi' - delta) + b F^2 / 4 (1 + cos 2 (phi' - delta))
 * b > 0 where d is the magnet's north. The window of the source holds the last period of the carrier, N samples; each
 * that has nothing in common with the one before gives a value:
 *   x = 2/N sum i_d cos 2 (phi' - delta),   delta measured: arg of the answer along d (pulsating_sine.h)
 * Whole periods of the carrier, so that its answer and i_f are nulled. With a fixed delta = 0 the value is taken
 * 34 degrees beside its phase at 35 V and 500 Hz on IPM-1000.
 *   margin = (|mean x| - y' - 3/2 v_d' / V_h h_d - 1/1024 h_d) / sigma      polarity.h
 * y is the mean with the sine, v_d the mean voltage of current control, which counts (') where its sign is that of x.
 * Dead time may settle into an answer without symmetry: then, also without saturation, both half waves differ, current
 * control needs a voltage to keep the mean at zero, and there is a second harmonic of any phase: up to 0.0013 h_d with the
 * signs alike, 0.001 with opposite ones. What saturation makes has y opposite to x, and small: half of what resistance makes of
 * delta, 0.1 x. So y counts where it has the sign of x, else by what is beyond half of x, 27 degrees.
 * b F^2 / 4 is small: 0.6 mA at 35 V and 500 Hz, 11 mA at 70 V and 250 Hz, with sigma = 0.15 mA after 50 ms. While
 * the margin is below five sigma the number of values is doubled, up to 256 and as long as they take no more than 512 ms.
 *
 * 16 or 32 values, 64 ms; with too little margin up to 512 ms. Peak current: the carrier's, no other; no movement.
 * A v_injection below four times the dead-time voltage, T_dt f_pwm v_dc, is refused by name, and a carrier of less than 16
 * periods: its half waves differ by where the edges lie at which dead time takes. Of 1,200 random machines that do not
 * saturate, 1/1024 h_d left none above five sigma with 20 periods, 1/500 h_d of carriers with 10.
 * PM_FAILED_POLARITY: below five sigma, as with a linear machine; raise v_injection or lower f_injection:
 * F >= root(20 sigma / b). Nothing is done in the control period. Each value 700 instructions at 1 kHz.
 * Tests: tests/unit/drive/polarity_test.cpp, tests/scenario/polarity_secondary.yaml. */
#ifndef DRIVE_PROCEDURES_SECONDARY_CURRENT_H
#define DRIVE_PROCEDURES_SECONDARY_CURRENT_H

#include "injection/polarity.h"

typedef struct {
    polarity_mean_t x, beside; /* in phase with what saturation makes, and a quarter of a period before */
    polarity_mean_t v;         /* of current control, along d */
    pm_angle_t theta;          /* of the frame at first */
    uint16_t ms;
    uint16_t wanted; /* values */
} secondary_current_t;

#endif
