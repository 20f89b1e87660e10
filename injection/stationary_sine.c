#include "injection/stationary_sine.h"

#include "firmware/math/root.h"

void stationary_sine_reset(stationary_sine_t *self, const stationary_sine_config_t *config,
                           const obs_in_t *in)
{
    sine_reset(&self->sine, &config->sine, in->i_dq);
    stationary_reset(&self->stationary, &config->stationary, in->omega);
    self->phase = pm_dir(0);
    self->turn = pm_dir(0);
    self->gain = config->saliency.gain_0;
    self->i_p = config->saliency.i_p_0;
    self->y = (pm_dq_t){0, 0};
    self->eps = 0;
    self->misfit = 0;
}

/* The sample without I_p. */
static inline pm_ab_t without(const stationary_sine_t *self, const stationary_sine_config_t *config,
                              pm_ab_t i)
{
    const pm_angle_t phi = carrier_angle(&self->sine.phase, config->sine.step) - config->sine.lag;
    const pm_dir_t at = pm_dir(phi);
    const int32_t swing = pm_mulh2(at.cos, self->phase.cos, at.sin, self->phase.sin); /* Q30 */
    const pm_ab_t known = stationary_axis(&self->stationary, pm_shl(pm_mulh(self->i_p, swing), 2));
    const pm_ab_t left = {i.alpha - known.alpha, i.beta - known.beta};
    return left;
}

void stationary_sine_step(stationary_sine_t *self, const stationary_sine_config_t *config,
                          const injection_in_t *in, injection_out_t *out)
{
    const pm_dq_t left = pm_park(without(self, config, in->i), in->dir);
    const pm_angle_t phi = sine_step(&self->sine, &config->sine, left);
    if (sine_ready(&self->sine)) {
        const pm_dq_t y = sine_in_phase(&self->sine, &config->sine, self->phase);
        const pm_dq_t turned = stationary_turned(&self->stationary, y, in->dir);
        const pm_q_t across = pm_shl(pm_mulh2(turned.q, self->turn.cos, turned.d, self->turn.sin), 1);
        self->y = turned;
        self->eps = pm_small_gain(pm_small(across), self->gain);
    }
    out->eps = self->eps;
    out->i = sine_mean(&self->sine, &config->sine);
    const pm_q_t v = pm_unit(config->sine.v_h, pm_dir(phi).cos);
    out->carrier = (excitation_t){.v = stationary_axis(&self->stationary, v)};
}

/* The whole answer along the axis: its parts with the cosine and the sine of phi'. */
static pm_dq_t whole(const stationary_sine_t *self, const stationary_sine_config_t *config, pm_dir_t dir)
{
    const pm_dq_t c = window_cosine(&self->sine.window, config->sine.per_n);
    const pm_dq_t s = window_sine(&self->sine.window, config->sine.per_n);
    const pm_dq_t r = {
        pm_unit(self->i_p, self->phase.cos) + 2 * stationary_along(&self->stationary, c, dir),
        pm_unit(self->i_p, self->phase.sin) + 2 * stationary_along(&self->stationary, s, dir),
    };
    return r;
}

static void look(stationary_sine_t *self, const stationary_sine_config_t *config, const obs_in_t *in,
                 pm_q_t i_p)
{
    const pm_q_t twice_i_n = 2 * pm_hypot(self->y.d, self->y.q);
    const pm_dq_t answer = whole(self, config, in->dir);
    self->misfit = pm_small_gain(pm_small(twice_i_n), self->gain) - PM_ONE;
    if (config->phase_measured) {
        self->phase = sine_phase(answer.d, answer.q);
    }
    if (stationary_finding(&self->stationary)) {
        /* without what dead time takes: |answer| / cos delta */
        const pm_q_t full =
            pm_div(pm_hypot(answer.d, answer.q), pm_max(pm_unit(PM_ONE, self->phase.cos), PM_Q(0.5)));
        if (stationary_find(&self->stationary, &config->stationary, full, in, i_p)) {
            sine_reset(&self->sine, &config->sine, in->i_dq);
        }
    }
}

void stationary_sine_slow(stationary_sine_t *self, const stationary_sine_config_t *config, const obs_in_t *in)
{
    const pm_q_t i_q = in->i_dq.q;
    const pm_q_t i_p = saliency_i_p(&config->saliency, i_q);
    self->gain = saliency_gain(&config->saliency, i_q);
    if (self->sine.warm == 0U) {
        look(self, config, in, i_p);
    }
    self->i_p = pm_unit(stationary_i_p(&self->stationary, i_p), self->phase.cos);
    const pm_q_t turn = pm_mul(config->tau, in->omega) - 2 * saliency_shift(&config->saliency, i_q);
    self->turn = pm_dir((pm_angle_t)pm_rad_to_angle(turn));
}

obs_out_t stationary_sine_last(const stationary_sine_t *self, const stationary_sine_config_t *config)
{
    (void)config;
    return (obs_out_t){.eps = self->eps, .misfit = self->misfit, .vector = self->y};
}
