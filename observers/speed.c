#include "observers/speed.h"

#include "firmware/math/filter.h"
#include "firmware/math/pll.h"
#include "firmware/math/root.h"

static uint32_t turn_of(const speed_config_t *config, pm_q_t omega, uint32_t steps)
{
    const uint32_t periods = config->turn_step * steps;
    return (uint32_t)pm_omega_to_angle(omega, config->k_theta) * periods;
}

void speed_reset(speed_t *self, const speed_config_t *config, pm_angle_t theta, pm_q_t omega)
{
    *self = (speed_t){.omega_d = omega, .omega_e = omega, .omega = omega};
    for (uint32_t n = 0; n < config->window; n++) {
        self->past[n] = theta - turn_of(config, omega, config->window - 1U - n);
    }
}

/* theta(k-N) stands where theta(k) goes. */
static pm_q_t difference(speed_t *self, const speed_config_t *config, const speed_in_t *in)
{
    const pm_angle_t past = self->past[self->next];
    self->past[self->next] = in->theta;
    self->next = self->next + 1U < config->window ? self->next + 1U : 0U;
    const int32_t rest = (int32_t)(in->theta - past - turn_of(config, in->omega, config->window));
    return in->omega + pm_shl(pm_sat(pm_mulh(rest, config->per_turn), PM_Q_BITS - 1), 2);
}

static pm_q_t ratio(const observer_model_t *model, const speed_in_t *in)
{
    const pm_q_t psi = model->psi_m + pm_mul(model->L_d, in->i.d);
    const pm_q_t e_q = in->v_q - pm_mul(model->R, in->i.q);
    return pm_sat(pm_div(e_q, pm_max(psi, model->psi_m / 4)), PM_Q_BITS + 1);
}

pm_q_t speed_step(speed_t *self, const speed_config_t *config, const observer_model_t *model,
                  const speed_in_t *in)
{
    self->omega_d = difference(self, config, in);
    (void)pm_lp1(&self->omega_e, ratio(model, in), config->k_ratio);
    (void)pm_lp1(&self->difference, self->omega_d - self->omega_e, config->k_mean);
    switch (config->id) {
    case SPEED_DIFFERENCE:
        self->omega = self->omega_d;
        break;
    case SPEED_EMF_RATIO:
        self->omega = self->omega_e;
        break;
    case SPEED_COMBINED:
        self->omega = pm_sat(self->omega_e + self->difference, PM_Q_BITS + 1);
        break;
    case SPEED_LOOP:
    case SPEED_COUNT:
    default:
        self->omega = in->omega;
        break;
    }
    return self->omega;
}
