/* A wire or a switch that does not conduct, by which legs the current flows through. Each millisecond, a leg in which
 * more than 0.7 of the wanted current's amplitude is wanted, in either direction, must carry more than a quarter of the
 * amplitude that flows: not in size, which the link may not have the voltage for, but in direction. Of a leg that
 * conducts, 45 degrees to either side of its axis, that fails beyond an error of the current's direction of 30 degrees.
 * A leg with less is missed; 12 ms of it in one direction are open. Each in which the leg carries that much in that
 * direction takes 2 back, wanted or not, and so does each in which it is wanted there and carries anything.
 *
 * least: the square of i_rated / 64, of 8 i_noise, or of twice the zone in which dead time holds a current at zero
 * (modulator.h), whichever is more. With a carrier also of what current control lets through of the voltage that dead time
 * takes, as its sign follows that of the carrier faster than the integral does:
 *   t_dead f_pwm v_dc / (2 pi f_current L_d)
 * Nothing is said where less flows, or less is wanted, or not half of what flows: it is
 * not of this control then. With a wire off, A sin(delta) flows of A that is wanted delta beside the leg. So a wire is
 * found within a quarter of an electrical turn and 0.1 s from four times the least on, and later below and where turns
 * beat with 1 kHz, unless the position is lost before, which is a fault too. A switch is found once its direction is
 * wanted; later where speed control goes round it: at light load and speed a leg that cannot drive current into the
 * motor is asked to take it.
 * With two wires off nothing flows, of which nothing is said: the observer loses the position.
 *
 * open_phase_slow() at 1 kHz while current is controlled in a frame. No division. State 6 bytes.
 * Tests: tests/unit/drive/open_phase_test.cpp, tests/scenario/fault_open_phase.yaml. */
#ifndef DRIVE_OPEN_PHASE_H
#define DRIVE_OPEN_PHASE_H

#include <stdbool.h>

#include "firmware/math/frames.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OPEN_PHASE_MS 12U /* in which one has been missed */

typedef struct {
    uint8_t missed[3][2]; /* ms, of each leg: wanted into the motor and out of it */
} open_phase_t;

void open_phase_reset(open_phase_t *self);

/* True: one does not conduct. least: of the square of the current; i_zero: what all three carry beside i, none in a star. */
bool open_phase_slow(open_phase_t *self, pm_q_t least, pm_ab_t wanted, pm_ab_t i, pm_q_t i_zero);

#ifdef __cplusplus
}
#endif

#endif
