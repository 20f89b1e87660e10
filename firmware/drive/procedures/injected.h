/* What the procedures share that run on top of position control by injection. */
#ifndef DRIVE_PROCEDURES_INJECTED_H
#define DRIVE_PROCEDURES_INJECTED_H

#include "firmware/drive/drive_parts.h"

#define INJECT_STAYS PM_TURN(1.0 / 12)

/* The frame is where it was: a rotor at rest has not turned, and injection has not left it for another axis. */
static inline bool inject_stays(const drive_t *drive, pm_angle_t theta)
{
    return pm_abs(pm_angle_diff(drive->position.pll.theta, theta)) < (int32_t)INJECT_STAYS;
}

/* d of the estimated frame is the magnet's north or its south. */
static inline void leave_polarity(drive_t *drive, pm_sigma_t margin, bool north)
{
    drive->sequence.theta = drive->position.pll.theta + (north ? 0U : PM_TURN(0.5));
    drive->sequence.margin = margin;
}

#endif
