/* Stator flux of the d-q model from one sample to the next: the common part of both Kalman filters.
 *
 *   lambda   = (L + R T_s / 2) i          per axis, in the frame of the present position
 *   psi(k+1) = psi(k) turned back by the frame's turn + T_s v - T_s R (i(k) + i(k+1)) / 2
 * The state is psi - R T_s / 2 i in the stationary frame, so the turn is exact and each sample needs its own
 * current only. L_q(i) and R are renewed at 1 kHz. Range: |psi| and |lambda| < 4, L < 4. */
#ifndef OBSERVERS_DQ_FLUX_H
#define OBSERVERS_DQ_FLUX_H

#include "observers/model.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_ab_t psi;              /* psi - R T_s / 2 i, Q28 */
    pm_dir_t dir;             /* frame of the last sample */
    int32_t L_d, L_q;         /* + R T_s / 2, Q29 */
    pm_frac_t loss_d, loss_q; /* R T_s / (L + R T_s / 2), Q32 */
    pm_q_t psi_a, eta;        /* active flux; (L_d - L_q) i_q */
} dq_flux_t;

/* At 1 kHz. */
void dq_flux_set(dq_flux_t *self, const observer_model_t *model, pm_dq_t i);

static inline pm_dq_t dq_flux_lambda(const dq_flux_t *self, pm_ab_t i, pm_dir_t dir)
{
    const pm_dq_t half = pm_park_half(i, dir);
    pm_dq_t r;
    r.d = pm_shl(pm_mulh(half.d, self->L_d), 4);
    r.q = pm_shl(pm_mulh(half.q, self->L_q), 4);
    return r;
}

/* psi(k) without the drop of the current at k, in the frame at k. */
static inline pm_dq_t dq_flux_advance(const dq_flux_t *self, pm_frac_t t_s, pm_ab_t v, pm_dir_t dir)
{
    pm_ab_t psi;
    psi.alpha = pm_frac_add(self->psi.alpha, v.alpha, t_s);
    psi.beta = pm_frac_add(self->psi.beta, v.beta, t_s);
    return pm_park(psi, dir);
}

/* Flux at k of the current (as lambda) and of the magnet in the frame at k. */
static inline void dq_flux_keep(dq_flux_t *self, pm_dq_t lambda, pm_dq_t magnet, pm_dir_t dir)
{
    pm_dq_t psi;
    psi.d = pm_mulh_sub(lambda.d, lambda.d, self->loss_d) + magnet.d;
    psi.q = pm_mulh_sub(lambda.q, lambda.q, self->loss_q) + magnet.q;
    self->psi = pm_park_inverse(psi, dir);
    self->dir = dir;
}

#ifdef __cplusplus
}
#endif

#endif
