/* Extended-EMF observer for salient machines in the stationary frame (METHODS.md 2.3.2.2, row 16).
 *
 *   v = (R + p L_d) i + w (L_q - L_d) J i + E_ex (-sin theta, cos theta)
 * by the voltage equation of emf.h with L_d, and L_q(i) of model.h (3.4.2, rows 26 and 27). The EMF is an
 * alternating quantity here, so its filter lags:
 *   e       += k (E - e)
 *   tan(lag) = (2 - k)/k tan(w T/2)              together with half a sampling period
 * The steady lag at the present speed is known and turned back in the estimated frame, where the error signal
 * is formed (3.2.3, row 23).
 *
 * Called each period; the result belongs to k. vector: extended EMF, lag removed. T e is limited to an eighth
 * of the base flux per period, the lag to 63 degrees. Tests: tests/unit/observers/emf_test.cpp,
 * tests/scenario/ipm_emf.yaml, ipm_emf_low.yaml, cross_coupling.yaml. */
#ifndef OBSERVERS_EXTENDED_EMF_AB_H
#define OBSERVERS_EXTENDED_EMF_AB_H

#include "observers/emf.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef emf_config_t extended_emf_ab_config_t;

typedef struct {
    emf_t emf;
    pm_ab_t e; /* T e, filtered, Q32 */
} extended_emf_ab_t;

void extended_emf_ab_reset(extended_emf_ab_t *self, const extended_emf_ab_config_t *config,
                           const obs_in_t *in);
void extended_emf_ab_step(extended_emf_ab_t *self, const extended_emf_ab_config_t *config, const obs_in_t *in,
                          obs_out_t *out);
void extended_emf_ab_slow(extended_emf_ab_t *self, const extended_emf_ab_config_t *config, const obs_in_t *in,
                          const obs_out_t *out, pm_q_t weight);

static inline obs_out_t extended_emf_ab_last(const extended_emf_ab_t *self)
{
    return emf_last(&self->emf);
}

static inline void extended_emf_ab_tie(extended_emf_ab_t *self, const extended_emf_ab_config_t *config)
{
    (void)self, (void)config; /* no integrator that could drift */
}

void make_extended_emf_ab(maker_t *m, extended_emf_ab_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
