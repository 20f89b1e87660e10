/* A phase or a switch that does not conduct, by what control asks of each leg and what flows. Of each leg and each
 * direction of the current that is wanted, at 1 kHz through a low-pass of 32 ms:
 *   missed = LP(w (3/4 w - i))      w: the current that is wanted of the leg, i: what is measured
 * A leg that conducts has i = w but for what control lags behind: missed is -1/4 of the mean of w^2. One that does not has
 * 3/4 of it; noise is not like w and cancels. A wire that is off is missed in both directions, a switch in one, as far as
 * the diodes do not conduct in its place. It counts in milliseconds in which that direction is wanted, while `missed` is
 * more than `least`.
 *
 * least: (i_rated / 128)^2 and the square of i_noise, so that a current of 2 % of the rated one is judged. A wire is
 * found within 0.1 s. A switch is found once its direction is wanted, which takes up to half a turn, and not while
 * speed control goes round it: at light load and speed a leg that cannot drive current into the motor is asked to take it.
 *
 * open_phase_slow() at 1 kHz while current is controlled in a frame. No division. State 28 bytes.
 * Tests: tests/unit/drive/open_phase_test.cpp, tests/scenario/fault_open_phase.yaml. */
#ifndef DRIVE_OPEN_PHASE_H
#define DRIVE_OPEN_PHASE_H

#include <stdbool.h>

#include "firmware/math/frames.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OPEN_PHASE_MS 16U /* in which one has been missed */

typedef struct {
    pm_q_t missed[3][2]; /* of each leg, wanted into the motor and out of it */
    uint16_t ms;
} open_phase_t;

void open_phase_reset(open_phase_t *self);

/* True: one does not conduct. */
bool open_phase_slow(open_phase_t *self, pm_q_t least, pm_ab_t wanted, pm_ab_t i);

#ifdef __cplusplus
}
#endif

#endif
