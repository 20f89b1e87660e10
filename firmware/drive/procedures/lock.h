/* Injection locks onto the saliency of a rotor at rest, whose position is not known: the angle but for its pole
 * (METHODS.md 8.1).
 *
 * A loop that begins anywhere may stay where the answer is zero and unstable, at 90 degrees. So the estimated frame
 * stands still at two angles, 45 degrees apart, with the carrier along its d-axis, and the error signals of both give
 * the angle at once:
 *   eps_0 = A sin 2 theta,  eps_1 = -A cos 2 theta,   theta = 1/2 atan2(eps_0, -eps_1)
 *   margin = root(eps_0^2 + eps_1^2) / sigma, sigma from the spread of both
 * Then the loop is closed there, and position control of the drive goes on from it.
 *
 * Each look 24 ms, of which the first 16 for transients; closed loop 40 ms: 90 ms. No current but the carrier's; no
 * movement. PM_FAILED_SALIENCY: the answer is below five sigma or two fifths of what the machine's data promise, so that
 * load may take all of it, or the closed loop turns as fast as half of speed_trip, as one that nothing holds;
 * PM_FAILED_NO_CURRENT: the carrier's own current is, at both angles. 45 degrees apart, one of them shows more than a
 * quarter up to L_q = 7 L_d.
 * Sources whose carrier stands in the stator are refused: these detect I_p first, at a known angle.
 * Tests: tests/unit/drive/polarity_test.cpp, tests/scenario/polarity_d_current.yaml. */
#ifndef DRIVE_PROCEDURES_LOCK_H
#define DRIVE_PROCEDURES_LOCK_H

#include "injection/polarity.h"

typedef struct {
    polarity_mean_t look[2];
    uint16_t ms, looks; /* of this look, and how many have been before it */
    pm_q_t misfit;      /* of the source, the greater of the looks' */
} lock_t;

#define LOCK_LOOKS 2U

/* The loop is open: nothing is known of the angle. */
static inline bool lock_looks(const lock_t *self)
{
    return self->looks < LOCK_LOOKS;
}

#endif
