#include "injection/injection_stages.h"

#include "firmware/math/image.h"
#include "firmware/math/trig.h"

#if PM_HAS(injection_stages)

#define K_LEARN PM_FRAC(1.0 / 400)

void injection_stages_reset(injection_stages_t *self, const injection_stages_config_t *config)
{
    self->frame = pm_dir(0);
    self->gain = config->saliency.gain_0;
}

static pm_dir_t doubled(pm_half_dir_t x)
{
    const pm_dir_t r = {pm_add_sat(x.cos, x.cos), pm_add_sat(x.sin, x.sin)};
    return r;
}

void injection_stages_before(const injection_stages_t *self, const injection_stages_config_t *config,
                             const injection_in_t *in, injection_in_t *to_source)
{
    *to_source = *in;
    if (config->direct) {
        const pm_half_dir_t ahead = in->ahead;
        const pm_dir_t frame = self->frame;
        to_source->dir = doubled(pm_dir_sum(in->dir, frame));
        to_source->ahead.cos = pm_shl(pm_mulh_sub(pm_mulh(ahead.cos, frame.cos), ahead.sin, frame.sin), 1);
        to_source->ahead.sin = pm_shl(pm_mulh_add(pm_mulh(ahead.sin, frame.cos), ahead.cos, frame.sin), 1);
    }
}

/* a cos + b sin of half a direction. */
static pm_q_t swing(pm_q_t a, pm_q_t b, pm_half_dir_t at)
{
    return pm_shl(pm_mulh_add(pm_mulh(a, at.cos), b, at.sin), 2);
}

static pm_q_t of_several(const injection_stages_config_t *config, pm_half_dir_t twice)
{
    const pm_dir_t two = doubled(twice);
    const pm_dir_t four = doubled(pm_dir_sum(two, two));
    const pm_half_dir_t six = pm_dir_sum(four, two);
    if (config->twelfth) {
        const pm_dir_t whole = doubled(six);
        return swing(config->a, config->b, pm_dir_sum(whole, whole));
    }
    return swing(config->a, config->b, six);
}

void injection_stages_after(injection_stages_t *self, const injection_stages_config_t *config,
                            const injection_in_t *in, injection_out_t *out)
{
    const pm_half_dir_t twice = pm_dir_sum(in->dir, in->dir);
    pm_q_t eps = out->eps;
    if (config->direct) {
        const pm_ab_t i = pm_park_inverse(out->i, self->frame);
        out->i = (pm_dq_t){.d = i.alpha, .q = i.beta};
    }
    if (config->several) {
        eps -= pm_small_gain(pm_small(of_several(config, twice)), self->gain);
    }
    if (config->unlike) {
        eps -= pm_small_gain(pm_small(swing(self->as_b, -self->as_a, twice)), self->gain);
    }
    out->eps = eps;
}

static void learn(injection_stages_t *self, pm_dir_t dir, pm_q_t h_d)
{
    const pm_half_dir_t twice = pm_dir_sum(dir, dir);
    if (self->c == 0) {
        self->c = h_d;
    }
    const pm_q_t left = h_d - self->c - swing(self->as_a, self->as_b, twice);
    const pm_q_t more = pm_frac(left, K_LEARN);
    self->c += more;
    self->as_a += pm_shl(pm_mulh(more, twice.cos), 3);
    self->as_b += pm_shl(pm_mulh(more, twice.sin), 3);
}

void injection_stages_slow(injection_stages_t *self, const injection_stages_config_t *config,
                           const obs_in_t *in, pm_q_t h_d)
{
    const pm_q_t i_q = in->i_dq.q;
    self->gain = saliency_gain(&config->saliency, i_q);
    if (config->direct) {
        self->frame = pm_dir((pm_angle_t)pm_rad_to_angle(saliency_shift(&config->saliency, i_q)));
    }
    if (config->unlike && pm_abs(in->omega) > config->omega_least) {
        learn(self, in->dir, h_d);
    }
}

#endif
