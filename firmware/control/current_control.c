#include "firmware/control/current_control.h"

#include "firmware/math/root.h"

void current_control_reset(current_control_t *self, pm_dq_t v)
{
    self->d.integral = pm_widen(v.d);
    self->q.integral = pm_widen(v.q);
}

/* The d-axis takes what it needs, the q-axis what is left; each integral follows its limited voltage. */
static void limit(current_control_t *self, const current_control_config_t *config, pm_dq_t e, pm_wide_t u_d,
                  pm_wide_t u_q, pm_q_t v_max, current_control_out_t *out)
{
    const pm_wide_t top = pm_widen(v_max);
    pm_dq_t v = {.d = pm_narrow(pm_clamp(u_d, -top, top)), .q = pm_narrow(pm_clamp(u_q, -top, top))};
    const int32_t room = pm_mulh(v_max, v_max) - pm_mulh(v.d, v.d);
    if (pm_mulh(v.q, v.q) > room) {
        const pm_q_t left = pm_sqrt(pm_shl(room, 32 - PM_Q_BITS));
        v.q = v.q < 0 ? -left : left;
    }
    pm_pi_update(&self->d, &config->d, e.d, pm_widen(v.d) - u_d);
    pm_pi_update(&self->q, &config->q, e.q, pm_widen(v.q) - u_q);
    out->v = v;
    out->limited = true;
}

void current_control_step(current_control_t *self, const current_control_config_t *config, pm_dq_t i,
                          pm_dq_t i_ref, pm_q_t omega, pm_q_t v_max, current_control_out_t *out)
{
    const pm_dq_t e = {.d = i_ref.d - i.d, .q = i_ref.q - i.q};
    const pm_q_t ff_d = -pm_mul(omega, pm_mul(config->L_q, i.q));
    const pm_q_t ff_q = pm_mul(omega, pm_mul(config->L_d, i.d) + config->psi_m);
    const pm_wide_t u_d = pm_pi_output(&self->d, &config->d, e.d, ff_d);
    const pm_wide_t u_q = pm_pi_output(&self->q, &config->q, e.q, ff_q);

    const pm_wide_t top = pm_widen(v_max);
    if (pm_mulh2(u_d, u_d, u_q, u_q) >= pm_mulh(top, top)) {
        limit(self, config, e, u_d, u_q, v_max, out);
        return;
    }
    pm_pi_update(&self->d, &config->d, e.d, 0);
    pm_pi_update(&self->q, &config->q, e.q, 0);
    out->v = (pm_dq_t){.d = pm_narrow(u_d), .q = pm_narrow(u_q)};
    out->limited = false;
}
