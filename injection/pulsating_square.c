#include "injection/pulsating_square.h"

/* Commanded at k, applied over [k+1, k+2), seen at k+2; the second difference needs one more. */
#define WARM_UP 4

void pulsating_square_reset(pulsating_square_t *self, pm_ab_t i)
{
    self->i = i;
    self->half_delta = (pm_dq_t){0, 0};
    self->h = (pm_dq_t){0, 0};
    self->eps = 0;
    self->positive = false;
    self->warm = WARM_UP;
}

obs_out_t pulsating_square_last(const pulsating_square_t *self, const pulsating_square_config_t *config)
{
    if (self->warm > 0) {
        return (obs_out_t){0};
    }
    const pm_q_t off = pm_small_gain(pm_small(self->h.d - config->h_d), config->h_d_inverse);
    return (obs_out_t){.eps = self->eps, .misfit = off, .vector = self->h};
}

void pulsating_square_demodulate(pulsating_square_t *self, const pulsating_square_config_t *config,
                                 const obs_in_t *in, obs_out_t *out)
{
    const pm_ab_t change = {.alpha = in->i.alpha - self->i.alpha, .beta = in->i.beta - self->i.beta};
    const pm_dq_t half_delta = pm_park_half(change, in->dir);
    pm_dq_t h = {.d = half_delta.d - self->half_delta.d, .q = half_delta.q - self->half_delta.q};
    self->i = in->i;
    self->half_delta = half_delta;
    if (self->warm > 0) {
        self->warm--;
        *out = (obs_out_t){0};
        return;
    }
    /* the sign of two periods ago, which is that of the period now to be commanded */
    if (self->positive) {
        h = (pm_dq_t){.d = -h.d, .q = -h.q};
    }

    const pm_q_t i_q = in->i_dq.q;
    const pm_q_t turn = pm_frac(in->omega, config->half_step);
    const pm_q_t lambda = pm_mul(i_q, config->lambda_1 + pm_mul(config->lambda_2, pm_magnitude(i_q))) + turn;
    const int32_t gain = config->gain_0 + pm_shl(pm_mul(config->gain_2, pm_mul(i_q, i_q)), 4);
    self->h = h;
    self->eps = pm_small_gain(pm_small(h.q + pm_mul(lambda, h.d)), gain);
    *out = pulsating_square_last(self, config);
}

pm_dq_t pulsating_square_output(pulsating_square_t *self, const pulsating_square_config_t *config)
{
    self->positive = !self->positive;
    return (pm_dq_t){.d = self->positive ? config->v_h : -config->v_h, .q = 0};
}
