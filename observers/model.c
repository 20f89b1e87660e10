#include "observers/model.h"

pm_q_t observer_active_flux(const observer_model_t *model, pm_q_t i_d)
{
    return model->psi_m + pm_mul(model->L_d - model->L_q, i_d);
}

pm_q_t observer_L_q(const observer_model_t *model, pm_q_t i_q)
{
    return model->L_q + pm_mul(model->L_q2, pm_mul(i_q, i_q));
}

pm_q_t observer_resistance(const observer_resistance_t *config, pm_q_t R, pm_q_t omega, pm_q_t lack)
{
    if (pm_abs(omega) >= config->omega) {
        return R;
    }
    return pm_clamp(R + pm_narrow(pm_gain(lack, config->k)), config->min, config->max);
}
