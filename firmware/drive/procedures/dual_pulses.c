/* The pulses of injection/dual_pulses.h as an owner of the bridge. */
#include "firmware/drive/procedures/pulses.h"
#include "firmware/math/trig.h"

#if PM_HAS(dual_pulses)

void procedure_dual_pulses_begin(drive_t *drive)
{
    (void)drive;
}

pm_procedure_t procedure_dual_pulses_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    (void)in;
    pulses_out_t pulse;
    const pm_procedure_t result = dual_pulses_step(&drive->procedure.dual_pulses, &drive->config.dual_pulses,
                                                   drive->i_ab, pm_dir(drive->sequence.theta), &pulse);
    write_pulse(drive, &pulse, out);
    return result;
}

pm_procedure_t procedure_dual_pulses_slow(drive_t *drive)
{
    if (drive->procedure.result != PM_DONE) {
        return drive->procedure.result;
    }
    dual_pulses_t *self = &drive->procedure.dual_pulses;
    const pm_procedure_t result = dual_pulses_find(self, &drive->config.dual_pulses);
    drive->sequence.margin = self->margin;
    if (result == PM_DONE) {
        drive->sequence.theta += self->north ? 0U : PM_TURN(0.5);
    }
    return result;
}

void procedure_dual_pulses_abort(drive_t *drive)
{
    (void)drive;
}

#endif
