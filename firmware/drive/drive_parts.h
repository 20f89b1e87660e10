/* What the parts of the drive ask of each other; not for users of drive.h. */
#ifndef DRIVE_DRIVE_PARTS_H
#define DRIVE_DRIVE_PARTS_H

#include "firmware/drive/drive_state.h"

/* protection.c */

void protection_step(drive_t *drive, const drive_in_t *in); /* each period: currents, DC link, break input */
void protection_slow(drive_t *drive); /* 1 kHz: temperature, speed, position, stall, sum */

bool protection_cause_present(const drive_t *drive); /* of the faults that show with the bridge off */

/* Limits of the q-axis current after derating, for the present direction of rotation. */
void protection_current_limits(drive_t *drive, pm_q_t *i_min, pm_q_t *i_max);

/* reference.c: at 1 kHz, from the command to current references. */
void reference_take(drive_t *drive);   /* command to per-unit */
void reference_vector(drive_t *drive); /* speed or torque -> i_ref */
void reference_reset(drive_t *drive, pm_q_t i_q);

/* open_loop.c: align, open-loop start, current mode, hand-over to the observer and back. */
void open_loop_start(drive_t *drive);
void open_loop_slow(drive_t *drive);
void open_loop_resume(drive_t *drive);

#endif
