#include "firmware/control/current_control.h"

#include "firmware/math/root.h"

void current_control_reset(current_control_t *self, pm_dq_t v)
{
    self->d.integral = pm_widen(v.d);
    self->q.integral = pm_widen(v.q);
}

void current_control_step(current_control_t *self, const current_control_config_t *config, pm_dq_t i,
                          pm_dq_t i_ref, pm_q_t omega, pm_q_t v_max, current_control_out_t *out)
{
    const pm_q_t e_d = i_ref.d - i.d;
    const pm_q_t e_q = i_ref.q - i.q;
    const pm_q_t ff_d = -pm_mul(omega, pm_mul(config->L_q, i.q));
    const pm_q_t ff_q = pm_mul(omega, pm_mul(config->L_d, i.d) + config->psi_m);
    const pm_wide_t u_d = pm_pi_output(&self->d, &config->d, e_d, ff_d);
    const pm_wide_t u_q = pm_pi_output(&self->q, &config->q, e_q, ff_q);

    const pm_wide_t limit = pm_widen(v_max);
    pm_q_t v_d = pm_narrow(pm_clamp(u_d, -limit, limit));
    pm_q_t v_q = pm_narrow(pm_clamp(u_q, -limit, limit));
    const int32_t room = pm_mulh(v_max, v_max) - pm_mulh(v_d, v_d);
    if (pm_mulh(v_q, v_q) > room) {
        const pm_q_t top = pm_sqrt(pm_shl(room, 32 - PM_Q_BITS));
        v_q = v_q < 0 ? -top : top;
    }
    const pm_wide_t excess_d = pm_widen(v_d) - u_d;
    const pm_wide_t excess_q = pm_widen(v_q) - u_q;
    pm_pi_update(&self->d, &config->d, e_d, excess_d);
    pm_pi_update(&self->q, &config->q, e_q, excess_q);

    out->v = (pm_dq_t){.d = v_d, .q = v_q};
    out->limited = (excess_d | excess_q) != 0;
}
