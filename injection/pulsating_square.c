#include "injection/pulsating_square.h"

#include "firmware/math/pair.h"
#include "injection/carrier.h"

static int32_t whole_carrier(const pulsating_square_config_t *config)
{
    return pm_shl(config->v_h, 30 - PM_Q_BITS);
}

void pulsating_square_reset(pulsating_square_t *self, const pulsating_square_config_t *config,
                            const obs_in_t *in)
{
    *self = (pulsating_square_t){.i = in->i,
                                 .carrier = -pm_half(whole_carrier(config)),
                                 .gain = config->saliency.gain_0,
                                 .h = {.d = -config->h_d, .q = 0}}; /* as seen with that sign */
}

void pulsating_square_slow(pulsating_square_t *self, const pulsating_square_config_t *config,
                           const obs_in_t *in)
{
    const pm_q_t i_q = in->i_dq.q;
    const pm_q_t turn = pm_frac(in->omega, config->half_step);
    const pm_q_t lambda = saliency_lambda(&config->saliency, i_q) + turn;
    const int32_t gain = saliency_gain(&config->saliency, i_q);
    self->lambda = pm_shl(pm_sat(lambda, PM_Q_BITS), 3);
    self->gain = self->carrier > 0 ? -gain : gain;
    const int32_t v = whole_carrier(config);
    self->carrier = pm_clamp(self->carrier + pm_half(self->carrier), -v, v);
}

void pulsating_square_step(pulsating_square_t *self, const pulsating_square_config_t *config,
                           const injection_in_t *in, injection_out_t *out)
{
    (void)config;
    const pm_ab_t past = pm_pair_ab(&self->i);
    const pm_dq_t past_delta = pm_pair_dq(&self->half_delta);
    const pm_pair_t k = pm_pair(&self->carrier, &self->gain);
    const pm_ab_t twice = {.alpha = in->i.alpha + past.alpha, .beta = in->i.beta + past.beta};
    const pm_ab_t change = {.alpha = in->i.alpha - past.alpha, .beta = in->i.beta - past.beta};
    const pm_dq_t half_delta = pm_park_half(change, in->dir);
    const pm_dq_t h = {.d = half_delta.d - past_delta.d, .q = half_delta.q - past_delta.q};
    self->i.alpha = in->i.alpha; /* by members: they stay in registers */
    self->i.beta = in->i.beta;
    self->half_delta = half_delta;
    self->h = h;
    /* the sign of two periods ago is that of the period now to be commanded */
    self->carrier = -k.first;
    self->gain = -k.second;
    const pm_q_t eps = pm_small_gain(pm_small(h.q + pm_unit(h.d, self->lambda)), k.second);
    self->eps = eps;
    out->eps = eps;
    out->i = pm_park_half(twice, in->dir);
    out->carrier = (excitation_t){.v = carrier_along_d(-k.first, in->ahead)};
}

obs_out_t pulsating_square_last(const pulsating_square_t *self, const pulsating_square_config_t *config)
{
    /* seen with the sign of the carrier that has been commanded since */
    const bool reversed = self->carrier < 0;
    const pm_dq_t h = self->h;
    const pm_q_t beside = pm_abs(h.d) - config->h_d;
    return (obs_out_t){
        .eps = self->eps,
        .misfit = pm_small_gain(pm_small(beside), config->h_d_inverse),
        .vector = {.d = reversed ? -h.d : h.d, .q = reversed ? -h.q : h.q},
    };
}
