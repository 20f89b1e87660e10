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
 * L di/dt is left out: it passes within the 20 ms. R i_max 20 % off does not count as a slip where
 * |omega| psi_m > 0.4 R i_max.
 *
 * slip_slow() at 1 kHz while the source leads or shares the lead; no division. State 10 bytes.
 * Tests: tests/unit/drive/slip_test.cpp, tests/scenario/slip.yaml. */
#ifndef DRIVE_SLIP_H
#define DRIVE_SLIP_H

#include "firmware/math/estimate.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SLIP_MS   20U
#define SLIP_MOST 3U /* resolved in one run; with another the position is lost */

typedef struct {
    pm_q_t R, L_d, L_q, psi_m; /* per-unit, of the machine */
    pm_q_t omega_least;        /* electrical speed from which the EMF is a witness */
    uint32_t traits;           /* of the low-speed source */
} slip_config_t;

typedef struct {
    pm_q_t across; /* filtered */
    uint16_t ms;   /* that it has lasted */
    uint8_t count; /* resolved since slip_reset() */
} slip_t;

void slip_reset(slip_t *self);

/* What is to be added to the estimated angle: 0, half a turn, or a third either way. v is the mean voltage of the
 * period (Q28), i the current, both in the estimated frame. */
pm_angle_t slip_slow(slip_t *self, const slip_config_t *config, pm_dq_t v, pm_dq_t i, pm_q_t omega);

#ifdef __cplusplus
}
#endif

#endif
