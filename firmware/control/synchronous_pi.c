#include "firmware/control/synchronous_pi.h"

#include "firmware/control/voltage_circle.h"
#include "firmware/math/compiler.h"
#include "firmware/math/pair.h"

/* Of the EMF that a current and the magnet cause; the model in registers. */
static inline pm_wide_t feed_forward_d(pm_wide_t sum, pm_q_t L_q, pm_q_t i_q, pm_q_t omega)
{
    const int32_t psi_q = pm_shl(pm_mulh(L_q, i_q), 2); /* Q26: with omega, Q22 */
    return pm_mulh_sub(sum, omega, psi_q);
}

static inline pm_wide_t feed_forward_q(pm_pair_t model, pm_q_t i_d, pm_q_t omega)
{
    const pm_q_t psi_d = model.second + pm_mul(model.first, i_d);
    return pm_half(pm_half(pm_mulh(omega, psi_d))); /* Q24 to Q22 */
}

void synchronous_pi_reset(synchronous_pi_t *self, const synchronous_pi_config_t *config, pm_dq_t v, pm_dq_t i,
                          pm_q_t omega)
{
    const pm_pair_t model = pm_pair(&config->L_d, &config->psi_m);
    self->d.integral = pm_widen(v.d) - feed_forward_d(0, config->L_q, i.q, omega);
    self->q.integral = pm_widen(v.q) - feed_forward_q(model, i.d, omega);
}

void synchronous_pi_step(synchronous_pi_t *self, const synchronous_pi_config_t *config,
                         const regulator_in_t *in, regulator_out_t *out)
{
    const pm_dq_t i = in->i;
    const pm_dq_t e = {.d = in->i_ref.d - i.d, .q = in->i_ref.q - i.q};
    const pm_pair_t integral = pm_pair(&self->d.integral, &self->q.integral);

    const pm_pair_t d = pm_pair(&config->d.kp, &config->d.ki);
    const pm_wide_t u_d =
        feed_forward_d(pm_gain_add(integral.first, e.d, d.first), config->L_q, i.q, in->omega);
    pm_wide_t integral_d = pm_gain_add(integral.first, e.d, d.second);

    const pm_pair_t q = pm_pair(&config->q.kp, &config->q.ki);
    const pm_pair_t model = pm_pair(&config->L_d, &config->psi_m);
    const pm_wide_t u_q = pm_gain_add(integral.second, e.q, q.first) + feed_forward_q(model, i.d, in->omega);
    pm_wide_t integral_q = pm_gain_add(integral.second, e.q, q.second);

    const pm_wide_t top = pm_widen(in->v_max);
    pm_dq_t u = {.d = u_d, .q = u_q};
    if (pm_rarely(voltage_beyond(u, top))) { /* each integral follows its limited voltage */
        u = voltage_within(u, top);
        integral_d = pm_pi_following(&config->d, integral_d, u.d - u_d);
        integral_q = pm_pi_following(&config->q, integral_q, u.q - u_q);
        out->limited = true;
    }
    self->d.integral = integral_d;
    self->q.integral = integral_q;
    out->v = u;
}

static void slow_down(pm_pi_config_t *pi, pm_unit_t share)
{
    pi->kp = pm_unit(pi->kp, share);
    pi->ki = pm_unit(pi->ki, share);
}

/* kp and ki are proportional to the bandwidth; the integrals are voltages and stay. */
void synchronous_pi_slow_down(synchronous_pi_config_t *config, pm_unit_t share)
{
    slow_down(&config->d, share);
    slow_down(&config->q, share);
}
