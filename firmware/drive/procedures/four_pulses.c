/* The pulses of injection/four_pulses.h as an owner of the bridge. */
#include "firmware/drive/procedures/pulses.h"

void procedure_four_pulses_begin(drive_t *drive)
{
    (void)drive;
}

pm_procedure_t procedure_four_pulses_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    (void)in;
    pulses_out_t pulse;
    const pm_procedure_t result =
        four_pulses_step(&drive->procedure.four_pulses, &drive->config.pulses, drive->i_abc, &pulse);
    write_pulse(drive, &pulse, out);
    return result;
}

pm_procedure_t procedure_four_pulses_slow(drive_t *drive)
{
    if (drive->procedure.result != PM_DONE) {
        return drive->procedure.result;
    }
    four_pulses_t *self = &drive->procedure.four_pulses;
    const pm_procedure_t result = four_pulses_find(self, &drive->config.pulses);
    leave_position(drive, result, &self->train.found);
    return result;
}

void procedure_four_pulses_abort(drive_t *drive)
{
    (void)drive;
}
