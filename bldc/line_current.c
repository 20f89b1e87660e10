#include "bldc/line_current.h"

#include "firmware/math/compiler.h"
#include "firmware/math/root.h"

void line_current_reset(line_current_t *self, const line_current_config_t *config, pm_q_t i)
{
    *self = (line_current_t){.pi = {.integral = pm_widen(pm_mul(config->R_2, i))}, .i_ref = i};
}

void line_current_prepare(line_current_t *self, pm_q_t i_ref, pm_q_t emf, pm_q_t v_dc)
{
    self->i_ref = i_ref;
    self->emf = emf;
    self->per_v = pm_div(PM_ONE / 4, v_dc);
    self->given = false;
}

void line_current_give(line_current_t *self, pm_q_t duty, pm_q_t i_min)
{
    self->given = true;
    self->duty = duty;
    self->i_span = self->i_ref - i_min;
}

void line_current_step(line_current_t *self, const line_current_config_t *config, pm_q_t i, pm_q_t v_dc)
{
    const pm_q_t e = self->i_ref - i;
    const pm_wide_t v = pm_pi_output(&self->pi, &config->pi, e, self->emf);
    pm_wide_t duty = 0, wanted = v;
    if (pm_rarely(self->given)) {
        duty = pm_widen(pm_mul(self->duty, v_dc));
        wanted = pm_clamp(duty, v - pm_gain(self->i_span, config->pi.kp), v);
        self->held = self->held || wanted != duty;
    }
    const pm_wide_t given = pm_clamp(wanted, 0, pm_widen(pm_mul(v_dc, config->most)));
    self->limited |= (uint32_t)(given - wanted);
    pm_pi_update(&self->pi, &config->pi, e, given - v);
    self->u = pm_min(pm_narrow_sat(pm_gain(pm_narrow(given), self->per_v)), config->most);
    if (pm_rarely(self->given) && given == duty) {
        self->u = self->duty; /* of the link as it is, not as it was at 1 kHz */
    }
}
