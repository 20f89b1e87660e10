#include "observers/dq_flux.h"

#include "firmware/math/root.h"

static void set_axis(int32_t *L_sum, pm_frac_t *loss, pm_q_t L, pm_q_t drop)
{
    const pm_q_t sum = pm_sat(pm_add_sat(L, pm_half(drop)), PM_Q_BITS + 2);
    *L_sum = pm_shl(sum, 1);
    *loss = pm_small(pm_div(drop, sum));
}

void dq_flux_set(dq_flux_t *self, const observer_model_t *model, pm_dq_t i)
{
    const pm_q_t L_q = pm_max(observer_L_q(model, i), PM_Q(0.01));
    const pm_q_t drop = pm_frac(model->R, model->t_s);
    set_axis(&self->L_d, &self->loss_d, model->L_d, drop);
    set_axis(&self->L_q, &self->loss_q, L_q, drop);
    self->psi_a = pm_max(observer_active_flux(model, i), PM_Q(0.01));
    self->eta = pm_mul(model->L_d - L_q, i.q);
}
