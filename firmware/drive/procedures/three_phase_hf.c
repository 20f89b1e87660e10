/* The rotating voltage of injection/three_phase_hf.h as an owner of the bridge. */
#include "firmware/drive/procedures/pulses.h"
#include "firmware/math/compiler.h"

#if PM_HAS(three_phase_hf)

void procedure_three_phase_hf_begin(drive_t *drive)
{
    (void)drive;
}

pm_procedure_t procedure_three_phase_hf_step(drive_t *drive, const drive_in_t *in, drive_out_t *out)
{
    (void)in;
    pulses_out_t legs;
    const pm_procedure_t result = three_phase_hf_step(&drive->procedure.three_phase_hf,
                                                      &drive->config.three_phase_hf, drive->i_abc, &legs);
    write_pulse(drive, &legs, out);
    return result;
}

PM_APART pm_procedure_t procedure_three_phase_hf_slow(drive_t *drive)
{
    three_phase_hf_t *self = &drive->procedure.three_phase_hf;
    three_phase_hf_slow(self);
    if (drive->procedure.result != PM_DONE) {
        return drive->procedure.result;
    }
    const pm_procedure_t result = three_phase_hf_find(self, &drive->config.three_phase_hf);
    leave_position(drive, result, &self->found);
    return result;
}

void procedure_three_phase_hf_abort(drive_t *drive)
{
    (void)drive;
}

#endif
