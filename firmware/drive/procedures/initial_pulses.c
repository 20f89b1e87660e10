/* The pulses of injection/initial_pulses.h as an owner of the bridge. */
#include "firmware/drive/drive_parts.h"

void procedure_initial_pulses_begin(drive_t *drive)
{
    (void)drive;
}

pm_procedure_t procedure_initial_pulses_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    (void)in;
    initial_pulses_t *self = &drive->procedure.initial_pulses;
    const drive_config_t *c = &drive->config;
    initial_pulses_out_t pulse;
    const pm_procedure_t result = initial_pulses_step(self, &c->pulses, drive->i_ab, &pulse);
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        const int32_t on = pm_mulh(pulse.duty[x], pm_shl(c->modulator.counts, 32 - PM_Q_BITS));
        drive_write_leg(out->compare[x], on);
    }
    out->legs = pulse.driven ? PM_LEGS_PWM : PM_LEGS_OFF;
    return result;
}

pm_procedure_t procedure_initial_pulses_slow(drive_t *drive)
{
    const initial_pulses_t *self = &drive->procedure.initial_pulses;
    if (drive->procedure.result == PM_DONE) {
        drive->sequence.theta = self->theta;
        drive->sequence.margin = initial_pulses_margin(self, &drive->config.pulses);
    }
    return drive->procedure.result;
}

void procedure_initial_pulses_abort(drive_t *drive)
{
    (void)drive;
}
