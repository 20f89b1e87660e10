/* The drive inside the rig on the host, for tools that look at what an observer saw: tools/ekf_tune, the
 * tuning of the Kalman filters (METHODS.md 12.4.5, row 144). */
#ifndef PMSIM_RIG_DRIVE_H
#define PMSIM_RIG_DRIVE_H

#include "firmware/drive/drive_state.h"
#include "tools/pmsim/rig.h"

const drive_t *rig_drive(const rig_t *rig);

#endif
