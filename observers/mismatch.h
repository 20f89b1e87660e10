/* Correction of the position error that wrong parameters cause, learnt from an injected current
 * (METHODS.md 3.5.2, rows 29 to 32).
 *
 * A wrong L_q or R moves the angle of a source (3.5.1, row 28), d: machine minus parameter:
 *   error = K_q i_q + K_d i_d
 *   K_q   = -dL_q / psi_a
 *   K_d   = dR / (omega psi_a)
 * The learnt part is added to the error signal:
 *   eps'  = eps + k_q i_q + k_d i_d
 * A current that oscillates at w on the q-axis (row 29) or on the d-axis (row 30) shows the remainder in the
 * angle that the source sees, theta + eps', independent of the loop. X and I are the complex amplitudes of
 * that angle and of the measured current:
 *   g     = Re(X / I)                                            (row 31)
 *   k    -= (g - g_mech) / (4 + n/4)                            for the n-th window of whole periods (row 32)
 * g_mech is the real oscillation of the rotor:
 *   g_mech,q = -1.5 P^2 [psi_m + (L_d - L_q) i_d] / (J w^2)
 *   g_mech,d = -1.5 P^2 (L_d - L_q) i_q / (J w^2)
 * The measured current takes the place of its reference, so whatever the current control and the speed
 * control make of the injection is in both amplitudes (docs/methods_notes.md).
 *
 * Amplitudes, x relative to a rotor of constant speed:
 *   (X, I) = 2/n sum (x, i) (cos, sin)
 * The current is a cosine whose sign alternates from window to window: so an error of the speed, an
 * acceleration, and any disturbance of the angle at w that was not injected average to zero. The first period
 * of a window lets transients decay. A window is discarded when i_q changes by more than the injected
 * current, when the rotor is 0.1 rad from where constant speed would have moved it, or when less than half of
 * the current appears.
 *
 * After MISMATCH_WINDOWS windows the injection pauses for a minute, or until i_q has changed as above. K_d is
 * stored as K_d omega. Flux observers integrate an error of R, so w must be small against omega: at
 * |omega| < 2 w nothing is injected on the d-axis. Active only while the observer leads without the carrier
 * of another source. Which error shows in which observer: docs/methods_notes.md.
 *
 * Two sets of windings (METHODS.md 7.2.4.3, row 87): a current that one set has more and the other less makes no torque, and shows in
 * the angle that the first set alone sees (drive/two_sets.h)
 *   k_a = (dL_q - dM_q) / psi_a
 * with L_q of one set, where i_q shows dL_q + dM_q.
 *
 * The first MISMATCH_IN_PHASE windows are those of the q-axis, which say k_q. The next tell k_a, and from MISMATCH_TRACKS on
 * what k_a changes by moves k_q as an L_q and M_q that change alike: by (L_q + M_q) / (L_q - M_q).
 *
 * Each control period: 49 instructions and a call, 57 in a program that has two sets of windings. At 1 kHz: 30 when off, at most 161 otherwise. Range:
 * |k| <= 1 per base current. Tests: tests/unit/observers/mismatch_test.cpp,
 * tests/scenario/mismatch_injection.yaml. */
#ifndef OBSERVERS_MISMATCH_H
#define OBSERVERS_MISMATCH_H

#include <stdbool.h>
#include <stddef.h>

#include "firmware/math/image.h"
#include "firmware/math/pll.h"
#include "observers/model.h"

#ifdef __cplusplus
extern "C" {
#endif

#define MISMATCH_PERIODS 4U  /* of the injection in a window, after the first */
#define MISMATCH_WINDOWS 64U /* learnt before the injection pauses */

#define MISMATCH_IN_PHASE 16U
#define MISMATCH_TRACKS   40U

typedef enum { MISMATCH_OFF, MISMATCH_Q_AXIS, MISMATCH_D_AXIS, MISMATCH_APART, MISMATCH_COUNT } mismatch_id_t;

typedef struct {
    uint8_t id;       /* mismatch_id_t */
    uint8_t periods;  /* control periods per step */
    uint16_t samples; /* steps per period of the injection */
    pm_q_t i;         /* its amplitude */
    observer_model_t model;
    PM_IN_IMAGE(two_sets, pm_q_t alike;) /* (L_q + M_q) / (L_q - M_q) */
    int32_t swing;                       /* 1.5 P^2 / (J w^2): rad per base flux and base current, Q20 */
} mismatch_config_t;

/* What has been learnt. */
typedef struct {
    pm_dq_t k;      /* k_d, k_q: rad per base current */
    pm_q_t k_omega; /* k_d omega */
    PM_IN_IMAGE(two_sets, pm_q_t k_a;)
} mismatch_t;

/* The injection and the response to it; all zero before the first step. */
typedef struct {
    pm_angle_t theta; /* of a rotor of constant speed, ... */
    pm_q_t omega;     /* which is the mean of the loop's */
    pm_angle_t x;     /* angle beyond it, and current: sums over a step's control periods, /16 */
    pm_q_t i;
    pm_q_t i_q;      /* mean */
    pm_q_t i_record; /* i_q when learning began */
    pm_ab_t angle;   /* amplitudes: cosine and sine, Q27 */
    pm_ab_t current;
    pm_q_t injected; /* to be added to the current reference of its axis */
    uint16_t count;  /* steps in the window */
    uint8_t windows;
    uint8_t id; /* for which it learns */
} mismatch_window_t;

typedef struct {
    const pm_pll_t *pll; /* of the step: before its correction */
    int32_t k_theta;     /* pm_omega_to_angle() */
    pm_dq_t i;
    PM_IN_IMAGE(two_sets, pm_q_t apart;) /* q current that the first of two sets has more than their mean */
} mismatch_in_t;

/* Which axis the present window is of: MISMATCH_... */
static inline uint8_t mismatch_axis(const mismatch_window_t *window, const mismatch_config_t *config)
{
#if PM_HAS(two_sets)
    if (config->id == (uint8_t)MISMATCH_APART && window->windows < MISMATCH_IN_PHASE) {
        return (uint8_t)MISMATCH_Q_AXIS;
    }
#endif
    (void)window;
    return config->id;
}

/* It is between two sets of windings. */
static inline bool mismatch_is_apart(const mismatch_window_t *window, const mismatch_config_t *config)
{
#if PM_HAS(two_sets)
    return mismatch_axis(window, config) == (uint8_t)MISMATCH_APART;
#else
    (void)window;
    (void)config;
    return false;
#endif
}

/* Correction of the error signal. */
static inline pm_q_t mismatch_eps(const mismatch_t *self, pm_dq_t i)
{
    return pm_shl(pm_mulh2(self->k.d, i.d, self->k.q, i.q), 32 - PM_Q_BITS);
}

/* Every control period, before the loop: eps corrected in the observer's share. window: NULL while another
 * source has a share. */
pm_q_t mismatch_step(const mismatch_t *self, mismatch_window_t *window, const mismatch_config_t *config,
                     const mismatch_in_t *in, pm_q_t weight, pm_q_t eps);

/* At 1 kHz. */
void mismatch_slow(mismatch_t *self, mismatch_window_t *window, const mismatch_config_t *config,
                   const mismatch_in_t *in);

void make_mismatch(maker_t *m, mismatch_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
