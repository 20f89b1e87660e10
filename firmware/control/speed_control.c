#include "firmware/control/speed_control.h"

void speed_control_reset(speed_control_t *self, pm_q_t omega, pm_q_t i_q)
{
    self->reference = omega;
    self->pi.integral = pm_widen(i_q);
}

pm_q_t speed_control_step(speed_control_t *self, const speed_control_config_t *config, pm_q_t target,
                          pm_q_t omega, pm_q_t i_min, pm_q_t i_max, bool *limited)
{
    const pm_q_t step = pm_clamp(target - self->reference, -config->slope, config->slope);
    self->reference += step;
    pm_q_t feed_forward = 0;
    if (step == config->slope) {
        feed_forward = config->i_per_slope;
    } else if (step == -config->slope) {
        feed_forward = -config->i_per_slope;
    }
    const pm_q_t error = self->reference - omega;
    const pm_wide_t u = pm_pi_output(&self->pi, &config->pi, error, feed_forward);
    const pm_wide_t u_limited = pm_clamp(u, pm_widen(i_min), pm_widen(i_max));
    pm_pi_update(&self->pi, &config->pi, error, u_limited - u);
    *limited = u_limited != u;
    return pm_narrow(u_limited);
}

void speed_control_follow(speed_control_t *self, const speed_control_config_t *config, pm_q_t i_q, pm_q_t i)
{
    const pm_q_t flows = pm_clamp(i, pm_min(i_q, 0), pm_max(i_q, 0));
    self->pi.integral = pm_pi_following(&config->pi, self->pi.integral, pm_widen(flows - i_q));
}

/* By increments: the integral is what the last i_q has beyond its 2 kp e. */
pm_q_t speed_control_below(speed_control_t *self, const speed_control_config_t *config, pm_q_t top,
                           pm_q_t omega, pm_q_t i_q)
{
    const pm_q_t sign = i_q < 0 ? -1 : 1;
    const pm_q_t e = pm_max(top - sign * omega, -PM_ONE);
    if (e < top / 2) {
        const pm_q_t gained = pm_clamp(sign * (self->reference - omega), -PM_ONE, PM_ONE);
        const pm_wide_t before = sign * self->pi.integral + 2 * pm_gain_add(0, gained, config->pi.kp);
        const pm_wide_t u =
            pm_max(before + 4 * pm_gain_add(0, e, config->pi.ki), 2 * pm_gain_add(0, e, config->pi.kp));
        if (u < pm_widen(sign * i_q)) {
            i_q = sign * pm_narrow(pm_max(u, 0));
        }
    }
    speed_control_reset(self, omega, i_q);
    return i_q;
}
