#include "observers/model.h"

#include "firmware/math/compiler.h"

PM_RARE pm_q_t observer_active_flux(const observer_model_t *model, pm_dq_t i)
{
    const pm_q_t cross = pm_add_sat(pm_half(model->L_qd), pm_mul(model->L_qd2, i.d));
    const pm_q_t reluctance = pm_mul(pm_sub_sat(model->L_d, observer_L_q(model, i)), i.d);
    const pm_q_t psi = pm_add_sat(pm_add_sat(model->psi_m, reluctance), pm_mul(cross, pm_mul(i.q, i.q)));
    return pm_max(psi, model->psi_m / 4);
}

PM_RARE pm_q_t observer_L_q(const observer_model_t *model, pm_dq_t i)
{
    const pm_q_t k = pm_add_sat(model->L_qd, pm_mul(model->L_qd2, i.d));
    pm_q_t i_q = i.q;
    for (uint32_t n = model->lift; n > 0U; n--) {
        i_q = pm_shl_sat(i_q, 1, PM_Q_BITS + 1);
    }
    const pm_q_t along_q = pm_add_sat(model->L_q, pm_mul(model->L_q2, pm_mul(i_q, i_q)));
    return pm_max(pm_add_sat(along_q, pm_mul(k, i.d)), model->L_q / 16);
}

pm_q_t observer_amplitude(const observer_model_t *model, pm_dq_t i, pm_q_t reference, pm_q_t lack,
                          pm_q_t *psi_a)
{
    const pm_q_t past = *psi_a;
    const pm_q_t now = observer_active_flux(model, i);
    const pm_q_t half = pm_half(now);
    *psi_a = now;
    return pm_clamp(reference + (now - past) - pm_frac(lack, PM_FRAC(0.01)), half, now + half);
}

pm_q_t observer_resistance(const observer_resistance_t *config, const observer_model_t *model, pm_q_t R,
                           pm_q_t omega, pm_q_t error, pm_q_t i_q)
{
    const pm_q_t drop = pm_mul(model->R, pm_abs(i_q));
    if (pm_abs(omega) >= config->omega || drop < config->drop + pm_mul(pm_abs(omega), model->psi_m)) {
        return R;
    }
    return pm_clamp(R + pm_narrow(pm_gain(pm_mul(error, i_q), config->k)), pm_half(model->R),
                    pm_add_sat(model->R, model->R));
}
