#include "injection/zero_pulsating.h"

#if PM_CARRIES(NEEDS_NEUTRAL)

/* sin 3 theta, Q29. */
static inline int32_t sine_of_three(pm_dir_t dir)
{
    const pm_half_dir_t twice = pm_dir_sum(dir, dir);
    return pm_mulh2(twice.sin, dir.cos, twice.cos, dir.sin);
}

void zero_pulsating_step(zero_pulsating_t *self, const zero_pulsating_config_t *config,
                         const injection_in_t *in, injection_out_t *out)
{
    const pm_q_t x = zero_voltage(self, config, in);
    const pm_dq_t i = pm_park_half(in->i, in->dir);
    const pm_unit_t next = zero_cosine(self, config);
    zero_sequence_sample_t sample;
    if (self->measured != 0U) {
        sample = zero_measured(self, config, in, i, x);
    } else {
        const pm_unit_t r = zero_swing(self, next);
        sample.d = x;
        sample.s = pm_shl(pm_mulh(pm_unit(self->s_told, r), sine_of_three(in->dir)), 3);
    }
    zero_close(self, config, i, sample, out);
    out->carrier = excitation_of(carrier_along_d(zero_amplitude(config, next), in->ahead));
}

#endif
