#include "injection/inform.h"

void inform_reset(inform_t *self, const inform_config_t *config, const obs_in_t *in)
{
    axes_reset(&self->axes, &config->axes);
    self->i = in->i;
    self->i_dq = in->i_dq;
}

void inform_step(inform_t *self, const inform_config_t *config, const injection_in_t *in,
                 injection_out_t *out)
{
    const pm_ab_t change = {in->i.alpha - self->i.alpha, in->i.beta - self->i.beta};
    self->i = in->i;
    const pm_dir_t axis = axes_step(&self->axes, &config->axes, in->dir, change);
    if (axes_pair_done(&self->axes)) {
        self->i_dq = pm_park(in->i, in->dir);
    }
    out->eps = self->axes.eps;
    out->i = self->i_dq;
    out->carrier = (excitation_t){.v = carrier_along(config->v_h, axis)};
}

void inform_slow(inform_t *self, const inform_config_t *config, const obs_in_t *in)
{
    axes_slow(&self->axes, &config->axes, in);
}

obs_out_t inform_last(const inform_t *self, const inform_config_t *config)
{
    (void)config;
    return axes_last(&self->axes);
}
