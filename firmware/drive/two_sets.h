/* Two sets of three windings, the second 30 degrees on, with separate star points and a bridge each (METHODS.md 7.2;
 * rows 81, 82, 85 to 87).
 *
 *   set 1   A, B, C at 0, 120, 240 degrees        set 2   X, Y, Z at 30, 150, 270
 * In the axes of the machine, with the currents of a set as a vector there, i_2 = (X, Y, Z) e^{j 30},
 *   i = (i_1 + i_2) / 2     makes flux and torque: to it the machine is one of L_d + M_d, L_q + M_q, R, psi_m, whose torque is that
 *                           of both sets. These are the drive's L_d and L_q, and all that the drive does, it does with them
 *   z = (i_1 - i_2) / 2     makes none: L_d - M_d, L_q - M_q and R. Fifth and seventh harmonics of the EMF drive it, and what
 *                           is unlike of the bridges; it is held at zero by PI in the same frame (synchronous_pi.h), within
 *                           an eighth of v_dc
 *   v_1 = v + v_z
 *   v_2 = (v - v_z) e^{-j 30}
 * Each leg's dead time is given back by its own current. A carrier is added to both sets.
 *
 * neutral_channel 1: one channel between the star points, no resistors,
 *   v_N1 - v_N2 = (v_S1 - v_S2) - (v_01 - v_02),   v_S: mean of a set's terminals
 * so both sets are modulated without a common part, v_S1 = v_S2, which leaves half of v_dc in place of v_dc / sqrt(3). Injection 12
 * and 13 need no more than the difference; what dead time leaves of the common part moves them.
 *
 * The first set alone is seen by what its equation has more than that of the mean,
 *   v_z - R z - (L_q - M_q) p z
 * none where these are right; with a current that the sets have apart on purpose it tells an observer what is wrong of them.
 *
 * Currents of all six legs by sensors in the lines; each set must have a sum of zero, no leg more than i_trip, and
 * each leg the current that is wanted of its set (open_phase.h): with one open the other set goes on turning the
 * motor. A start is an align, and injection follows it where there is saliency (start_method 0, 3). Not with pulses,
 * flying start, identification, regulators of switch states, block commutation or a carrier at a star point: refused.
 *
 * modulator_step() and the regulator run twice. State 60 bytes. Tests: tests/unit/drive/two_sets_test.cpp,
 * tests/scenario/two_sets.yaml. */
#ifndef DRIVE_TWO_SETS_H
#define DRIVE_TWO_SETS_H

#include "firmware/control/synchronous_pi.h"
#include "firmware/drive/bridges.h"
#include "firmware/drive/neutral.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    bool between;                      /* neutral_channel 1 */
    pm_q_t R;                          /* half of it, per-unit */
    int32_t L;                         /* (L_q - M_q) / T of a set: bridges.h */
    synchronous_pi_config_t regulator; /* of z, ... */
    synchronous_pi_config_t slowed;    /* ... while a carrier sets the sets apart: an eighth as fast */
} two_sets_config_t;

typedef struct {
    pm_q_t zero[PM_LEGS]; /* as drive->zero, of the second bridge */
    neutral_t neutral;    /* of its star */
    pm_abc_t i;           /* its currents */
    pm_ab_t z, before;    /* at k and k-1 */
    pm_ab_t v_acting;     /* v_z over [k-1, k), ... */
    pm_ab_t v_next;       /* ... and over [k, k+1) */
    synchronous_pi_t regulator;
} two_sets_t;

typedef struct {
    pm_ab_t v;           /* wanted over [k+1, k+2) */
    pm_ab_t i_quarter;   /* i expected there */
    pm_ab_t apart;       /* what the second set is given beside v, of a carrier */
    pm_half_dir_t ahead; /* direction of the frame in its middle */
    pm_q_t omega;
    pm_q_t v_dc;
    pm_q_t z_q; /* wanted of z along q (observers/mismatch.h) */
} two_sets_in_t;

#if PM_HAS(two_sets)
/* Before the first step with control; the zeros stay. */
void two_sets_reset(two_sets_t *self, const two_sets_config_t *config);

/* In the axes of the second set. */
pm_ab_t two_sets_backwards(pm_ab_t x);

/* The mean of i_1 and of the currents with these codes. */
pm_ab_t two_sets_measure(two_sets_t *self, const uint16_t code[PM_LEGS], pm_ab_t i_1);

void two_sets_step(two_sets_t *self, const two_sets_config_t *config, modulator_t *modulator,
                   const modulator_config_t *modulator_config, const two_sets_in_t *in, bridges_t *out);

/* Of v_z over [k-1, k), what R, L_q - M_q and z do not explain: an observer to which it is added to the voltage of the mean sees the
 * first set. */
pm_ab_t two_sets_unexplained(const two_sets_t *self, const two_sets_config_t *config);

void make_two_sets(maker_t *m, two_sets_config_t *c);
#endif

#ifdef __cplusplus
}
#endif

#endif
