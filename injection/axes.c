#include "injection/axes.h"

#include "firmware/math/root.h"

/* From the first command to the first answer. */
#define ANSWER 2U
#define PER_N  PM_FRAC(1.0 / AXES_ROUND)

static pm_dir_t axis(uint16_t at)
{
    const pm_angle_t pair = (pm_angle_t)(at / 2U) * PM_TURN(1.0 / 3);
    const uint32_t other_first = at >= AXES_ROUND / 2U ? 1U : 0U;
    return pm_dir(pair + ((at ^ other_first) & 1U) * PM_TURN(0.5));
}

void axes_reset(axes_t *self, const axes_config_t *config)
{
    window_reset(&self->window, AXES_ROUND, (pm_dq_t){0, 0});
    self->asked[0] = axis(AXES_ROUND - 1U);
    self->asked[1] = axis(AXES_ROUND - 2U);
    self->turn = pm_dir(0);
    self->gain = config->saliency.gain_0;
    self->y = (pm_ab_t){0, 0};
    self->eps = 0;
    self->misfit = 0;
    self->phase = (carrier_phase_t){0};
    self->warm = (uint16_t)(AXES_ROUND + ANSWER);
}

pm_dir_t axes_step(axes_t *self, const axes_config_t *config, pm_dir_t dir, pm_ab_t change)
{
    (void)config;
    const uint16_t at = self->phase.at;
    window_step(&self->window, at, self->asked[1], (pm_dq_t){change.alpha, change.beta});
    const pm_dq_t y = window_negative(&self->window, PER_N);
    self->y = (pm_ab_t){y.d, y.q};
    if (self->warm > 0U) {
        self->warm--;
    } else {
        const pm_half_dir_t twice = pm_dir_sum(dir, dir);
        const int32_t d = pm_mulh_add(pm_mulh(y.d, twice.cos), y.q, twice.sin);
        const int32_t q = pm_mulh_sub(pm_mulh(y.q, twice.cos), y.d, twice.sin);
        const pm_q_t across = pm_shl(pm_mulh2(q, self->turn.cos, d, self->turn.sin), 3);
        self->eps = pm_small_gain(pm_small(across), self->gain);
    }
    const pm_dir_t next = axis(at);
    self->asked[1] = self->asked[0];
    self->asked[0] = next;
    carrier_advance(&self->phase, AXES_ROUND);
    return next;
}

void axes_slow(axes_t *self, const axes_config_t *config, const obs_in_t *in)
{
    const pm_q_t i_q = in->i_dq.q;
    self->gain = saliency_gain(&config->saliency, i_q);
    if (self->warm == 0U) {
        const pm_q_t i_p = saliency_i_p(&config->saliency, i_q);
        const pm_dq_t positive = window_positive(&self->window, PER_N);
        self->misfit = pm_div(pm_hypot(positive.d, positive.q) - i_p, i_p);
    }
    const pm_q_t turn = pm_mul(config->lag, in->omega) - saliency_shift(&config->saliency, i_q);
    self->turn = pm_dir((pm_angle_t)pm_rad_to_angle(pm_shl(turn, 1)));
}

obs_out_t axes_last(const axes_t *self)
{
    return (obs_out_t){.eps = self->eps, .misfit = self->misfit, .vector = {self->y.alpha, self->y.beta}};
}
