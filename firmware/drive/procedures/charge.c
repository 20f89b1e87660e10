#include "firmware/drive/drive_parts.h"

void procedure_charge_begin(drive_t *drive)
{
    (void)drive;
}

pm_procedure_t procedure_charge_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    (void)in;
    charge_t *self = &drive->procedure.charge;
    if (self->count >= drive->config.charge_periods) {
        out->legs = PM_LEGS_OFF;
        return PM_DONE;
    }
    self->count++;
    for (uint32_t x = 0; x < DRIVE_LEGS; x++) {
        pm_write_leg(out->compare[x], 0);
    }
    out->legs = PM_LEGS_PWM;
    return PM_RUNNING;
}

pm_procedure_t procedure_charge_slow(drive_t *drive)
{
    return drive->procedure.result;
}

void procedure_charge_abort(drive_t *drive)
{
    (void)drive;
}
