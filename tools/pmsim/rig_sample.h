/* From the drive's per-unit status to SI, with the drive's own bases: for every rig. */
#ifndef PMSIM_RIG_SAMPLE_H
#define PMSIM_RIG_SAMPLE_H

#include "firmware/drive/drive_state.h"
#include "tools/pmsim/rig.h"

typedef struct {
    double v_V, i_A, omega_mech; /* SI value of one step of a signal */
    double psi_Wb, torque_Nm, J_kgm2;
    uint32_t fault_seen; /* period of the last fault that the status has shown */
} rig_scale_t;

rig_scale_t rig_scale(const drive_base_t *base, int32_t pole_pairs, uint32_t slow_divider);

/* sample->truth stands; everything else follows. */
void rig_fill_sample(rig_scale_t *scale, const drive_t *drive, const drive_out_t *out, rig_sample_t *sample);

drive_command_t rig_drive_command(const rig_command_t *command);

int32_t rig_whole(double value); /* nearest, half away from zero; saturates */

/* The legs of a record, from what went into and came out of the drive. */
void rig_record_legs(const drive_in_t *in, const drive_out_t *out, record_period_t *record);

#endif
