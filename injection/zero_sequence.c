#include "injection/zero_sequence.h"

#if PM_CARRIES(NEEDS_NEUTRAL)

#include "firmware/math/root.h"
#include "firmware/math/trig.h"

/* P is not believed to be smaller than this share of what it is without load: the gain would only amplify
 * noise. */
#define POWER_LEAST 8
#define PER_POWER   INT32_C(0x200000) /* 2^21: pm_small_gain() of a sum in Q24, shifted by 3 */
/* Of eps, 1 kHz, 5 ms; from the told form to the measured one and back, rad. */
#define K_EPS    PM_FRAC(0.2)
#define AGREES   PM_Q(0.1)
#define DIFFERS  PM_Q(0.5)
#define AGREE_MS 20U

/* The told form at the present load and position. */
static void set_told(zero_t *self, const zero_config_t *config, const obs_in_t *in)
{
    const pm_q_t i_q = in->i_dq.q;
    const pm_dq_t half = {0, i_q / 2};
    const int32_t c_re = zero_link_re(config, half);
    const pm_q_t rise = pm_mul(pm_div(saliency_i_p(&config->saliency, i_q), config->saliency.i_p_0),
                               pm_div(c_re, config->c_re));
    const pm_q_t a = pm_clamp(rise, PM_Q(0.5), PM_Q(2.0)) / 8;
    const pm_q_t kappa = config->kappa_0 + pm_mul(config->kappa_2, pm_mul(i_q, i_q));
    const bool decouples = config->form != (uint8_t)ZERO_NOT_DECOUPLED;
    const pm_q_t a_kappa = decouples ? pm_mul(a, pm_clamp(kappa, 0, PM_Q(0.45))) : 0;
    const pm_angle_t theta_m = (pm_angle_t)pm_rad_to_angle(2 * saliency_shift(&config->saliency, i_q));
    const pm_dir_t six = pm_dir(6U * pm_atan2(in->dir.sin, in->dir.cos) + theta_m);
    const pm_q_t turn = pm_mul(in->omega, config->turn6);
    const pm_dq_t told = {pm_unit(a_kappa, six.cos), pm_unit(a_kappa, six.sin)};
    self->told = told;
    self->rate.d = -pm_mul(turn, told.q);
    self->rate.q = pm_mul(turn, told.d);
    self->a = a;
    pm_q_t second = 0;
    if (config->anti_rotating != 0U) {
        second = -4 * told.d;
    } else if (config->omega_least != 0) {
        second = 4 * a_kappa;
    }
    self->s_told = 2 * a + second;
}

void zero_reset(zero_t *self, const zero_config_t *config, const obs_in_t *in)
{
    const pm_dq_t i = pm_park_half(in->i, in->dir);
    const injection_in_t sample = {.i = in->i, .dir = in->dir};
    *self = (zero_t){.sign = 1,
                     .u = zero_link(config, &sample, i),
                     .power = config->power_0,
                     .warm = config->warm,
                     .measured = config->told_first ? 0U : 1U};
    for (uint32_t n = 0; n < ZERO_HALF_MOST; n++) {
        self->place[n].i = i;
    }
    set_told(self, config, in);
}

static void choose(zero_t *self, const zero_config_t *config, uint32_t measured)
{
    if (self->measured != measured) {
        self->warm = config->warm;
        self->agree_ms = 0;
        self->measured = measured;
    }
}

/* From the told form to the measured one when they agree, and back when the latter is lost. */
static void set_form(zero_t *self, const zero_config_t *config)
{
    const pm_q_t off = pm_abs(pm_lp1(&self->eps_mean, self->eps, K_EPS));
    if (config->form != (uint8_t)ZERO_BEGINS_TOLD || !config->told_first) {
        return;
    }
    if (self->measured != 0U) {
        choose(self, config, off < DIFFERS ? 1U : 0U);
    } else {
        const bool agrees = self->warm == 0U && off < AGREES;
        self->agree_ms = agrees ? (uint16_t)(self->agree_ms + 1U) : 0U;
        choose(self, config, self->agree_ms >= AGREE_MS ? 1U : 0U);
    }
}

/* h P of what the window holds. */
static void set_power(zero_t *self, const zero_config_t *config)
{
    int32_t now = 0;
    for (uint32_t n = 0; n < config->half; n++) {
        now += pm_mulh(self->place[n].change, self->place[n].change);
    }
    if (config->k_power != 0) {
        (void)pm_lp1(&self->power, now, config->k_power);
    } else {
        self->power = now;
    }
}

static void set_misfit(zero_t *self, const zero_config_t *config, const obs_in_t *in)
{
    self->misfit = 0;
    if (config->omega_least != 0) {
        self->misfit = pm_abs(in->omega) < config->omega_least ? PM_ONE : 0;
    } else if (self->measured != 0U) {
        const pm_q_t rise = pm_shl(self->a, 3); /* against that without load */
        const pm_q_t share = pm_div(self->power, pm_mul(config->power_0, pm_mul(rise, rise)));
        self->misfit = pm_clamp(pm_sqrt(share) - PM_ONE, -PM_ONE, PM_ONE);
    }
}

void zero_slow(zero_t *self, const zero_config_t *config, const obs_in_t *in)
{
    set_form(self, config);
    set_told(self, config, in);
    if (self->warm > 0U) {
        self->warm--;
    } else {
        set_power(self, config);
        set_misfit(self, config, in);
    }
    const int32_t power = pm_max(self->power, pm_max(config->power_0 / POWER_LEAST, 1));
    self->gain = self->warm > 0U ? 0 : pm_div(PER_POWER, power);
}

obs_out_t zero_last(const zero_t *self, const zero_config_t *config)
{
    (void)config;
    return (obs_out_t){.eps = self->eps, .misfit = self->misfit};
}

#endif
