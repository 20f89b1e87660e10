/* Common part of the flux observers: integration of the stator flux, flux of the current, feedback in the
 * present frame, and the result. Formats as in active_flux_t; each function is a chain of
 * multiply-accumulates without a shift. */
#ifndef OBSERVERS_FLUX_H
#define OBSERVERS_FLUX_H

#include "firmware/math/pair.h"
#include "observers/active_flux.h"

/* psi + T_s v - R T_s i(k-1), Q26; stores the current for the next period. */
static inline pm_ab_t flux_integrate(active_flux_t *self, const obs_in_t *in)
{
    pm_ab_t psi = pm_pair_ab(&self->psi);
    const pm_ab_t past = pm_pair_ab(&self->i);
    const pm_pair_t k = pm_pair(&self->step, &self->drop);
    psi.alpha = pm_mulh_sub(pm_mulh_add(psi.alpha, in->v.alpha, k.first), past.alpha, k.second);
    psi.beta = pm_mulh_sub(pm_mulh_add(psi.beta, in->v.beta, k.first), past.beta, k.second);
    self->i.alpha = in->i.alpha; /* by members: they stay in registers */
    self->i.beta = in->i.beta;
    return psi;
}

/* The state of the next period: psi (Q26) plus a feedback (Q27) in the present frame. Saturates: with the
 * position lost, a voltage at standstill integrates up until the fault. */
static inline void flux_keep(active_flux_t *self, pm_ab_t psi, pm_dq_t back, pm_dir_t dir)
{
    psi.alpha = pm_mulh_add(pm_mulh_add(psi.alpha, back.d, dir.cos), back.q, dir.sin);
    psi.beta = pm_mulh_sub(pm_mulh_add(psi.beta, back.d, dir.sin), back.q, dir.cos);
    const pm_ab_t kept = {pm_sat(psi.alpha, 29), pm_sat(psi.beta, 29)};
    self->psi = kept;
}

static inline pm_q_t flux_relative(const active_flux_t *self, int32_t flux)
{
    const unsigned lift = PM_Q_BITS - (25 + 26 - 32);
    return pm_shl(pm_sat(pm_mulh(flux, self->inverse), 19), lift);
}

static inline void flux_describe(const active_flux_t *self, pm_dq_t active, obs_out_t *out)
{
    const pm_dq_t vector = {pm_shl(active.d, 3), pm_shl(active.q, 3)};
    out->vector = vector;
    out->eps = flux_relative(self, active.q);
    out->misfit = flux_relative(self, self->reference - active.d);
}

#endif
