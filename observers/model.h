/* The machine as all observers know it, and what they share (METHODS.md 1.3.1.3, 2.2.2).
 *
 *   psi_a = psi_m + (L_d - L_q) i_d      active flux: the part of the stator flux that lies on the d-axis
 *   L_q(i_q) = L_q + L_q2 i_q^2          apparent inductance under load
 * All for 1 kHz, not for the step. Tests: tests/unit/observers. */
#ifndef OBSERVERS_MODEL_H
#define OBSERVERS_MODEL_H

#include "firmware/math/estimate.h"

typedef struct {
    pm_q_t R;
    pm_q_t L_d, L_q;
    pm_q_t L_q2; /* change of L_q with i_q^2, <= 0 */
    pm_q_t psi_m;
    pm_frac_t t_s; /* T_s w_base, Q32 */
} observer_model_t;

/* How R follows the winding while the position is known from elsewhere (docs/decisions/004-resistance.md). */
typedef struct {
    pm_gain_t k; /* per slow step, Q26; 0: R stays */
    pm_q_t min, max;
    pm_q_t omega; /* R follows below this speed: above, errors of psi_m outweigh it */
} observer_resistance_t;

pm_q_t observer_active_flux(const observer_model_t *model, pm_q_t i_d);
pm_q_t observer_L_q(const observer_model_t *model, pm_q_t i_q);

/* The next R, from the power that the model lacks: error (of flux or voltage) along the current, times it. */
pm_q_t observer_resistance(const observer_resistance_t *config, pm_q_t R, pm_q_t omega, pm_q_t lack);

#endif
