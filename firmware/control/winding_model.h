/* The winding over a period: what predictive regulators (deadbeat.h, predictive.h, direct_torque.h) know of it.
 *
 *   against_d = R i_d - omega L_q i_q                      voltage that holds the current
 *   against_q = R i_q + omega (L_d i_d + psi_m)
 *   i_d' = i_d + T_s/L_d (v_d - against_d)                 current after a period of v
 *   i_q' = i_q + T_s/L_q (v_q - against_q)
 *
 * All per-unit, Q28, in the estimated frame; what is beyond +-8 saturates. make_deadbeat() makes it from SI parameters.
 * Tests: those of the regulators. */
#ifndef CONTROL_WINDING_MODEL_H
#define CONTROL_WINDING_MODEL_H

#include "firmware/control/regulation.h"

typedef struct {
    pm_q_t R; /* per-unit */
    pm_q_t L_d, L_q, psi_m;
    pm_q_t per_L_d, per_L_q; /* T_s / L */
} winding_model_t;

/* L i + psi_m */
static inline pm_dq_t winding_flux(const winding_model_t *c, pm_dq_t i)
{
    pm_dq_t psi;
    psi.d = pm_add_sat(c->psi_m, pm_mul_sat(c->L_d, i.d));
    psi.q = pm_mul_sat(c->L_q, i.q);
    return psi;
}

/* R i and the EMF of a current, saturated: what no machine has cannot overflow. */
static inline pm_dq_t winding_against(const winding_model_t *c, pm_dq_t i, pm_q_t omega)
{
    const pm_dq_t psi = winding_flux(c, i);
    pm_dq_t v;
    v.d = pm_sub_sat(pm_mul_sat(c->R, i.d), pm_mul_sat(omega, psi.q));
    v.q = pm_add_sat(pm_mul_sat(c->R, i.q), pm_mul_sat(omega, psi.d));
    return v;
}

/* Where v takes the current by the end of the period. */
static inline pm_dq_t winding_after(const winding_model_t *c, pm_dq_t v, pm_dq_t i, pm_q_t omega)
{
    const pm_dq_t against = winding_against(c, i, omega);
    const pm_q_t change_d = pm_mul_sat(c->per_L_d, pm_sub_sat(v.d, against.d));
    const pm_q_t change_q = pm_mul_sat(c->per_L_q, pm_sub_sat(v.q, against.q));
    pm_dq_t after;
    after.d = pm_add_sat(i.d, change_d);
    after.q = pm_add_sat(i.q, change_q);
    return after;
}

/* No voltage of the link moves the current by e in a period. */
static inline bool winding_beyond(const winding_model_t *c, pm_dq_t e, pm_q_t v_dc)
{
    return pm_abs(e.d) > pm_mul_sat(c->per_L_d, v_dc) || pm_abs(e.q) > pm_mul_sat(c->per_L_q, v_dc);
}

#endif
