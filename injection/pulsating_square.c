#include "injection/pulsating_square.h"

#include "firmware/math/pair.h"

/* Commanded at k, applied over [k+1, k+2), seen at k+2; the second difference needs one more. */
#define WARM_UP 4

void pulsating_square_reset(pulsating_square_t *self, const pulsating_square_config_t *config, pm_ab_t i)
{
    *self = (pulsating_square_t){.i = i, .gain = config->gain_0, .carrier = -config->v_h, .warm = WARM_UP};
}

void pulsating_square_slow(pulsating_square_t *self, const pulsating_square_config_t *config,
                           const obs_in_t *in)
{
    const pm_q_t i_q = in->i_dq.q;
    const pm_q_t turn = pm_frac(in->omega, config->half_step);
    const pm_q_t lambda = pm_mul(i_q, config->lambda_1 + pm_mul(config->lambda_2, pm_abs(i_q))) + turn;
    const int32_t gain = config->gain_0 + pm_shl(pm_mul(config->gain_2, pm_mul(i_q, i_q)), 4);
    self->lambda = pm_shl(pm_sat(lambda, PM_Q_BITS), 3);
    self->gain = self->carrier > 0 ? -gain : gain;
}

pm_q_t pulsating_square_misfit(const pulsating_square_t *self, const pulsating_square_config_t *config)
{
    if (self->warm > 0U) {
        return 0;
    }
    return pm_small_gain(pm_small(pm_abs(self->h_d) - config->h_d), config->h_d_inverse);
}

void pulsating_square_demodulate(pulsating_square_t *self, const pulsating_square_config_t *config,
                                 const obs_in_t *in, obs_out_t *out)
{
    const pm_ab_t past = pm_pair_ab(&self->i);
    const pm_dq_t past_delta = pm_pair_dq(&self->half_delta);
    const pm_pair_t k = pm_pair(&self->carrier, &self->gain);
    const pm_ab_t change = {.alpha = in->i.alpha - past.alpha, .beta = in->i.beta - past.beta};
    const pm_dq_t half_delta = pm_park_half(change, in->dir);
    const pm_dq_t h = {.d = half_delta.d - past_delta.d, .q = half_delta.q - past_delta.q};
    self->i = in->i;
    self->half_delta = half_delta;
    self->h_d = h.d;
    if (self->warm > 0U) {
        self->warm--;
        self->eps = 0;
        *out = (obs_out_t){0};
        return;
    }
    self->eps = pm_small_gain(pm_small(h.q + pm_unit(h.d, self->lambda)), k.second);
    /* the sign of two periods ago is that of the period now to be commanded */
    const bool reversed = k.first > 0;
    out->vector = (pm_dq_t){.d = reversed ? -h.d : h.d, .q = reversed ? -h.q : h.q};
    out->eps = self->eps;
    out->misfit = pulsating_square_misfit(self, config);
}

pm_dq_t pulsating_square_output(pulsating_square_t *self, const pulsating_square_config_t *config)
{
    (void)config;
    const pm_pair_t k = pm_pair(&self->carrier, &self->gain);
    self->carrier = -k.first;
    self->gain = -k.second;
    return (pm_dq_t){.d = -k.first, .q = 0};
}
