#include "injection/rotating_sine.h"

#include "firmware/math/root.h"

/* rad: so that p times that fits. */
#define RHO_MOST PM_Q(1)

void rotating_sine_reset(rotating_sine_t *self, const rotating_sine_config_t *config, const obs_in_t *in)
{
    sine_reset(&self->sine, &config->sine, in->i_dq);
    self->turn = pm_dir((pm_angle_t)pm_rad_to_angle(pm_shl(config->rho_0, 1)));
    self->gain = config->saliency.gain_0;
    self->negative = (pm_dq_t){0, 0};
    self->eps = 0;
    self->misfit = 0;
}

#if PM_HAS(counted_carrier)
/* The current of both sequences where phi' is `phase`. */
static pm_dq_t ahead_of(const rotating_sine_t *self, const rotating_sine_config_t *config, pm_dir_t phase)
{
    const pm_dq_t positive = window_positive(&self->sine.window, config->sine.per_n);
    const pm_dq_t negative = self->negative;
    pm_dq_t i;
    i.d = pm_unit(positive.d + negative.d, phase.cos) - pm_unit(positive.q - negative.q, phase.sin);
    i.q = pm_unit(positive.q + negative.q, phase.cos) + pm_unit(positive.d - negative.d, phase.sin);
    return i;
}
#endif

void rotating_sine_step(rotating_sine_t *self, const rotating_sine_config_t *config, const injection_in_t *in,
                        injection_out_t *out)
{
    const pm_angle_t phi = sine_step(&self->sine, &config->sine, pm_park(in->i, in->dir));
    const pm_dq_t negative = window_negative(&self->sine.window, config->sine.per_n);
    self->negative = negative;
    if (sine_ready(&self->sine)) {
        const pm_q_t across = pm_shl(pm_mulh2(negative.q, self->turn.cos, negative.d, self->turn.sin), 1);
        self->eps = pm_small_gain(pm_small(across), self->gain);
    }
    out->eps = self->eps;
    out->i = sine_mean(&self->sine, &config->sine);
    out->carrier =
        (excitation_t){.v = carrier_rotating(sine_amplitude(&config->sine), pm_dir(phi), in->ahead)};
#if PM_HAS(counted_carrier)
    if (config->counted_in) {
        out->carrier.i = ahead_of(self, config, pm_dir(phi - config->sine.lag + config->sine.ahead));
    }
#endif
}

/* p of the header. */
static pm_q_t share(const rotating_sine_t *self, const rotating_sine_config_t *config, pm_dq_t i, pm_q_t i_p)
{
    pm_q_t p = PM_Q(0.75);
    if (config->with_load) {
        const pm_q_t load = pm_mul(i.d, i.d) + pm_mul(i.q, i.q);
        const pm_q_t all = load + pm_mul(i_p, i_p);
        /* 1 / (2 kappa), below 8; Q16 */
        const pm_q_t per_kappa = pm_shl(pm_sat(pm_mulh(i_p, self->gain), 19), PM_Q_BITS - 16);
        p += pm_mul(per_kappa - PM_Q(0.75), pm_div(load, pm_max(all, 1)));
    }
    return p;
}

void rotating_sine_slow(rotating_sine_t *self, const rotating_sine_config_t *config, const obs_in_t *in)
{
    const pm_q_t i_q = in->i_dq.q;
    const pm_q_t i_p = saliency_i_p(&config->saliency, i_q);
    const pm_dq_t positive = window_positive(&self->sine.window, config->sine.per_n);
    pm_q_t rho = config->rho_0;
    self->gain = saliency_gain(&config->saliency, i_q);
    if (self->sine.warm == 0U) {
        self->misfit = pm_div(pm_hypot(positive.d, positive.q) - i_p, i_p);
        if (config->positive_sequence) {
            const pm_q_t measured = pm_angle_to_rad((int32_t)pm_atan2(positive.q, positive.d));
            const pm_q_t seen = pm_clamp(measured - config->rho_m0, -RHO_MOST, RHO_MOST);
            const pm_q_t beyond = pm_mul(share(self, config, in->i_dq, i_p), seen);
            rho += pm_clamp(beyond, -config->most, config->most);
        }
    }
    const pm_q_t turn = rho - saliency_shift(&config->saliency, i_q);
    self->turn = pm_dir((pm_angle_t)pm_rad_to_angle(pm_shl(turn, 1)));
}

obs_out_t rotating_sine_last(const rotating_sine_t *self, const rotating_sine_config_t *config)
{
    (void)config;
    return (obs_out_t){.eps = self->eps, .misfit = self->misfit, .vector = self->negative};
}
