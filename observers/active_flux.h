/* Active-flux observer for salient machines (METHODS.md 2.2.2, row 13), with the drift and delay remedies
 * of 3.2 (rows 21 to 23).
 *
 *   psi   += T_s (v - R i),                 i: mean of both ends of the period
 *   psi_a  = psi - L_q(i) i                 lies on the d-axis
 *   eps    = psi_a,q / psi_ref
 *   misfit = 1 - psi_a,d / psi_ref
 * Correction without a lag: the flux is fed back along the rotor frame,
 *   psi   += T_s [k_d (psi_ref - psi_a,d), k_t (psi_ref - psi_a,d) - k_q psi_a,q]
 *   k_d    = g |omega| + k_q
 *   k_t    = t omega
 *   t      = 2 sign(omega) L_q i_q / psi_ref within -1/2 and 1; 0 with g = 0
 * g |omega| holds the amplitude and so removes the drift of the integration, which appears as a ripple of
 * the amplitude; k_t makes it stiffer when motoring and softer when braking, against the speed control, which
 * R and L_q that are too high make swing (docs/decisions/004-resistance.md). Neither moves an angle as long as
 * psi_ref is the mean amplitude. k_q > 0 ties the flux to the present position while injection leads, without
 * k_t; it is zero when this observer leads. psi_ref is psi_a of model.h and what that lacks, which it follows
 * slowly within a band: an error of psi_m moves no angle either.
 * While the flux is tied, its distance from the current model shows the error of the resistance, and R is
 * adapted to it:
 *   k_q psi_a,q = (R - R^) i_q
 * where its drop outweighs what lacks for other reasons. The adapted R is kept when the observer leads. R
 * overestimated by 50 % would otherwise make the observer unstable under load below a third of rated speed
 * (docs/decisions/004-resistance.md).
 * L_q(i) is that of model.h: a constant L_q costs IPM-1000 2.4 degrees at rated load.
 *
 * The integrated quantity is psi + R T_s/2 i, which needs one current only: the mean of both ends then
 * appears as R T_s/2 beside L_q. L_q(i), g |omega|, k_t and R T_s are renewed at 1 kHz. Formats are chosen so
 * that each line is a chain of multiply-accumulates without a shift.
 *
 * Called each period; the result belongs to k. Range: |psi| < 4, |i| < 2, L_q < 4; k_d, k_q and k_t are clamped to
 * 1/8 per period. eps and misfit have 19 fractional bits.
 * Tests: tests/unit/observers/active_flux_test.cpp, tests/scenario. */
#ifndef OBSERVERS_ACTIVE_FLUX_H
#define OBSERVERS_ACTIVE_FLUX_H

#include "observers/model.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    observer_model_t model;
    observer_resistance_t resistance;
    pm_frac_t g;      /* amplitude feedback per radian: g T_s w_base, Q32 */
    pm_frac_t k_seed; /* T_s k_q at weight 0, Q32 */
} active_flux_config_t;

typedef struct {
    pm_ab_t psi;        /* stator flux + R T_s/2 i, Q26 */
    pm_ab_t i;          /* current at k-1 */
    int32_t step;       /* T_s w_base, Q30 */
    int32_t drop;       /* R T_s w_base, Q30 */
    int32_t inductance; /* L_q(i) + R T_s/2, Q29 */
    int32_t reference;  /* psi_ref, Q25 */
    int32_t k_d;        /* times T_s, as the next two, Q34 */
    int32_t k_q;
    int32_t k_t;
    pm_gain_t inverse; /* 1 / psi_ref, Q26 */
    pm_dq_t active;    /* active flux of the last step, Q25 */
    pm_q_t psi_ref;
    pm_q_t psi_a; /* what of it is the model's */
    pm_q_t R;     /* adapted */
} active_flux_t;

/* Sets the flux to that of the current model at the given position: no transient follows if it is right. */
void active_flux_reset(active_flux_t *self, const active_flux_config_t *config, const obs_in_t *in);
void active_flux_step(active_flux_t *self, const active_flux_config_t *config, const obs_in_t *in,
                      obs_out_t *out);

/* The result of the last step. */
obs_out_t active_flux_last(const active_flux_t *self);
/* Ties the flux to the position until active_flux_slow() decides otherwise. */
void active_flux_tie(active_flux_t *self, const active_flux_config_t *config);

/* At 1 kHz, with in (i_dq, omega) and out (vector) of the last step: adapts psi_ref and R, ties the flux to
 * the position at weight 0. */
void active_flux_slow(active_flux_t *self, const active_flux_config_t *config, const obs_in_t *in,
                      const obs_out_t *out, pm_q_t weight);

void make_active_flux(maker_t *m, active_flux_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
