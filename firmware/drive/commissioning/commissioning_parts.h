/* Interface between the parts of the identification. */
#ifndef DRIVE_COMMISSIONING_COMMISSIONING_PARTS_H
#define DRIVE_COMMISSIONING_COMMISSIONING_PARTS_H

#include "firmware/drive/drive_parts.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What a period does with the bridge. */
enum { KIND_VOLTAGE, KIND_CURRENT, KIND_SQUARE }; /* the first to begin with */

/* bridge.c */
void commissioning_start_current(drive_t *drive); /* current control in the frame of theta_open */
void commissioning_set_gains(drive_t *drive);     /* by R and L_d */
void commissioning_clear_sums(identify_t *self);
void commissioning_write_legs(drive_t *drive, int32_t rest[3], pm_abc_t u, drive_out_t *out);
pm_q_t commissioning_mean(const identify_t *self, uint32_t n); /* of sum n over the samples */

/* square.c: one period of the square wave. Sums, s the sign of the voltage, w = v_d - R i_d - lost:
 *   SUM_CURRENT   s i            i: mean of the currents at both ends of the period
 *   SUM_CHANGE    s di           di: their difference
 * and for the other axis, x = i_q di_q:
 *   SUM_D_FLUX    w x            per T_s
 *   SUM_D_CHANGE  di_d x
 *   SUM_SQUARE    x x */
enum { SQUARE_WAITS, SQUARE_SEEKS, SQUARE_MEASURES, SQUARE_DONE, SQUARE_FAILED };
#define SQUARE_LONGEST 256U /* periods of half a wave */
enum { SUM_CURRENT, SUM_CHANGE, SUM_D_FLUX, SUM_D_CHANGE, SUM_SQUARE };
void square_step(drive_t *drive, pm_ab_t v_past);

/* Result of one millisecond of a phase. */
typedef struct {
    bool done;
    commissioning_reason_t failed;
} phase_result_t;

/* resistance.c */
void sweep_enter(drive_t *drive);
phase_result_t sweep_slow(drive_t *drive);
void levels_enter(drive_t *drive);
phase_result_t levels_slow(drive_t *drive);

/* inductance.c */
void inductance_enter(drive_t *drive, bool on_q, bool rated);
phase_result_t inductance_slow(drive_t *drive, bool on_q, bool rated);
pm_q_t commissioning_best_i_d(const drive_t *drive, pm_q_t i_q); /* of most torque per ampere */

/* rotation.c */
void rotation_enter(drive_t *drive);
phase_result_t rotation_up(drive_t *drive);
phase_result_t rotation_full(drive_t *drive);
phase_result_t rotation_less(drive_t *drive);
phase_result_t rotation_down(drive_t *drive);

/* hold.c: the voltage v that keeps the mean current i, stationary frame, at `ref`; 1 kHz. R and L_d as found, else as told. */
void commissioning_hold(drive_t *drive, commissioning_hold_t *self, pm_ab_t ref, pm_dq_t i, pm_q_t omega);

/* The current of the test; a period in radians of the base speed. */
pm_q_t commissioning_current(const drive_t *drive);
pm_q_t commissioning_period(const drive_t *drive);

#ifdef __cplusplus
}
#endif

#endif
