/* Third harmonic of two sets of windings by its fluxes (METHODS.md 11.5.1, row 130).
 *
 *   psi_01 = psi_3 cos 3 theta
 *   psi_02 = psi_3 sin 3 theta
 *   w_c = third_drift 3 |omega|
 *   psi' += T (v_0 - w_c psi')
 *   psi_01 + j psi_02 = (psi'_1 + j psi'_2) (1 - j third_drift sgn omega)
 * The last line is exact at 3 omega: as there are both, no speed is differentiated and nothing is expected. The pair of third.h is
 * q = 3 omega psi_01, y = -3 omega psi_02. Against third_pair.h the noise is less and the ninth harmonic a third,
 *   -(psi_9 / 3 psi_3) sin 12 theta
 * and an offset dv of a channel stays as dv / w_c. A sum is half a period ahead of its last sample, which x takes.
 *
 * Called each period; the result belongs to k. Tests: tests/unit/observers/third_test.cpp, tests/scenario/third_pair.yaml. */
#ifndef OBSERVERS_THIRD_PAIR_FLUX_H
#define OBSERVERS_THIRD_PAIR_FLUX_H

#include "observers/third_pair.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    third_config_t third;
    pm_q_t g; /* third_drift */
} third_pair_flux_config_t;

typedef struct {
    third_t third;
    int32_t psi_1, psi_2; /* psi', per-unit, Q30 */
    int32_t leak;         /* w_c T, Q32 */
    int32_t lift;         /* 3 omega, Q29 */
    int32_t back;         /* g sgn omega, Q30 */
} third_pair_flux_t;

void third_pair_flux_reset(third_pair_flux_t *self, const third_pair_flux_config_t *config,
                           const obs_in_t *in);
void third_pair_flux_step(third_pair_flux_t *self, const third_pair_flux_config_t *config, const obs_in_t *in,
                          obs_out_t *out);
obs_out_t third_pair_flux_last(const third_pair_flux_t *self);
void third_pair_flux_tie(third_pair_flux_t *self, const third_pair_flux_config_t *config);
void third_pair_flux_slow(third_pair_flux_t *self, const third_pair_flux_config_t *config, const obs_in_t *in,
                          const obs_out_t *out, pm_q_t weight);

void make_third_pair_flux(maker_t *m, third_pair_flux_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
