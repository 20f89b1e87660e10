/* Sliding-mode observer with a choice of switching functions (METHODS.md 12.3.2 and 12.3.3, rows 140, 141).
 *
 * In the stationary frame, with L_q on both axes:
 *   L_q p i^ = v - R i^ - z
 *   s        = L_q (i^ - i)                         sum of the voltage errors
 *   z        = f(s)                                 switching function, below
 *   e        = LPF(z), its lag compensated
 *   eps      = -e_d / (omega psi_a)
 * L_q on both axes makes e the EMF of the active flux, omega psi_a on the q-axis, so salient machines are
 * covered; a round machine is the case L_d = L_q. Assumed: i_d changes slowly, because p i_d appears as an
 * EMF. Switching functions:
 *   sign            z = K sgn(s)
 *                   the conventional observer; slides while K > |e| on both axes; ripple of K
 *   saturation      z = slope s, |z| <= K
 *                   a linear observer within the boundary layer, no chattering there
 *   sigmoid         z = K x (3 - x^2) / 2,  x = slope s / (1.5 K), |x| <= 1
 *                   the same slope at zero, rounded corners
 *   super-twisting  z   = w + 1.5 (Lambda |s|)^0.5 sgn(s)
 *                   p w = 1.1 Lambda sgn(s)
 *                   the switched term is integrated; Lambda = 1.5 omega^2 psi_a bounds |p e|;
 *                   the root is computed 0 to 6 % too large
 * with the gain
 *   K = k_base + k_speed |omega| psi_a
 * k_speed = 0 is the conventional constant gain, a small k_base the adaptive one.
 *
 * z follows e with a delay of some periods that differs by function; it and the lag of the low-pass are
 * compensated by one complex factor, exact to the second order of omega T_s. Below omega_min the error signal
 * fades with (omega / omega_min)^2, because the EMF is too small there; at weight 0, where the observer only
 * watches the leading source, below omega_tie instead. Nothing else is tied: the EMF converges within
 * milliseconds.
 *
 * Called each period; the result belongs to k. Range: L_q < 4, |L_q i| < 2, |e| < 1, K < 1; |s| saturates at
 * 1/2. misfit: amplitude of the EMF against omega psi_a, relative. vector: EMF. Cost with loop: saturation
 * 126 instructions, sign 112, sigmoid 128, super-twisting 139.
 * Tests: tests/unit/observers/sliding_mode_test.cpp (against double precision, ripple, K too small),
 * tests/scenario, tests/target/observers. */
#ifndef OBSERVERS_SLIDING_MODE_H
#define OBSERVERS_SLIDING_MODE_H

#include "observers/model.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    SLIDING_MODE_SIGN,
    SLIDING_MODE_SATURATION,
    SLIDING_MODE_SUPER_TWISTING,
    SLIDING_MODE_SIGMOID
} sliding_mode_function_t;

typedef struct {
    observer_model_t model;
    sliding_mode_function_t function;
    pm_q_t k_base;    /* constant part of K, voltage */
    pm_q_t k_speed;   /* part of K per |omega| psi_a */
    pm_q_t omega_min; /* > 0 */
    pm_q_t omega_tie; /* takes its place at weight 0 */
    pm_frac_t k_lp;   /* low-pass of z: 1 - exp(-omega_c T_s), Q32, > 2^-8 */
    int32_t slope;    /* SLIDING_MODE_STEP / (T_s w_base), Q20 */
} sliding_mode_config_t;

/* Share of s that one period removes within the boundary layer: pole at one minus this. */
#define SLIDING_MODE_STEP 0.5

typedef struct {
    pm_ab_t y;            /* L_q i^, Q28 */
    pm_ab_t z;            /* what the switching function gave, voltage */
    pm_ab_t w;            /* integral of super-twisting */
    pm_ab_t e;            /* low-pass of z */
    int32_t inductance;   /* L_q(i), Q29 */
    pm_frac_t half_decay; /* R T_s / (2 L_q), Q32 */
    pm_q_t K;             /* present gain */
    int32_t steepness;    /* slope / (1.5 K), Q20 */
    pm_q_t lambda;        /* 2.25 Lambda, Q32 */
    pm_q_t twist;         /* 1.1 Lambda T_s, Q28 */
    int32_t lead_real;    /* complex factor that takes the lag back, Q28; below 4 */
    int32_t lead_imag;
    int32_t per_emf; /* 2 sgn(omega) / (|omega| psi_a), fading below omega_min, Q20 */
    pm_q_t expected; /* amplitude by the model times per_emf: 1, less below omega_min */
    pm_dq_t vector;  /* EMF of the last step, Q23 */
} sliding_mode_t;

void sliding_mode_reset(sliding_mode_t *self, const sliding_mode_config_t *config, const obs_in_t *in);
void sliding_mode_step(sliding_mode_t *self, const sliding_mode_config_t *config, const obs_in_t *in,
                       obs_out_t *out);
obs_out_t sliding_mode_last(const sliding_mode_t *self);
void sliding_mode_tie(sliding_mode_t *self, const sliding_mode_config_t *config);
void sliding_mode_slow(sliding_mode_t *self, const sliding_mode_config_t *config, const obs_in_t *in,
                       const obs_out_t *out, pm_q_t weight);

void make_sliding_mode(maker_t *m, sliding_mode_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
