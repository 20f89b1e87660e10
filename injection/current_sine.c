#include "injection/current_sine.h"

#include "firmware/math/filter.h"
#include "firmware/math/image.h"
#include "firmware/math/root.h"

#if PM_HAS(current_sine)

#define K_LOAD   PM_FRAC(0.2) /* 5 ms */
#define K_BITS   CURRENT_SINE_K_BITS
#define K_2_BITS CURRENT_SINE_K_2_BITS
/* Of 2 in the format of a current times L_q / T_s. */
#define WANTED_BITS (PM_Q_BITS + K_BITS - 32 + 1)

void current_sine_reset(current_sine_t *self, const current_sine_config_t *config, const obs_in_t *in)
{
    sine_reset(&self->sine, &config->sine, (pm_dq_t){0, 0});
    self->i = in->i_dq;
    self->phase = pm_dir(0);
    self->gain = pm_div(config->saliency.gain_0, config->v_d);
    self->k_q = config->k_0;
    self->lambda = 0;
    self->i_q = in->i_dq.q;
    self->h = (pm_dq_t){config->v_d, 0};
    self->eps = 0;
    self->misfit = 0;
}

/* The voltage in the frame of the middle of the period that has ended, half a period's turn behind that of k. */
static inline pm_dq_t acted(const current_sine_config_t *config, const injection_in_t *in)
{
    const pm_dq_t v = pm_park(in->v, in->dir);
    const pm_q_t turn = pm_mul(in->omega, config->half_turn);
    return (pm_dq_t){.d = v.d - pm_mul(turn, v.q), .q = v.q + pm_mul(turn, v.d)};
}

/* v_d and y. Beyond +-2 no voltage of the link moves a current. */
static inline pm_dq_t compared(const current_sine_t *self, const current_sine_config_t *config, pm_dq_t i,
                               pm_dq_t v)
{
    const pm_q_t across = i.q - self->i.q + pm_unit(i.d - self->i.d, self->lambda);
    const pm_q_t wanted =
        pm_shl(pm_sat(pm_mulh(across, self->k_q), WANTED_BITS), PM_Q_BITS + 1 - WANTED_BITS);
    return (pm_dq_t){.d = v.d, .q = wanted - (config->voltage_read ? v.q : 0)};
}

void current_sine_step(current_sine_t *self, const current_sine_config_t *config, const injection_in_t *in,
                       injection_out_t *out)
{
    const pm_dq_t i = pm_park(in->i, in->dir);
    const pm_angle_t phi =
        sine_step(&self->sine, &config->sine, compared(self, config, i, acted(config, in)));
    self->i = i;
    if (sine_ready(&self->sine)) {
        self->h = sine_in_phase(&self->sine, &config->sine, self->phase);
        self->eps = pm_small_gain(pm_small(self->h.q), self->gain);
    }
    out->eps = self->eps;
    out->i = i;
    out->carrier = (excitation_t){.i_ref = pm_unit(config->i_h, pm_dir(phi).cos)};
#if PM_HAS(counted_carrier)
    out->carrier.i.d = -pm_unit(config->i_later, pm_dir(phi - 5U * (config->sine.step / 4U)).sin);
#endif
}

void current_sine_slow(current_sine_t *self, const current_sine_config_t *config, const obs_in_t *in)
{
    const pm_q_t i_q = pm_lp1(&self->i_q, in->i_dq.q, K_LOAD);
    const int32_t change = pm_shl(pm_sat(pm_mul(config->k_2, pm_mul(i_q, i_q)), 22), K_BITS - K_2_BITS);
    self->k_q = pm_max(pm_add_sat(config->k_0, change), config->k_0 / 4);
    self->lambda = pm_shl(pm_sat(saliency_lambda(&config->saliency, i_q), PM_Q_BITS), 31 - PM_Q_BITS);
    pm_q_t v_d = config->v_d;
    if (self->sine.warm == 0U) {
        const pm_q_t c = window_cosine(&self->sine.window, config->sine.per_n).d;
        const pm_q_t s = window_sine(&self->sine.window, config->sine.per_n).d;
        const pm_q_t seen = 2 * pm_hypot(c, s);
        self->misfit = pm_div(seen - v_d, v_d);
        self->phase = sine_phase(c, s);
        v_d = pm_max(seen, v_d / 3);
    }
    self->gain = pm_div(saliency_gain(&config->saliency, i_q), v_d);
}

obs_out_t current_sine_last(const current_sine_t *self, const current_sine_config_t *config)
{
    (void)config;
    return (obs_out_t){.eps = self->eps, .misfit = self->misfit, .vector = self->h};
}

#endif
