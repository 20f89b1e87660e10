#include "injection/stationary_square.h"

#include "firmware/math/filter.h"
#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#define K_MEAN PM_FRAC(1.0 / 16)
#define WARM   (STATIONARY_SQUARE_ANSWER + STATIONARY_SQUARE_SETTLED)

void stationary_square_reset(stationary_square_t *self, const stationary_square_config_t *config,
                             const obs_in_t *in)
{
    stationary_reset(&self->stationary, &config->stationary, in->omega);
    self->i = in->i;
    self->half_delta = (pm_dq_t){0, 0};
    self->carrier = -config->v_h;
    self->i_p = (pm_dq_t){config->saliency.i_p_0, 0};
    self->turn = pm_dir(0);
    self->gain = config->saliency.gain_0;
    self->y = (pm_dq_t){config->stationary.i_n, 0};
    self->mean = self->y;
    self->eps = 0;
    self->misfit = 0;
    self->warm = WARM;
}

/* The second difference with the sign of the carrier, which two periods ago was that of the coming one. */
static inline pm_dq_t second_difference(stationary_square_t *self, pm_ab_t i, pm_dir_t dir)
{
    const pm_ab_t change = {i.alpha - self->i.alpha, i.beta - self->i.beta};
    const pm_dq_t now = pm_park_half(change, dir);
    const pm_dq_t h = {now.d - self->half_delta.d, now.q - self->half_delta.q};
    const pm_dq_t minus = {-h.d, -h.q};
    self->i = i;
    self->half_delta = now;
    return self->carrier < 0 ? minus : h;
}

void stationary_square_step(stationary_square_t *self, const stationary_square_config_t *config,
                            const injection_in_t *in, injection_out_t *out)
{
    (void)config;
    const pm_ab_t twice = {in->i.alpha + self->i.alpha, in->i.beta + self->i.beta};
    self->carrier = -self->carrier;
    const pm_dq_t h = second_difference(self, in->i, in->dir);
    if (self->warm <= STATIONARY_SQUARE_SETTLED) {
        const pm_dq_t known = pm_park(stationary_on(&self->stationary, self->i_p), in->dir);
        const pm_dq_t left = {h.d - known.d, h.q - known.q};
        const pm_dq_t y = stationary_turned(&self->stationary, left, in->dir);
        const pm_q_t across = pm_shl(pm_mulh2(y.q, self->turn.cos, y.d, self->turn.sin), 1);
        self->y = y;
        (void)pm_lp1(&self->mean.d, y.d, K_MEAN);
        (void)pm_lp1(&self->mean.q, y.q, K_MEAN);
        self->eps = pm_small_gain(pm_small(across), self->gain);
    }
    if (self->warm > 0U) {
        self->warm--;
    }
    out->eps = self->eps;
    out->i = pm_park_half(twice, in->dir);
    out->carrier = (excitation_t){.v = stationary_axis(&self->stationary, self->carrier)};
}

/* The whole answer along the axis: of y, whose frame has turned by twice the position. */
static pm_q_t along(const stationary_square_t *self, pm_dir_t dir)
{
    const pm_half_dir_t twice = pm_dir_sum(dir, dir);
    const pm_q_t salient = pm_shl(pm_mulh(self->mean.d, twice.cos) - pm_mulh(self->mean.q, twice.sin), 2);
    return self->i_p.d + (stationary_on_beta(&self->stationary) ? -salient : salient);
}

void stationary_square_slow(stationary_square_t *self, const stationary_square_config_t *config,
                            const obs_in_t *in)
{
    const pm_q_t i_q = in->i_dq.q;
    const pm_q_t i_p = saliency_i_p(&config->saliency, i_q);
    const pm_q_t half = pm_frac(in->omega, config->half_step);
    self->gain = saliency_gain(&config->saliency, i_q);
    if (self->warm == 0U) {
        const pm_q_t twice_i_n = 2 * pm_hypot(self->mean.d, self->mean.q);
        self->misfit = pm_small_gain(pm_small(twice_i_n), self->gain) - PM_ONE;
        if (stationary_finding(&self->stationary) &&
            stationary_find(&self->stationary, &config->stationary, along(self, in->dir), in, i_p)) {
            self->warm = WARM;
        }
    }
    self->i_p.d = stationary_i_p(&self->stationary, i_p);
    self->i_p.q = pm_mul(self->i_p.d, half);
    const pm_q_t turn = 3 * half - 2 * saliency_shift(&config->saliency, i_q);
    self->turn = pm_dir((pm_angle_t)pm_rad_to_angle(turn));
}

obs_out_t stationary_square_last(const stationary_square_t *self, const stationary_square_config_t *config)
{
    (void)config;
    return (obs_out_t){.eps = self->eps, .misfit = self->misfit, .vector = self->y};
}
