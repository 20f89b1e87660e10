/* Flux-linkage observer for machines without saliency (METHODS.md 2.2.1, row 12), with the low-pass in place
 * of the integration and its lag turned back (3.2.1 to 3.2.3, rows 21 to 23).
 *
 *   w_c   = g |w|
 *   psi' += T_s (v - R i) - w_c T_s psi'
 *   psi   = psi' (1 - w_c T_s / 2 - j g sgn w)
 *   eps   = (psi - L_s i)_q / psi_ref,            psi - L_s i lies on the d-axis; L_s = L_q(i)
 * Since w_c follows the speed, the factor that removes lag and attenuation is the same at every speed and
 * exact at constant speed. The position is not fed back: a voltage offset dv leaves dv / w_c in the flux and
 * a ripple of the position at the frequency of rotation, which active_flux.h damps equally. While another
 * source leads, the flux is not filtered but tied to the present position. The state is converted at the
 * change between both and at a change of the sign of w. psi_ref, R and the integration are those of
 * active_flux.h.
 *
 * Called each period; the result belongs to k. Ranges as in active_flux.h, g <= 1. Tests:
 * tests/unit/observers/flux_linkage_test.cpp, tests/scenario/spm_flux_linkage.yaml. */
#ifndef OBSERVERS_FLUX_LINKAGE_H
#define OBSERVERS_FLUX_LINKAGE_H

#include "observers/active_flux.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    active_flux_config_t flux; /* .g: here of the low-pass, T_s w_base g */
    pm_q_t g;                  /* w_c / |w| */
} flux_linkage_config_t;

typedef struct {
    active_flux_t flux; /* .psi: psi' + R T_s/2 i */
    int32_t leak;       /* w_c T_s, Q32 */
    int32_t turn;       /* g sgn w, Q30; 0: tied */
} flux_linkage_t;

void flux_linkage_reset(flux_linkage_t *self, const flux_linkage_config_t *config, const obs_in_t *in);
void flux_linkage_step(flux_linkage_t *self, const flux_linkage_config_t *config, const obs_in_t *in,
                       obs_out_t *out);
obs_out_t flux_linkage_last(const flux_linkage_t *self);
void flux_linkage_tie(flux_linkage_t *self, const flux_linkage_config_t *config);
void flux_linkage_slow(flux_linkage_t *self, const flux_linkage_config_t *config, const obs_in_t *in,
                       const obs_out_t *out, pm_q_t weight);

void make_flux_linkage(maker_t *m, flux_linkage_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
