#include "injection/pulsating_sine.h"

#include "firmware/math/root.h"

void pulsating_sine_reset(pulsating_sine_t *self, const pulsating_sine_config_t *config, const obs_in_t *in)
{
    sine_reset(&self->sine, &config->sine, in->i_dq);
    self->phase = pm_dir(0);
    self->gain = config->saliency.gain_0;
    self->lambda = 0;
    self->h = (pm_dq_t){config->h_d, 0};
    self->eps = 0;
    self->misfit = 0;
}

void pulsating_sine_step(pulsating_sine_t *self, const pulsating_sine_config_t *config,
                         const injection_in_t *in, injection_out_t *out)
{
    const pm_angle_t phi = sine_step(&self->sine, &config->sine, pm_park(in->i, in->dir));
    if (sine_ready(&self->sine)) {
        const pm_dq_t h = sine_in_phase(&self->sine, &config->sine, self->phase);
        self->h = h;
        self->eps = pm_small_gain(pm_small(h.q + pm_unit(h.d, self->lambda)), self->gain);
    }
    out->eps = self->eps;
    out->i = sine_mean(&self->sine, &config->sine);
    out->carrier =
        (excitation_t){.v = carrier_pulsating(sine_amplitude(&config->sine), pm_dir(phi), in->ahead)};
}

void pulsating_sine_slow(pulsating_sine_t *self, const pulsating_sine_config_t *config, const obs_in_t *in)
{
    const pm_q_t i_q = in->i_dq.q;
    self->gain = saliency_gain(&config->saliency, i_q);
    self->lambda = pm_shl(pm_sat(saliency_lambda(&config->saliency, i_q), PM_Q_BITS), 31 - PM_Q_BITS);
    if (self->sine.warm == 0U) {
        const pm_q_t c = window_cosine(&self->sine.window, config->sine.per_n).d;
        const pm_q_t s = window_sine(&self->sine.window, config->sine.per_n).d;
        self->misfit = pm_div(2 * pm_hypot(c, s) - config->h_d, config->h_d);
        if (config->phase_measured) {
            self->phase = sine_phase(c, s);
        }
    }
}

obs_out_t pulsating_sine_last(const pulsating_sine_t *self, const pulsating_sine_config_t *config)
{
    (void)config;
    return (obs_out_t){.eps = self->eps, .misfit = self->misfit, .vector = self->h};
}
