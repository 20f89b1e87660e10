/* What a drive does that has a second bridge: for an open winding (open_winding.h) or for two sets of windings (two_sets.h), as
 * the parameter `winding` says. Nothing in programs that do not carry NEEDS_BRIDGES. */
#ifndef DRIVE_SECOND_BRIDGE_H
#define DRIVE_SECOND_BRIDGE_H

#include "firmware/drive/drive.h"
#include "firmware/drive/position.h"

#ifdef __cplusplus
extern "C" {
#endif

#if PM_CARRIES(NEEDS_BRIDGES)
/* Currents of two sets: after those of the first bridge. */
void second_bridge_measure(drive_t *drive, const drive_in_t *in);

/* A period with control: v as modulator_step() takes it, and the current at k. */
void second_bridge_control(drive_t *drive, const position_out_t *frame, pm_ab_t v, pm_ab_t i_quarter,
                           drive_out_t *out);

/* One without, when the first bridge is known: ends of an open winding are tied to the negative rail, a second set is open but for
 * a short circuit on purpose. */
void second_bridge_without(drive_t *drive, drive_out_t *out);

#if PM_HAS(two_sets)
/* The voltage that acted on what the observer looks at: the mean of the sets, or the first one. */
pm_ab_t second_bridge_seen(const drive_t *drive);
#endif

void second_bridge_slow(drive_t *drive, pm_q_t omega);

#if PM_HAS(open_winding)
/* For 3 ms nothing explains the voltage of an open winding (open_winding.h). At 1 kHz while current is controlled. */
bool second_bridge_is_strained(drive_t *drive);
#endif

/* open_phase_slow() of either bridge; i without a carrier. */
bool second_bridge_has_open_phase(drive_t *drive, pm_q_t least, pm_ab_t wanted, pm_ab_t i);
#endif

#ifdef __cplusplus
}
#endif

#endif
