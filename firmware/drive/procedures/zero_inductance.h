/* dL_0 and L_c0 of a motor whose star point is led out, measured by the drive, which way the load on the magnet changes
 * them, and how unlike the resistors of the star are (METHODS.md 6.2.1 and 8.3.2; rows 71 to 77 and 95): what zero_sequence.h
 * and neutral.h must know.
 *
 * A current I along phase A, that of the command (rated by default) but psi_m / 2 (L_q - L_d) at most, turns the free rotor
 * to theta = 0. There a carrier V_h e^{j phi} of f_pwm / 20 turns, first with I, then without a current; friction keeps the
 * rotor. Of a whole period of the carrier, with the complex amplitudes I_a, I_b of the currents and Y of the channel, and
 * [A, B] = Im(A* B):
 *   v_0 = p psi_0                                                                     zero_sequence.h
 *   psi_0 = -1/2 Re[c i e^{j 2 theta}]
 *   c = dL_0 - j L_c0
 *   a = e^{-T_s / RC}
 *   q = e^{-j 2 pi / 20}
 *   K = 2 T_s (1 - a q) / ((1 - a)(1 - q))
 *   W = -K Y = dL_0 I_a + L_c0 I_b
 *   dL_0 = [W, I_b] / [I_a, I_b]
 *   L_c0 = [I_a, W] / [I_a, I_b]
 * of the means without current over 32 values. K takes off the filter, and the differences that make a voltage of a
 * current; dead time, resistance and delay are in both and drop out. A rotor that friction keeps delta beside phase A turns
 * c by 2 delta.
 *
 * Then the current turns the rotor by a quarter, where e^{j 2 theta} = -1: the winding's answer has the other sign there, and what
 * unlike resistors of the star make of the carrier has the same. With 0 and 1 for the two positions, in the equations above
 *   W = W_0 - W_1
 *   I_a = I_a0 + I_a1
 *   I_b = I_b0 + I_b1
 * and for the star (neutral.h)
 *   rho = R_s T_s / (2 tan(pi / 20))
 *   P = (L_d - j rho) I_a0 + (L_q - j rho) I_a1
 *   Q = (L_q - j rho) I_b0 + (L_d - j rho) I_b1
 *   star_alpha P + star_beta Q = -[W_0 + W_1 - dL_0 (I_a0 - I_a1) - L_c0 (I_b0 - I_b1)] / 2
 * P and Q stand for the voltage at the winding, by its current: dead time turns it by up to 9 degrees from the one commanded. What
 * is found of the star is as exact as R_s, L_d and L_q. Friction that keeps the rotor delta beside the current adds 2 delta dL_0.
 *
 *   S = |Y| |I_a| / Re I_a
 *   D = S with I - S without
 *   margin = (|D| - S / 64) / sigma                                                   polarity.h
 * The quotient is 1 / cos of what resistance and dead time turn the current by: without I the carrier passes zero, where dead
 * time takes most (|Y| 1.8 to 3.7 % less on a linear IPM-1000 at 70 and 35 V, S 0.5 %). D < 0 beyond five sigma:
 * zero_falls 1, with magnetising current; D > 0: 0. Below, the machine does not saturate: margin 0, and the start cannot tell
 * the poles by it (d_current.h). It is measured again a quarter further on, where the answer goes by 1 / L_qh: if it changes the
 * other way there, no sign serves every position, and the margin is 0 as well.
 *
 * The rotor must be free and without load; it turns by up to half a turn and a quarter, electrical. 5.1 s. Each
 * period 170 instructions.
 * The bridge is driven without dead-time compensation (commissioning.h). PM_FAILED_NO_CURRENT: a current does not come, or
 * the carrier has no answer in the currents; PM_FAILED_SALIENCY: none at the neutral, below 1/4000 of the inductance, which
 * leaves the star unknown, too.
 * Tests: tests/unit/drive/zero_inductance_test.cpp. */
#ifndef DRIVE_PROCEDURES_ZERO_INDUCTANCE_H
#define DRIVE_PROCEDURES_ZERO_INDUCTANCE_H

#include "firmware/drive/commissioning/commissioning.h"
#include "firmware/params/types.h"
#include "injection/polarity.h"
#include "injection/sine.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    sine_config_t sine;
    pm_dq_t k;     /* K w_base: real and imaginary part */
    pm_q_t i_most; /* psi_m / 2 (L_q - L_d) */
    pm_q_t omega;  /* of the control of the current */
    pm_q_t rho;    /* over R_s */
} zero_inductance_config_t;

/* Of the last run, per-unit; all 0: not measured. */
typedef struct {
    pm_q_t dL_0, L_c0;
    pm_ab_t star;
    pm_sigma_t margin; /* of `falls`; 0: not known */
    bool falls;        /* the answer, with magnetising current */
} zero_inductance_result_t;

typedef struct {
    pm_dq_t a, b, y; /* I_a, I_b, Y */
} zero_means_t;

typedef struct {
    sine_t sine;
    window_t neutral; /* d: v_zero */
    int32_t rest[3];  /* of the timer's counts, 128ths */
    commissioning_hold_t hold;
    pm_q_t i;                /* that is held, */
    pm_angle_t along;        /* along phase A and then across it */
    zero_means_t at[2];      /* theta = 0, 90 degrees */
    polarity_mean_t size[2]; /* S, with I and without; beside `first` */
    pm_q_t first;
    uint16_t ms; /* of this part */
    uint8_t values;
    uint8_t part;
} zero_inductance_t;

/* decay: a. */
void make_zero_inductance(maker_t *m, zero_inductance_config_t *c, pm_frac_t decay);

#ifdef __cplusplus
}
#endif

#endif
