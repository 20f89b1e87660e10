/* What a drive keeps whose current control holds the legs in a switch state over each period (METHODS.md 12.5.2). What acts
 * then is the voltage of the state less what its edges miss by dead time (modulator_edges()), with the currents at the period's
 * beginning, where the legs change; and for those who read the voltage of the current control at 1 kHz it is the mean of the states.
 *
 * State 12 bytes; nothing in programs without such a regulator. Some 100 instructions a period where legs change.
 * Tests: tests/scenario/twin_current_sine_edges.yaml, held_open_loop.yaml, held_stall.yaml. */
#ifndef DRIVE_HELD_H
#define DRIVE_HELD_H

#include "firmware/control/regulation.h"
#include "firmware/drive/drive.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_dq_t v;       /* mean over some 64 periods, Q22 */
    uint16_t before; /* states of the period that has ended, ... */
    uint16_t acting; /* ... and of the one that begins; 0: not held */
} held_t;

/* A period in which drive->voltage is of a state, before v_next is set. */
void held_step(drive_t *drive);

/* A period without control. */
void held_end(held_t *self);

#ifdef __cplusplus
}
#endif

#endif
