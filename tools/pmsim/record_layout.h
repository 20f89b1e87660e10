/* Where the drive's memory has what: the same on host and target, so that either can read the other's
 * drive_t. The recording carries the host's figures; tests/target/drive compares them with the target's. */
#ifndef PMSIM_RECORD_LAYOUT_H
#define PMSIM_RECORD_LAYOUT_H

#include <stddef.h>

#include "firmware/drive/drive_state.h"
#include "tools/pmsim/record.h"

/* Sizes of all that is passed or kept, and the place of the first, the last and one of each kind between. */
static inline void record_layout(uint32_t layout[RECORD_LAYOUT])
{
    const size_t here[RECORD_LAYOUT] = {
        sizeof(drive_t),
        sizeof(drive_config_t),
        sizeof(drive_command_t),
        sizeof(drive_status_t),
        sizeof(drive_fault_record_t),
        sizeof(position_t),
        DRIVE_IN_COMMON,
        DRIVE_OUT_COMMON,
        offsetof(drive_t, command),
        offsetof(drive_t, status),
        offsetof(drive_t, status.theta),
        offsetof(drive_t, record),
        offsetof(drive_t, fault),
        offsetof(drive_t, stage),
        offsetof(drive_t, zero),
        offsetof(drive_t, position.injection),
        offsetof(drive_t, position.quality),
        offsetof(drive_t, procedure.initial_pulses),
        offsetof(drive_t, procedure.identify.of),
        offsetof(drive_t, sequence.margin),
        offsetof(drive_t, beside),
        offsetof(drive_t, regulator),
        offsetof(drive_t, i_ref),
        offsetof(drive_t, config.injection),
        offsetof(drive_t, config.protection.lost_ms),
        offsetof(drive_t, agree_ms),
        offsetof(drive_t, temperature_dC),
    };
    for (size_t k = 0; k < RECORD_LAYOUT; k++) {
        layout[k] = (uint32_t)here[k];
    }
}

#endif
