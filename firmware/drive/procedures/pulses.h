/* What the procedures that find the position by pulses share, and each of them but for what it calls. */
#ifndef DRIVE_PROCEDURES_PULSES_H
#define DRIVE_PROCEDURES_PULSES_H

#include "firmware/drive/drive_parts.h"

static inline void write_pulse(drive_t *drive, const pulses_out_t *pulse, drive_out_t *out)
{
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        const int32_t on = pm_mulh(pulse->duty[x], pm_shl(drive->config.modulator.counts, 32 - PM_Q_BITS));
        pm_write_leg(out->compare[x], on);
    }
    out->legs = pulse->driven ? PM_LEGS_PWM : PM_LEGS_OFF;
    if (!pulse->driven) { /* what flows through an upper diode is not seen below the low switch */
        drive->completed = drive->period + 1U;
    }
}

static inline void leave_position(drive_t *drive, pm_procedure_t result, const pulses_found_t *found)
{
    if (result == PM_DONE || (SEQUENCE_HAS_POLARITY != 0 && result == PM_FAILED_POLARITY)) {
        /* another step may find the pole */
        drive->sequence.theta = found->theta;
        drive->sequence.margin = found->margin;
    }
}

/* The four functions of procedure.h for the pulses of injection/<name>.h. step and find are calls, of `self`, the
 * method's state, `config`, that of the drive, `pulse`, what the legs do next, and `found` the place of the result. */
#define PULSES_PROCEDURE(name, step, find, found)                                                            \
    void procedure_##name##_begin(drive_t *drive)                                                            \
    {                                                                                                        \
        (void)drive;                                                                                         \
    }                                                                                                        \
    PM_RARE pm_procedure_t procedure_##name##_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)   \
    {                                                                                                        \
        name##_t *self = &drive->procedure.name;                                                             \
        const drive_config_t *config = &drive->config;                                                       \
        pulses_out_t pulse;                                                                                  \
        (void)in;                                                                                            \
        const pm_procedure_t result = (step);                                                                \
        write_pulse(drive, &pulse, out);                                                                     \
        return result;                                                                                       \
    }                                                                                                        \
    pm_procedure_t procedure_##name##_slow(drive_t *drive)                                                   \
    {                                                                                                        \
        name##_t *self = &drive->procedure.name;                                                             \
        const drive_config_t *config = &drive->config;                                                       \
        if (drive->procedure.result != PM_DONE) {                                                            \
            return drive->procedure.result;                                                                  \
        }                                                                                                    \
        const pm_procedure_t result = (find);                                                                \
        leave_position(drive, result, &(found));                                                             \
        return result;                                                                                       \
    }                                                                                                        \
    void procedure_##name##_abort(drive_t *drive)                                                            \
    {                                                                                                        \
        (void)drive;                                                                                         \
    }

#endif
