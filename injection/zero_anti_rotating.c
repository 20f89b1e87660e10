#include "injection/zero_anti_rotating.h"

#if PM_CARRIES(NEEDS_NEUTRAL)

void zero_anti_rotating_step(zero_anti_rotating_t *self, const zero_anti_rotating_config_t *config,
                             const injection_in_t *in, injection_out_t *out)
{
    const pm_q_t x = zero_voltage(self, config, in);
    const pm_unit_t next = zero_cosine(self, config);
    zero_sample_t sample;
    if (self->measured != 0U) {
        sample = zero_measured(self, config, in, x);
    } else {
        const pm_unit_t r = zero_swing(self, next);
        self->told.q += self->rate.q;
        sample.d = x + pm_unit(self->told.q, r);
        sample.s = pm_unit(self->s_told - pm_shl(self->told.d, 2), r);
    }
    zero_close(self, config, in, sample, out);
    out->carrier = (excitation_t){.v = carrier_anti_rotating(zero_amplitude(config, next), in->ahead)};
}

#endif
