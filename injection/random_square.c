#include "injection/random_square.h"

#include "firmware/math/filter.h"
#include "injection/carrier.h"

#define TAPS  0x04C11DB7U
#define FIRST 0x9E3779B9U /* any with many bits of either kind */
/* Of the answer, cycle by cycle: eight of them. */
#define K_MEAN PM_FRAC(0.125)

void random_square_reset(random_square_t *self, const random_square_config_t *config, const obs_in_t *in)
{
    *self = (random_square_t){.i = in->i,
                              .i_dq = in->i_dq,
                              .bits = FIRST,
                              .gain = config->saliency.gain_0,
                              .h = {.d = config->h_d, .q = 0},
                              .mean = {.d = config->h_d, .q = 0}};
}

void random_square_slow(random_square_t *self, const random_square_config_t *config, const obs_in_t *in)
{
    const pm_q_t i_q = in->i_dq.q;
    const pm_q_t turn = pm_frac(in->omega, config->half_step);
    self->lambda = pm_shl(pm_sat(saliency_lambda(&config->saliency, i_q) + turn, PM_Q_BITS), 3);
    self->gain = saliency_gain(&config->saliency, i_q);
}

/* With the sign that the cycle that is seen began with. */
static pm_dq_t signed_by(const random_square_t *self, pm_dq_t x)
{
    return self->negative ? (pm_dq_t){-x.d, -x.q} : x;
}

/* Of the register: the new cycle begins with +V_h. */
static bool next_bit(random_square_t *self)
{
    const bool bit = (int32_t)self->bits < 0;
    self->bits += self->bits;
    if (bit) {
        self->bits ^= TAPS;
    }
    return bit;
}

void random_square_step(random_square_t *self, const random_square_config_t *config, const injection_in_t *in,
                        injection_out_t *out)
{
    const pm_ab_t change = {.alpha = in->i.alpha - self->i.alpha, .beta = in->i.beta - self->i.beta};
    const pm_dq_t half_delta = pm_park_half(change, in->dir);
    self->i = in->i;
    if (self->second) {
        const pm_dq_t first = self->half_delta;
        const pm_dq_t h = signed_by(self, (pm_dq_t){first.d - half_delta.d, first.q - half_delta.q});
        self->h = h;
        (void)pm_lp1(&self->mean.d, h.d, K_MEAN);
        (void)pm_lp1(&self->mean.q, h.q, K_MEAN);
        self->eps = pm_small_gain(pm_small(h.q + pm_unit(h.d, self->lambda)), self->gain);
        self->carrier = -self->carrier;
    } else {
        const pm_dq_t i = pm_park(in->i, in->dir);
        self->half_delta = half_delta;
        self->negative = self->carrier > 0; /* it ended with this sign in the last period */
        const pm_dq_t by_carrier = self->carrier == 0 ? (pm_dq_t){0, 0} : signed_by(self, self->mean);
        self->i_dq = (pm_dq_t){i.d - by_carrier.d, i.q - by_carrier.q};
        const int32_t v_h = pm_shl(config->v_h, 30 - PM_Q_BITS);
        self->carrier = next_bit(self) ? v_h : -v_h;
    }
    self->second = !self->second;
    out->eps = self->eps;
    out->i = self->i_dq;
    out->carrier = (excitation_t){.v = carrier_along_d(self->carrier, in->ahead)};
}

obs_out_t random_square_last(const random_square_t *self, const random_square_config_t *config)
{
    return (obs_out_t){
        .eps = self->eps,
        .misfit = pm_small_gain(pm_small(self->h.d - config->h_d), config->h_d_inverse),
        .vector = self->h,
    };
}
