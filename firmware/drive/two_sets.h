/* Two sets of three windings, the second 30 degrees on, with separate star points and a bridge each (METHODS.md 7.2;
 * rows 81, 85, 86).
 *
 *   set 1   A, B, C at 0, 120, 240 degrees        set 2   X, Y, Z at 30, 150, 270
 * In the axes of the machine, with the currents of a set as a vector there, i_2 = (X, Y, Z) e^{j 30},
 *   i = (i_1 + i_2) / 2     makes flux and torque: to it the machine is one of L_d + M_d, L_q + M_q, R, psi_m, whose torque is that
 *                           of both sets. These are the drive's L_d and L_q, and all that the drive does, it does with them
 *   z = (i_1 - i_2) / 2     makes none: L_d - M_d, L_q - M_q and R. Fifth and seventh harmonics of the EMF drive it, and what
 *                           is unlike of the bridges; it is held at zero by PI in the same frame (synchronous_pi.h), within
 *                           an eighth of v_dc
 *   v_1 = v + v_z,  v_2 = (v - v_z) e^{-j 30}
 * Each leg's dead time is given back by its own current. A carrier is added to both sets.
 *
 * Currents of all six legs by sensors in the lines; each set must have a sum of zero, and no leg more than i_trip. Not with pulses,
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
    synchronous_pi_config_t regulator; /* of z */
} two_sets_config_t;

typedef struct {
    pm_q_t zero[PM_LEGS]; /* as drive->zero, of the second bridge */
    neutral_t neutral;    /* of its star */
    pm_abc_t i;           /* its currents */
    pm_ab_t z;
    synchronous_pi_t regulator;
} two_sets_t;

typedef struct {
    pm_ab_t v;           /* wanted over [k+1, k+2) */
    pm_ab_t i_quarter;   /* i expected there */
    pm_half_dir_t ahead; /* direction of the frame in its middle */
    pm_q_t omega;
    pm_q_t v_dc;
} two_sets_in_t;

#if PM_HAS(two_sets)
/* Before the first step with control; the zeros stay. */
void two_sets_reset(two_sets_t *self, const two_sets_config_t *config);

/* The mean of i_1 and of the currents with these codes. */
pm_ab_t two_sets_measure(two_sets_t *self, const uint16_t code[PM_LEGS], pm_ab_t i_1);

void two_sets_step(two_sets_t *self, const two_sets_config_t *config, modulator_t *modulator,
                   const modulator_config_t *modulator_config, const two_sets_in_t *in, bridges_t *out);

void make_two_sets(maker_t *m, two_sets_config_t *c);
#endif

#ifdef __cplusplus
}
#endif

#endif
