#include "injection/zero_rotating.h"

#if PM_CARRIES(NEEDS_NEUTRAL)

#include "firmware/math/root.h"
#include "firmware/math/window.h"

/* Periods from a command to the sample that ends with its voltage. */
#define SINCE 2U
/* An answer of less than one over this of what it should be may be none. */
#define PER_LEAST 4

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
    const pm_dir_t phi = pm_dir(((pm_angle_t)self->at - SINCE) * config->step);
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

void zero_rotating_reset(zero_rotating_t *self, const zero_rotating_config_t *config, const obs_in_t *in)
{
    zero_reset(&self->zero, config, in);
    for (uint32_t n = 0; n < 2U * ZERO_HALF_MOST; n++) {
        self->x[n] = 0;
    }
}

void zero_rotating_step(zero_rotating_t *self, const zero_rotating_config_t *config, const injection_in_t *in,
                        injection_out_t *out)
{
    zero_t *zero = &self->zero;
    const pm_q_t x = zero_voltage(zero, config, in);
    const pm_dq_t i = pm_park_half(in->i, in->dir);
    const pm_dir_t axis = direction(zero, config);
    const zero_sequence_sample_t sample =
        zero->measured != 0U ? zero_measured(zero, config, in, i, x) : told(zero, config, in, x);
    self->x[zero->at + (zero->sign < 0 ? config->half : 0U)] = x;
    zero_close(zero, config, i, sample, out);
    out->carrier = excitation_of(carrier_along(pm_mulh(config->v_h, PM_FRAC(0.125)), axis));
}

/* m, at most 1. */
static pm_q_t answer(const zero_rotating_t *self, const zero_rotating_config_t *config)
{
    int32_t sum = 0;
    for (uint32_t n = 0; n < config->half; n++) {
        const pm_q_t change = self->x[n] - self->x[n + config->half];
        sum += pm_mulh(change, change);
    }
    return pm_sqrt(4 * pm_min(pm_div(sum, self->zero.power), PM_ONE / 4));
}

void zero_rotating_slow(zero_rotating_t *self, const zero_rotating_config_t *config, const obs_in_t *in)
{
    zero_slow(&self->zero, config, in);
    const pm_q_t misfit = PER_LEAST * answer(self, config) - PM_ONE;
    if (self->zero.warm == 0U && misfit < 0) {
        self->zero.misfit = misfit;
    }
}

/* 2/N sum x cos(angle + turn n), n = 0 in the period whose voltage has the phase 0; 1/N, Q32, is the step of the phase. */
static pm_q_t harmonic(const zero_rotating_t *self, const zero_rotating_config_t *config, pm_angle_t turn,
                       pm_angle_t angle)
{
    int64_t sum = 0;
    for (uint32_t n = 0; n < 2U * config->half; n++) {
        sum += (int64_t)pm_mulh(self->x[n], PM_FRAC(1.0 / 16)) * pm_dir(angle + turn * (n - SINCE)).cos;
    }
    return 2 * window_amplitude(sum, (pm_frac_t)config->step);
}

pm_q_t zero_rotating_along(const zero_rotating_t *self, const zero_rotating_config_t *config,
                           pm_angle_t theta)
{
    return -harmonic(self, config, config->step, 2U * theta);
}

pm_ab_t zero_rotating_second(const zero_rotating_t *self, const zero_rotating_config_t *config)
{
    const pm_angle_t twice = 2U * config->step;
    return (pm_ab_t){harmonic(self, config, twice, 0), harmonic(self, config, twice, PM_TURN(0.25))};
}

#endif
