/* Speed from the position and from the EMF (METHODS.md appendix A, rows 148 to 150).
 *
 *   difference   w_d = (theta(k) - theta(k-N)) / (N T)      exact mean, late by N T/2
 *   EMF ratio    w_e = e_q / psi                            no delay, wrong by the error of psi_m
 *   combined     w   = w_e + LPF(w_d - w_e)                 mean of the first, dynamics of the second
 * SPEED_LOOP is the speed of the loop, which needs no computation.
 *
 * The difference is taken against the turn that the loop's speed stands for, so it may exceed half a turn:
 *   w_d = w_loop + (theta(k) - theta(k-N) - N T w_loop) / (N T)
 * e_q comes from the voltage equation in the present frame and so works behind any source:
 *   w_e = (v_q - R i_q - L_q p i_q) / (psi_m + L_d i_d),    then filtered
 * v_q is the mean over the millisecond in which i_q changed. (The mean of its two ends would be wrong by a
 * tenth of 75 V/A on IPM-1000, and the speed control closes a loop over that.)
 *
 * Called at 1 kHz, T being that step, with values of the same period. Range: N <= SPEED_WINDOW, within which
 * the loop may be half a turn off. Tests: tests/unit/observers/speed_test.cpp. */
#ifndef OBSERVERS_SPEED_H
#define OBSERVERS_SPEED_H

#include "firmware/math/fixed.h"
#include "firmware/math/frames.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SPEED_WINDOW 6U

typedef enum { SPEED_LOOP, SPEED_DIFFERENCE, SPEED_EMF_RATIO, SPEED_COMBINED, SPEED_COUNT } speed_id_t;

typedef struct {
    uint8_t id;         /* speed_id_t */
    uint8_t window;     /* N */
    uint16_t turn_step; /* control periods per step */
    pm_q_t R, L_d, psi_m;
    pm_gain_t per_step; /* 16 / turn_step, Q26 */
    pm_gain_t rise;     /* L_q / (T w_base), Q26 */
    int32_t k_theta;    /* pm_omega_to_angle() */
    int32_t per_turn;   /* 2 pi / (N T w_base), Q26 */
    pm_frac_t k_ratio;  /* low-pass of w_e per step, Q32 */
    pm_frac_t k_mean;   /* low-pass of w_d - w_e per step, Q32 */
} speed_config_t;

typedef struct {
    pm_angle_t past[SPEED_WINDOW];
    uint8_t next;
    bool ready; /* past[] is of the step before */
    pm_q_t i_q;
    pm_q_t v_sum; /* of v_q over the step, a sixteenth */
    pm_q_t omega_e;
    pm_q_t difference; /* LPF(w_d - w_e) */
} speed_t;

typedef struct {
    pm_angle_t theta;
    pm_q_t omega; /* of the loop */
    pm_dq_t i;
} speed_in_t;

/* Every control period: v_q, mean of the period, in the present frame. In open loop no step follows, and the sum wraps: the
 * first step does without. */
static inline void speed_collect(speed_t *self, pm_q_t v_q)
{
    self->v_sum = (pm_q_t)((uint32_t)self->v_sum + (uint32_t)(v_q / 16));
}

/* The first step gives the loop's speed. */
pm_q_t speed_step(speed_t *self, const speed_config_t *config, const speed_in_t *in);

void make_speed(maker_t *m, speed_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
