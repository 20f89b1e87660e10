/* A winding with both ends on a bridge: two bridges on one link and one carrier (METHODS.md 7.3, rows 89 to 92).
 *
 *   v   = v_1 - v_2
 *   v_1 = v / sqrt(3) e^{j 30}
 *   v_2 = v / sqrt(3) e^{j 150}
 * Both have the same legs in another order, so that at each instant as many are high on one side as on the other, and what all
 * phases have in common, v_0, is none; |v| goes up to v_dc, sqrt(3) times that of a star. v_0 is made on purpose by half of it on
 * the legs of one bridge and minus half on those of the other. What dead time takes of a leg is given back by the leg's own
 * current, i + i_0 on one side and -(i + i_0) on the other: of unlike phases of the current it would make a v_0 as large as the
 * third harmonic at low speed.
 *
 *   v_0 = R i_0 + L_0 p i_0 + e_0
 *   e_0 = -3 omega psi_3 sin 3 theta
 *   i_0 = (i_A + i_B + i_C) / 3
 * zero_current 1   i_0 is held at zero, and v_0 is e_0, whatever R and L_0 are (row 92):
 *     v_0 = -k_p i_0 + y cos lead - q sin lead
 *   y, q turn with 3 omega T, and y grows by -k_r i_0. With f = current_bandwidth or a tenth of f_pwm, whichever is less,
 *     k_p = 2 pi f L_0
 *     k_r = k_p pi f T / 4
 *     d = 9/2 omega T                                                    delay of the voltage
 *     lead = d + atan2(3 omega / (2 pi f) - sin d, cos d)                and lag of L_0 under k_p
 *   v_0 stays within a quarter of v_dc.
 * zero_current 0   v_0 is none, i_0 flows, and tells it (row 91):
 *     e_0 = -R (i_0[k] + i_0[k-1]) / 2 - L_0 (i_0[k] - i_0[k-1]) / T
 *   R 10 % off is 1 degree at a fifth of rated speed
 * Either is the mean over [k-1, k): what third.h takes as the star point's voltage behind an RC of half a period.
 *
 * Currents of the first bridge's legs by sensors in the lines. i_0 counts in what each leg carries (i_trip) and in
 * what heats the windings, and where half of i_max of it flows for 2 ms that is a fault, SENSOR_SUM.
 *
 * The other phases do not hold the current of one that is open, or whose sensor shows nothing, as in a star: control
 * raises the voltage until it flows. That is OPEN_PHASE where for 3 ms
 *   |v| + |v_0| > 2 R i_max + 3/2 |omega| (psi_m + L_q i_max) + v_dc / 16 + v_injection
 * and where i_0 is held also by the leg's current (open_phase.h). A rotor that its load turns against an imposed
 * vector strains the voltage as well: while one is imposed behind the align the fault is POSITION_LOST. Where i_0
 * flows, a switch that does not close is not found at light load. A sensor that is stuck lets ten times the rated
 * current through: the hardware break of the bridge must act below that (docs/porting.md).
 *
 * A start is an align, and injection follows it where there is saliency (start_method 0, 3). Pulses, flying start,
 * identification, regulators of switch states, block commutation and carriers that need a star point are refused.
 *
 * open_winding_slow() at 1 kHz; no division in a period but those of modulator_step(), which runs twice. State 44 bytes.
 * Tests: tests/unit/drive/open_winding_test.cpp and open_winding_drive_test.cpp, tests/scenario/open_winding.yaml and
 * fault_bridges_open.yaml. */
#ifndef DRIVE_OPEN_WINDING_H
#define DRIVE_OPEN_WINDING_H

#include <stdbool.h>

#include "firmware/drive/bridges.h"
#include "firmware/math/frames.h"
#include "firmware/math/image.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    bool held;       /* zero_current 1 */
    pm_q_t k_p, k_r; /* per-unit */
    pm_q_t R;        /* half of it, per-unit */
    int32_t L;       /* L_0 / T: bridges.h */
    pm_q_t turn;     /* 3 T w_base, rad at a speed of one */
    pm_q_t delay;    /* 9/2 T w_base, the same */
    pm_q_t ratio;    /* 3 w_base / (2 pi f) */
    pm_q_t carrier;  /* its voltage */
} open_winding_config_t;

typedef struct {
    pm_q_t i;        /* i_0 at k */
    pm_q_t v_acting; /* v_0 of the step at k-2, as far as the legs reach: acts over [k-1, k) */
    pm_q_t v_next;   /* at k-1 */
    pm_q_t y, q;     /* what turns with 3 omega */
    pm_dir_t turn, lead;
    uint8_t unexplained_ms; /* voltage that neither current nor speed asks for */
} open_winding_t;

#if PM_HAS(open_winding)
/* Before the first step with control. */
void open_winding_reset(open_winding_t *self);

/* At the currents of k: e_0, of the mean over [k-1, k). Once a period, before open_winding_step(). */
pm_q_t open_winding_signal(open_winding_t *self, const open_winding_config_t *config, pm_abc_t i);

/* v: voltage that is wanted over [k+1, k+2); i_quarter: current expected there, without i_0. */
void open_winding_step(open_winding_t *self, const open_winding_config_t *config, modulator_t *modulator,
                       const modulator_config_t *modulator_config, pm_ab_t v, pm_q_t v_dc, pm_ab_t i_quarter,
                       bridges_t *out);

void open_winding_slow(open_winding_t *self, const open_winding_config_t *config, pm_q_t omega);

void make_open_winding(maker_t *m, open_winding_config_t *c);
#endif

#ifdef __cplusplus
}
#endif

#endif
