#include "injection/zero_rotating.h"

#if PM_CARRIES(NEEDS_NEUTRAL)

static pm_dir_t direction(const zero_t *self, const zero_config_t *config)
{
    const pm_dir_t phi = pm_dir((pm_angle_t)self->at * config->step);
    const pm_dir_t r = {phi.cos * self->sign, phi.sin * self->sign};
    return r;
}

/* e^{j phi_k-2} of e^{j phi_k}: back by two steps. */
static zero_sequence_sample_t told(zero_t *self, const zero_config_t *config, const injection_in_t *in,
                                   pm_q_t x)
{
    const pm_half_dir_t twice = pm_dir_sum(in->dir, in->dir);
    const pm_dir_t phi = pm_dir((pm_angle_t)self->at * config->step - 2U * config->step);
    const pm_q_t cos =
        pm_shl(pm_mulh2(twice.cos, phi.cos, -twice.sin, phi.sin), 2) * self->sign; /* of q, Q31 */
    const pm_q_t sin = pm_shl(pm_mulh2(twice.sin, phi.cos, twice.cos, phi.sin), 2) * self->sign;
    self->told.d += self->rate.d;
    self->told.q += self->rate.q;
    const pm_q_t known = self->a + self->told.d;
    const zero_sequence_sample_t sample = {x + pm_unit(known, cos) + pm_unit(self->told.q, sin),
                                           pm_unit(self->s_told, sin)};
    return sample;
}

void zero_rotating_step(zero_rotating_t *self, const zero_rotating_config_t *config, const injection_in_t *in,
                        injection_out_t *out)
{
    const pm_q_t x = zero_voltage(self, config, in);
    const pm_dir_t axis = direction(self, config);
    const zero_sequence_sample_t sample =
        self->measured != 0U ? zero_measured(self, config, in, x) : told(self, config, in, x);
    zero_close(self, config, in, sample, out);
    out->carrier = excitation_of(carrier_along(pm_mulh(config->v_h, PM_FRAC(0.125)), axis));
}

#endif
