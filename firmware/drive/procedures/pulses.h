/* What the procedures that find the position by pulses share. */
#ifndef DRIVE_PROCEDURES_PULSES_H
#define DRIVE_PROCEDURES_PULSES_H

#include "firmware/drive/drive_parts.h"

static inline void write_pulse(drive_t *drive, const pulses_out_t *pulse, drive_out_t *out)
{
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        const int32_t on = pm_mulh(pulse->duty[x], pm_shl(drive->config.modulator.counts, 32 - PM_Q_BITS));
        drive_write_leg(out->compare[x], on);
    }
    out->legs = pulse->driven ? PM_LEGS_PWM : PM_LEGS_OFF;
    if (!pulse->driven) { /* what flows through an upper diode is not seen below the low switch */
        drive->completed = drive->period + 1U;
    }
}

static inline void leave_position(drive_t *drive, pm_procedure_t result, const pulses_found_t *found)
{
    if (result == PM_DONE) {
        drive->sequence.theta = found->theta;
        drive->sequence.margin = found->margin;
    }
}

#endif
