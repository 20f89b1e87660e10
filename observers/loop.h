/* Position observers: how the error signal of the leading source moves the position (METHODS.md 2.4, rows 18
 * to 20).
 *
 *   PLL              omega += K_2 eps;  theta += T omega + K_3 eps                  firmware/math/pll.h
 *   arctangent       theta += T omega + eps;  omega: of a PLL that follows theta
 *   simplified EKF   W += K_1 eps;  omega += W + K_2 eps;  theta += T omega + K_3 eps
 *
 * Arctangent: eps is the angle of the EMF or flux seen from the position, so theta after the correction is
 * its atan2, whatever theta was before (within the limit of +-1 rad per period). It has no memory: no lag,
 * and all of the noise, rms = noise / |e|. Its speed is used for prediction and control and is as quiet as
 * the PLL's: a first-order filter of the difference would turn 0.1 rad of noise into 0.1 w_n.
 * Behind an EMF at low speed its noise disturbs the current control; behind a flux it works at all speeds.
 * Harmonics of EMF and current (3.3, rows 24 and 25) appear at 6 k times the angle: the arctangent passes
 * them undamped, the others attenuate them beyond w_n.
 *
 * Simplified EKF: the constant gains to which a Kalman filter with white jerk converges, all poles at r:
 *   K_1 = r^3 T^2
 *   K_2 = 2 r^2 T
 *   K_3 = 2 r T
 * No error under a constant acceleration. Noise bandwidth 5/3 r against (4 zeta^2 + 1) / (4 zeta) w_n of the
 * PLL: equal for r = 0.707 w_n at zeta = 0.9.
 *
 * loop_eps() precedes pm_pll_correct(); a drive with the PLL does without it. The others cost a call and 18
 * (simplified EKF) or 28 instructions. While another source has a share, the arctangent is replaced by the
 * PLL of the given gains; K_1 grows with the share. Range: |W| < 1/32 per period. Tests:
 * tests/unit/observers/loop_test.cpp, tests/scenario/position_observers.yaml. */
#ifndef OBSERVERS_LOOP_H
#define OBSERVERS_LOOP_H

#include "firmware/math/pll.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum { LOOP_PLL, LOOP_ARCTANGENT, LOOP_SIMPLIFIED_EKF, LOOP_COUNT } loop_id_t;

typedef struct {
    loop_id_t id;
    int32_t k_acceleration; /* simplified EKF: K_1 per-unit, Q36 */
} loop_config_t;

typedef struct {
    int32_t inner;          /* W, Q36 per period; arctangent: the PLL before theta, turns of 2^32 */
    int32_t k_acceleration; /* with the share, Q36 */
    bool direct;            /* the arctangent leads */
    uint8_t id;             /* whose inner it is */
} loop_t;

void loop_reset(loop_t *self);

/* At 1 kHz: the share of the source. */
void loop_slow(loop_t *self, const loop_config_t *config, pm_q_t weight);

/* Its own part of the correction; returns what is left of eps for the PLL. */
pm_q_t loop_eps(loop_t *self, const loop_config_t *config, pm_pll_t *pll, const pm_pll_config_t *gains,
                pm_q_t eps);

/* low: of the loop on a low-speed source; high: on an observer. */
void make_loop(maker_t *m, loop_config_t *c, pm_pll_config_t *low, pm_pll_config_t *high);

/* r / w_n of the simplified EKF, for makers. */
#define LOOP_EKF_SHARE pm_num_ratio(7067, 10000)

#ifdef __cplusplus
}
#endif

#endif
