#include "observers/mras.h"

#include "firmware/math/root.h"

int32_t mras_inverse(pm_q_t E, pm_q_t least)
{
    const pm_q_t size = pm_max(pm_abs(E), least);
    return pm_div(pm_div(E, size) / 64, size); /* Q28 of a 64th is Q22 */
}

pm_q_t mras_speed(const mras_config_t *config, pm_q_t filtered, const obs_in_t *in, pm_q_t weight)
{
    if (weight == 0) {
        return in->omega;
    }
    const pm_q_t share = pm_shl(pm_sat(pm_frac(pm_abs(in->omega), config->turn), PM_Q_BITS - 1), 3);
    return filtered + pm_unit(in->omega - filtered, share);
}

pm_q_t mras_cross(const mras_config_t *config, pm_q_t omega, pm_dq_t i)
{
    return pm_mul(omega, observer_L_q(&config->model, i) - config->model.L_d);
}
