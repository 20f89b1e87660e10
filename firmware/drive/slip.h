/* Slips of the position: a low-speed source that speaks of twice or three times the angle cannot tell half a turn or a
 * third from none (traits SOURCE_HALF_TURN and SOURCE_THIRD_TURN of its row). What can is the EMF, from the speed on at
 * which an observer could lead (METHODS.md 5.9, 8.1, 11.3.3):
 *   e_d = v_d - R i_d + omega L_q i_q
 *   e_q = v_q - R i_q - omega L_d i_d
 * With the rotor ahead of the estimate by delta:
 *   along  =  e_q sgn(omega) = |omega| psi_m cos(delta)
 *   across = -e_d sgn(omega) = |omega| psi_m sin(delta)
 * A slip is what stays beyond the middle between two answers of the source, with a margin, for 20 ms:
 *   of half a turn    along < -1/2 |omega| psi_m
 *   of a third        along <  1/4 |omega| psi_m, and the sign of `across` says which way
 * An EMF that agrees, along > 1/2 |omega| psi_m, is counted in the same way: to a start that still looks for the pole it tells
 * that (torque_polarity.h).
 *
 * A rotor that has run away from its source turns in the estimated frame, and so does its EMF:
 *   |e_d| + |e_q| > 3 omega_most psi_m + 0.4 R (|i_d| + |i_q|)
 * where one that the source follows has at most the root of 2 of omega_most psi_m. The beat of the two speeds hides it now and
 * then; what counts is the mean (position.h).
 *
 * L di/dt is left out: it passes within the 20 ms. Where |omega| psi_m < 0.4 R i, R 20 % off could count as a slip:
 * nothing is judged there.
 *
 * slip_slow() at 1 kHz while the source leads or shares the lead; no division. State 8 bytes.
 * Tests: tests/unit/drive/slip_test.cpp, tests/scenario/slip.yaml. */
#ifndef DRIVE_SLIP_H
#define DRIVE_SLIP_H

#include "firmware/math/estimate.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SLIP_MS   20U
#define SLIP_MOST 3U /* resolved in one run; with another the position is lost */

/* Of the machine, per-unit. */
typedef struct {
    pm_q_t R_s, psi_m, L_d, L_q;
} pm_machine_t;

typedef struct {
    uint32_t traits;    /* of the low-speed source */
    pm_q_t omega_least; /* from where the EMF is a witness */
    pm_q_t omega_most;  /* up to where the source has a part in the lead */
    pm_q_t omega;       /* electrical */
    pm_dq_t v;          /* mean voltage of the period, Q28, and ... */
    pm_dq_t i;          /* ... current, both in the estimated frame */
} slip_in_t;

typedef struct {
    pm_q_t across;     /* filtered */
    uint16_t ms;       /* that it has lasted */
    uint8_t count;     /* resolved since slip_reset() */
    uint8_t agrees_ms; /* so long the EMF has been that of the estimate, at most SLIP_MS */
} slip_t;

void slip_reset(slip_t *self);

/* What is to be added to the estimated angle: 0, half a turn, or a third either way. *away: the rotor turns faster than the source
 * can lead. */
pm_angle_t slip_slow(slip_t *self, const pm_machine_t *machine, const slip_in_t *in, bool *away);

#ifdef __cplusplus
}
#endif

#endif
