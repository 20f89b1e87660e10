#include "injection/pwm_excitation.h"

#include "firmware/math/image.h"

#if PM_CARRIES(NEEDS_HALVES) && PM_CARRIES(NEEDS_SECOND_SAMPLE)

void pwm_excitation_reset(pwm_excitation_t *self, const pwm_excitation_config_t *config, const obs_in_t *in)
{
    axes_reset(&self->axes, &config->axes);
    self->i = in->i;
}

void pwm_excitation_step(pwm_excitation_t *self, const pwm_excitation_config_t *config,
                         const injection_in_t *in, injection_out_t *out)
{
    const pm_ab_t i = in->i;
    pm_ab_t change = {0, 0};
    if (pm_sampled(in->more->codes, 0)) {
        const pm_ab_t mid = in->more->i_sample[0];
        change.alpha = mid.alpha - pm_half(self->i.alpha + i.alpha);
        change.beta = mid.beta - pm_half(self->i.beta + i.beta);
    }
    self->i = i;
    const pm_dir_t axis = axes_step(&self->axes, &config->axes, in->dir, change);
    out->eps = self->axes.eps;
    out->i = pm_park(i, in->dir);
    out->carrier = (excitation_t){.split = carrier_along(config->v_h, axis), .sample_at = {config->between}};
}

void pwm_excitation_slow(pwm_excitation_t *self, const pwm_excitation_config_t *config, const obs_in_t *in)
{
    axes_slow(&self->axes, &config->axes, in);
}

obs_out_t pwm_excitation_last(const pwm_excitation_t *self, const pwm_excitation_config_t *config)
{
    (void)config;
    return axes_last(&self->axes);
}

#endif
