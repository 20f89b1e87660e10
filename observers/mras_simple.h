/* Model reference adaptive system, simplified voltage model (METHODS.md 12.2.4, row 139).
 *
 * The d-axis of the voltage model alone, without the change of current, with the sign and the size of the
 * EMF from the filtered speed w_f:
 *   D_d = v_d - R i_d + w_f L_q i_q = -E sin(error),  eps = -D_d / (w_f psi_a)
 * v_d is the mean of two periods, from which a square-wave carrier is gone. The turn of half a period is left
 * to v_q of the model in the steady state: eps gets (w_f T_s/2) v_q / (w_f psi_a) at 1 kHz instead of two
 * products per period. What it gives up: eps is L_d p i_d / E wrong while i_d moves, and no q-axis means no
 * EMF ratio and no misfit (always 0): a lost position shows in eps alone.
 *
 * R stays as it is given. Called each period; result belongs to k. Range: |v| and |i| < 2. vector: (D_d,
 * w_f psi_a). Tests: tests/unit/observers/mras_test.cpp, tests/scenario. */
#ifndef OBSERVERS_MRAS_SIMPLE_H
#define OBSERVERS_MRAS_SIMPLE_H

#include "observers/mras.h"

typedef mras_config_t mras_simple_config_t;

typedef struct {
    int32_t resistive, reactive; /* R and w_f L_q over E, Q24 */
    int32_t inverse, offset;     /* 1 / E, Q24; what v_q adds, Q20 */
    int32_t v_d;                 /* of the last period, Q27 */
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

#endif
