#include "firmware/drive/drive_parts.h"

void procedure_align_begin(drive_t *drive)
{
    drive->beside.align.ms = 0;
    open_loop_start(drive);
}

/* Its last millisecond is the first of the open-loop start. */
pm_procedure_t procedure_align_slow(drive_t *drive)
{
    align_t *self = &drive->beside.align;
    const open_loop_config_t *c = &drive->config.open_loop;
    self->ms++;
    if (self->ms >= c->align_ms) {
        open_loop_rested(drive);
        open_loop_slow(drive);
        drive->sequence.theta = drive->theta_open;
        return PM_DONE;
    }
    open_loop_hold(drive);
    if (2U * self->ms <= c->align_ms) {
        drive->theta_open += c->sweep;
    } else {
        follow_rest(&drive->follow, pm_narrow_sat(drive->voltage.v.d));
    }
    return PM_RUNNING;
}

void procedure_align_abort(drive_t *drive)
{
    (void)drive;
}
