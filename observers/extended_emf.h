/* Extended-EMF observer for salient machines in the estimated frame (METHODS.md 2.3.2.1, row 15).
 *
 *   v    = (R + p L_d) i + w L_q J i + (0, E_ex)
 *   E_ex = w psi_a - (L_d - L_q) p i_q
 *   E_d  = -E_ex sin(error)
 *   E_q  =  E_ex cos(error)
 * by the voltage equation of emf.h with L_d, plus w (L_q - L_d) J i with the current of the present frame.
 * Turned and filtered as in back_emf.h. With L_q(i) of model.h it is the improved extended EMF, without an
 * error by cross-coupling (3.4.1, 3.4.2; rows 26 and 27). A step of i_q disturbs it for as long as the
 * current changes, unlike the active flux.
 *
 * Called each period; the result belongs to k. vector: extended EMF. T e is limited to a quarter of the base
 * flux per period. Tests: tests/unit/observers/emf_test.cpp, tests/scenario/ipm_emf.yaml, ipm_emf_low.yaml,
 * cross_coupling.yaml. */
#ifndef OBSERVERS_EXTENDED_EMF_H
#define OBSERVERS_EXTENDED_EMF_H

#include "observers/emf.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef emf_config_t extended_emf_config_t;
typedef emf_t extended_emf_t;

void extended_emf_reset(extended_emf_t *self, const extended_emf_config_t *config, const obs_in_t *in);
void extended_emf_slow(extended_emf_t *self, const extended_emf_config_t *config, const obs_in_t *in,
                       const obs_out_t *out, pm_q_t weight);

static inline void extended_emf_step(extended_emf_t *self, const extended_emf_config_t *config,
                                     const obs_in_t *in, obs_out_t *out)
{
    emf_frame_step(self, config, in, out);
}

static inline obs_out_t extended_emf_last(const extended_emf_t *self)
{
    return emf_last(self);
}

static inline void extended_emf_tie(extended_emf_t *self, const extended_emf_config_t *config)
{
    (void)self, (void)config; /* no integrator that could drift */
}

void make_extended_emf(maker_t *m, extended_emf_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
