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
