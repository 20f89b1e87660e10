#include "observers/speed.h"

#include "firmware/math/filter.h"
#include "firmware/math/pll.h"
#include "firmware/math/root.h"

static uint32_t turn_of(const speed_config_t *config, pm_q_t omega, uint32_t steps)
{
    const uint32_t periods = (uint32_t)config->turn_step * steps;
    return (uint32_t)pm_omega_to_angle(omega, config->k_theta) * periods;
}

static void reset(speed_t *self, const speed_config_t *config, const speed_in_t *in)
{
    *self = (speed_t){.i_q = in->i.q, .omega_e = in->omega, .ready = true};
    for (uint32_t n = 0; n < config->window; n++) {
        self->past[n] = in->theta - turn_of(config, in->omega, config->window - 1U - n);
    }
}

/* theta(k-N) is in the place that theta(k) takes. */
static pm_q_t of_difference(speed_t *self, const speed_config_t *config, const speed_in_t *in)
{
    const pm_angle_t past = self->past[self->next];
    self->past[self->next] = in->theta;
    self->next = self->next + 1U < config->window ? (uint8_t)(self->next + 1U) : 0U;
    const int32_t rest = (int32_t)(in->theta - past - turn_of(config, in->omega, config->window));
    return in->omega + pm_shl(pm_sat(pm_mulh(rest, config->per_turn), PM_Q_BITS - 1), 2);
}

static pm_q_t ratio(speed_t *self, const speed_config_t *config, const speed_in_t *in)
{
    const pm_q_t psi = config->psi_m + pm_mul(config->L_d, in->i.d);
    const pm_q_t rise = pm_narrow_sat(pm_gain(in->i.q - self->i_q, config->rise));
    const pm_q_t v_q = pm_narrow_sat(pm_gain(self->v_sum, config->per_step));
    const pm_q_t e_q = v_q - pm_mul(config->R, pm_mean(in->i.q, self->i_q)) - rise;
    self->i_q = in->i.q;
    self->v_sum = 0;
    return pm_sat(pm_div(e_q, pm_max(psi, config->psi_m / 4)), PM_Q_BITS + 1);
}

pm_q_t speed_step(speed_t *self, const speed_config_t *config, const speed_in_t *in)
{
    if (config->id == SPEED_LOOP) {
        self->ready = false;
        self->v_sum = 0;
        return in->omega;
    }
    if (!self->ready) {
        reset(self, config, in);
        return in->omega;
    }
    const pm_q_t omega_d = of_difference(self, config, in);
    (void)pm_lp1(&self->omega_e, ratio(self, config, in), config->k_ratio);
    (void)pm_lp1(&self->difference, omega_d - self->omega_e, config->k_mean);
    if (config->id == SPEED_DIFFERENCE) {
        return omega_d;
    }
    if (config->id == SPEED_EMF_RATIO) {
        return self->omega_e;
    }
    return pm_sat(self->omega_e + self->difference, PM_Q_BITS + 1);
}
