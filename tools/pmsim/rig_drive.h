/* The drive inside the rig on the host, for tools that look at what an observer saw. */
#ifndef PMSIM_RIG_DRIVE_H
#define PMSIM_RIG_DRIVE_H

#include "firmware/drive/drive_state.h"
#include "tools/pmsim/rig.h"

const drive_t *rig_drive(const rig_t *rig);

#endif
