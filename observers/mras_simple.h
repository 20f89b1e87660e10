/* Model reference adaptive system, simplified voltage model (METHODS.md 12.2.4, row 139).
 *
 * The d-axis of the voltage model alone; sign and amplitude of the EMF come from the filtered speed w_f:
 *   D_d = v_d - R i_d - L_q (p i)_d = -E sin(error)
 *   eps = -mean of two D_d / (w_f psi_a)
 * (p i)_d is the change of the stationary current along the d-axis; it contains -omega i_q, so no speed
 * enters the model. (With w_f L_q i_q instead, the loop's own correction k_p eps turns the frame in which the
 * current control holds i_q: a positive feedback of k_p L_q i_q / E, unstable at rated load below a third of
 * rated speed.) The turn of half a period uses v_q of the steady state, at 1 kHz, in place of two products
 * per period:
 *   eps += (w_f T_s/2) (R i_q + E) / E
 *
 * Price: eps is wrong by (L_d - L_q) p i_d / E while i_d changes, and without the q-axis there is no EMF
 * ratio and no misfit (always 0): a lost position shows in eps alone.
 *
 * Called each period; the result belongs to k. Range: |v| and |i| < 2; L_q / (T_s emf_min) is clamped to
 * 2048. vector: (D_d, w_f psi_a). Tests: tests/unit/observers/mras_test.cpp, tests/scenario. */
#ifndef OBSERVERS_MRAS_SIMPLE_H
#define OBSERVERS_MRAS_SIMPLE_H

#include "observers/mras.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef mras_config_t mras_simple_config_t;

typedef struct {
    pm_ab_t i;                   /* at k-1 */
    int32_t inverse, offset;     /* 1 / E, Q24; what v_q adds, Q20 */
    int32_t resistive, reactive; /* R / E, Q24; L_q / (T_s E), Q20 */
    int32_t v_d, rise;           /* of the last period, Q27: v_d and the change of current along d */
    pm_q_t eps;                  /* of the last step */
    pm_q_t emf;                  /* w_f psi_a */
    pm_q_t omega;                /* w_f */
} mras_simple_t;

void mras_simple_reset(mras_simple_t *self, const mras_simple_config_t *config, const obs_in_t *in);
void mras_simple_step(mras_simple_t *self, const mras_simple_config_t *config, const obs_in_t *in,
                      obs_out_t *out);
obs_out_t mras_simple_last(const mras_simple_t *self);
void mras_simple_tie(mras_simple_t *self, const mras_simple_config_t *config);
void mras_simple_slow(mras_simple_t *self, const mras_simple_config_t *config, const obs_in_t *in,
                      const obs_out_t *out, pm_q_t weight);

void make_mras_simple(maker_t *m, mras_simple_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
