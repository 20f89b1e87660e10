/* Model reference adaptive system, current model (METHODS.md 12.2.2, row 137).
 *
 * Each period the model starts from the measured current and predicts the next one. The model has an adapted
 * extended EMF E^ (mras.h) on its q-axis; its prediction error D shows the position error:
 *   r       = R T_s / (2 L_d)
 *   b       = (T_s/L_d) / (1 + r)
 *   i_CM(k) = (1 - r)/(1 + r) i(k-1) + b (v - w_f (L_q - L_d) J i - (0, E^))
 *   D       = i(k) - i_CM(k)
 *   D_d     = b E sin(error)
 *   D_q     = b (E^ - E cos(error))
 *   E^     -= (k / b) D_q
 *   eps     = mean of two D_d / (b E^)
 *   misfit  = 1 - E^ / (omega psi_a)
 * psi_m enters misfit alone: the angle needs R, L_d and L_q. The speed of the model, E^ / psi_a, is the EMF
 * ratio of speed.h. Noise of a current sample enters the EMF times L_d/T_s and differentiated; the loop
 * behind filters it out.
 *
 * Called each period; the result belongs to k. Range: T_s/L_d < 2, L_d/T_s < 128, |v| and |i| < 2; D
 * saturates at half the base current. vector: E in the present frame, clamped to +-4.
 * Tests: tests/unit/observers/mras_test.cpp, tests/scenario. */
#ifndef OBSERVERS_MRAS_CURRENT_H
#define OBSERVERS_MRAS_CURRENT_H

#include "observers/mras.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef mras_config_t mras_current_config_t;

typedef struct {
    pm_ab_t i;              /* at k-1 */
    int32_t keep, drive;    /* (1 - r) / (1 + r) and b, Q30 */
    int32_t cross, half;    /* b w_f (L_q - L_d), Q29; omega T_s / 2, Q32 */
    int32_t response;       /* b, Q29 */
    int32_t adapt;          /* k / b, Q28; 0: tied */
    int32_t emf_per_change; /* 1 / b, Q24 */
    int32_t inverse;        /* of E^, Q22 */
    int32_t inverse_model;  /* of omega psi_a, Q22 */
    pm_q_t emf_model;       /* omega psi_a */
    pm_q_t emf;             /* E^ */
    obs_out_t last;
    pm_q_t omega_f;   /* w_f */
    int32_t change_d; /* D_d of the last step, Q25 */
} mras_current_t;

void mras_current_reset(mras_current_t *self, const mras_current_config_t *config, const obs_in_t *in);
void mras_current_step(mras_current_t *self, const mras_current_config_t *config, const obs_in_t *in,
                       obs_out_t *out);
obs_out_t mras_current_last(const mras_current_t *self);
void mras_current_tie(mras_current_t *self, const mras_current_config_t *config);
void mras_current_slow(mras_current_t *self, const mras_current_config_t *config, const obs_in_t *in,
                       const obs_out_t *out, pm_q_t weight);

void make_mras_current(maker_t *m, mras_current_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
