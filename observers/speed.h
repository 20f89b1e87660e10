/* Speed from the position and from the EMF (METHODS.md appendix A, rows 148 to 150).
 *
 *   difference   w_d = (theta(k) - theta(k-N)) / (N T): exact mean, late by N T/2
 *   EMF ratio    w_e = e_q / psi: at once, wrong by what psi_m is
 *   combined     w = w_e + LPF(w_d - w_e): the mean of the first, the speed of the second
 * or the speed of the loop, which needs none of them: then nothing is done.
 *
 * The difference is taken against the turn that the loop's speed stands for, so it may be more than half a
 * turn: w_d = w_loop + (theta - theta(k-N) - N T w_loop) / (N T). e_q comes from the voltage equation in the
 * present frame, w_e = (v_q - R i_q - L_q p i_q) / (psi_m + L_d i_d), and so works behind any source; w_e is
 * filtered.
 *
 * Called at 1 kHz, T being that step, with values of the same period. Range: N <= SPEED_WINDOW, within which
 * the loop may be half a turn off. Tests: tests/unit/observers/speed_test.cpp. */
#ifndef OBSERVERS_SPEED_H
#define OBSERVERS_SPEED_H

#include "firmware/math/fixed.h"
#include "firmware/math/frames.h"

#define SPEED_WINDOW 6U

typedef enum { SPEED_LOOP, SPEED_DIFFERENCE, SPEED_EMF_RATIO, SPEED_COMBINED, SPEED_COUNT } speed_id_t;

typedef struct {
    uint8_t id;         /* speed_id_t */
    uint8_t window;     /* N */
    uint16_t turn_step; /* control periods per step */
    pm_q_t R, L_d, psi_m;
    pm_gain_t rise;    /* L_q / (T w_base), Q26 */
    int32_t k_theta;   /* pm_omega_to_angle() */
    int32_t per_turn;  /* 2 pi / (N T w_base), Q26 */
    pm_frac_t k_ratio; /* low-pass of w_e per step, Q32 */
    pm_frac_t k_mean;  /* low-pass of w_d - w_e per step, Q32 */
} speed_config_t;

typedef struct {
    pm_angle_t past[SPEED_WINDOW];
    uint8_t next;
    bool ready; /* what it remembers is of the step before */
    pm_q_t i_q, v_q;
    pm_q_t omega_e;
    pm_q_t difference; /* LPF(w_d - w_e) */
} speed_t;

typedef struct {
    pm_angle_t theta;
    pm_q_t omega; /* of the loop */
    pm_q_t v_q;   /* mean voltage in the present frame */
    pm_dq_t i;
} speed_in_t;

/* Before the step of the same instant: as if it had turned at this speed since long ago. */
void speed_reset(speed_t *self, const speed_config_t *config, const speed_in_t *in);
pm_q_t speed_step(speed_t *self, const speed_config_t *config, const speed_in_t *in);

#endif
