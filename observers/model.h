/* The machine as all observers know it, and its functions (METHODS.md 1.3.1.3, 2.2.2, 3.4).
 *
 *   k(i)   = L_qd + L_qd2 i_d
 *   L_q(i) = L_q + L_q2 (2^lift i_q)^2 + k i_d                               psi_q / i_q under load; >= L_q/16
 *   psi_a  = psi_m + (L_d - L_q(i)) i_d + (L_qd/2 + L_qd2 i_d) i_q^2         >= psi_m/4
 * psi_a is the active flux, the part of the stator flux on the d-axis; its last term follows from that of
 * psi_q, because both derive from one energy.
 *
 * Cross-coupling: psi_q contains L_qds i_d with L_qds = k i_q. Without it an observer errs by (row 26)
 *   tan(error) = -L_qds i_d / psi_a
 * Two identity terms remove that in any frame (row 27): -w L_qds i of the improved extended EMF, and
 * w k i_d J i, which each model has here by its L_q(i). They differ by w k |i|^2 along q: in the amplitude,
 * not in the angle.
 *
 * All functions are for 1 kHz, not for the step. Tests: tests/unit/observers,
 * tests/scenario/cross_coupling.yaml. */
#ifndef OBSERVERS_MODEL_H
#define OBSERVERS_MODEL_H

#include "firmware/math/estimate.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_q_t R;
    pm_q_t L_d, L_q;
    pm_q_t L_q2;  /* change of L_q with the square of i_q 2^lift, which saturates at 2; <= 0 ... */
    pm_q_t L_qd;  /* ... with i_d, <= 0: k_c of 3.4.2; 0: cross-coupling is left out ... */
    pm_q_t L_qd2; /* ... and with i_d^2 */
    pm_q_t psi_m;
    pm_frac_t t_s; /* T_s w_base, Q32 */
    uint8_t
        lift; /* of i_q: a motor whose rated current is far below full scale saturates within a fraction of it */
} observer_model_t;

/* Adaptation of R while the position is known from another source (docs/decisions/004-resistance.md). */
typedef struct {
    pm_gain_t k;  /* per slow step, Q26; 0: R stays */
    pm_q_t omega; /* R follows below this speed ... */
    pm_q_t drop;  /* ... and where its drop exceeds the EMF by this: what else lacks is then outweighed */
} observer_resistance_t;

pm_q_t observer_active_flux(const observer_model_t *model, pm_dq_t i);
pm_q_t observer_L_q(const observer_model_t *model, pm_dq_t i);

/* The next reference of the amplitude: psi_a of the present current, and what the model lacks, learnt in 100 ms.
 *   reference += psi_a(i) - psi_a - lack / 100
 * Stays within half of psi_a(i) around it. lack: reference minus measured amplitude; psi_a: of the last call, then of i. */
pm_q_t observer_amplitude(const observer_model_t *model, pm_dq_t i, pm_q_t reference, pm_q_t lack,
                          pm_q_t *psi_a);

/* The next R, from the power that the model lacks: error (of flux or voltage) along the current, times the
 * current. Between half and twice the parameter. */
pm_q_t observer_resistance(const observer_resistance_t *config, const observer_model_t *model, pm_q_t R,
                           pm_q_t omega, pm_q_t error, pm_q_t i_q);

#ifdef __cplusplus
}
#endif

#endif
