#include "firmware/control/current_control.h"

#include "firmware/math/compiler.h"
#include "firmware/math/pair.h"
#include "firmware/math/root.h"

void current_control_reset(current_control_t *self, pm_dq_t v)
{
    self->d.integral = pm_widen(v.d);
    self->q.integral = pm_widen(v.q);
}

/* The d-axis has priority; the q-axis gets the rest of the circle. */
static inline pm_dq_t limited(pm_dq_t u, pm_wide_t top)
{
    const pm_wide_t d = pm_clamp(u.d, -top, top);
    const pm_q_t v_max = pm_narrow(top);
    const pm_q_t v_d = pm_narrow(d);
    const int32_t room = pm_mulh(v_max, v_max) - pm_mulh(v_d, v_d);
    const pm_wide_t left = pm_sqrt_wide(room);
    return (pm_dq_t){.d = d, .q = pm_clamp(u.q, -left, left)};
}

void current_control_step(current_control_t *self, const current_control_config_t *config, pm_dq_t i,
                          pm_dq_t i_ref, pm_q_t omega, pm_q_t v_max, current_control_out_t *out)
{
    const pm_dq_t e = {.d = i_ref.d - i.d, .q = i_ref.q - i.q};
    const pm_pair_t integral = pm_pair(&self->d.integral, &self->q.integral);

    const pm_pair_t d = pm_pair(&config->d.kp, &config->d.ki);
    const int32_t psi_q = pm_shl(pm_mulh(config->L_q, i.q), 2); /* Q26: with omega, Q22 */
    const pm_wide_t u_d = pm_mulh_sub(pm_gain_add(integral.first, e.d, d.first), omega, psi_q);
    pm_wide_t integral_d = pm_gain_add(integral.first, e.d, d.second);

    const pm_pair_t q = pm_pair(&config->q.kp, &config->q.ki);
    const pm_pair_t model = pm_pair(&config->L_d, &config->psi_m);
    const pm_q_t psi_d = model.second + pm_mul(model.first, i.d);
    const pm_wide_t ff_q = pm_half(pm_half(pm_mulh(omega, psi_d))); /* Q24 to Q22 */
    const pm_wide_t u_q = pm_gain_add(integral.second, e.q, q.first) + ff_q;
    pm_wide_t integral_q = pm_gain_add(integral.second, e.q, q.second);

    const pm_wide_t top = pm_widen(v_max);
    pm_dq_t u = {.d = u_d, .q = u_q};
    out->limited = pm_mulh2(u_d, u_d, u_q, u_q) >= pm_mulh(top, top);
    if (pm_rarely(out->limited)) { /* each integral follows its limited voltage */
        u = limited(u, top);
        integral_d = pm_pi_following(&config->d, integral_d, u.d - u_d);
        integral_q = pm_pi_following(&config->q, integral_q, u.q - u_q);
        self->limited = true;
    }
    self->d.integral = integral_d;
    self->q.integral = integral_q;
    out->wide = u;
    out->v = (pm_dq_t){.d = pm_narrow(u.d), .q = pm_narrow(u.q)};
}
