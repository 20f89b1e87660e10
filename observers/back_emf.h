/* Back-EMF observer for machines without saliency (METHODS.md 2.3.1, row 14).
 *
 * In the estimated frame, with L_s = L_q(i):
 *   E   = v - R i - L_s p i - w L_s J i
 *   E_d = -E sin(error)
 *   E_q =  E cos(error)
 * by the voltage equation of emf.h, which has w L_s J i in the change of the stationary current. The EMF is
 * turned into the frame of the middle of the period and filtered there, without a lag in steady state.
 *
 * Called each period; the result belongs to k. vector: EMF. T e is limited to a quarter of the base flux per
 * period. Tests: tests/unit/observers/emf_test.cpp, tests/scenario/spm_emf.yaml. */
#ifndef OBSERVERS_BACK_EMF_H
#define OBSERVERS_BACK_EMF_H

#include "observers/emf.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef emf_config_t back_emf_config_t;
typedef emf_t back_emf_t;

void back_emf_reset(back_emf_t *self, const back_emf_config_t *config, const obs_in_t *in);
void back_emf_slow(back_emf_t *self, const back_emf_config_t *config, const obs_in_t *in,
                   const obs_out_t *out, pm_q_t weight);

static inline void back_emf_step(back_emf_t *self, const back_emf_config_t *config, const obs_in_t *in,
                                 obs_out_t *out)
{
    emf_frame_step(self, config, in, out);
}

static inline obs_out_t back_emf_last(const back_emf_t *self)
{
    return emf_last(self);
}

static inline void back_emf_tie(back_emf_t *self, const back_emf_config_t *config)
{
    (void)self, (void)config; /* no integrator that could drift */
}

void make_back_emf(maker_t *m, back_emf_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
