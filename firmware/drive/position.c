#include "firmware/drive/position.h"

#include "firmware/math/compiler.h"
#include "firmware/math/filter.h"
#include "firmware/math/trig.h"

/* Means of |eps| and |misfit| at 1 kHz: 20 ms. */
#define K_MEAN PM_FRAC(0.05)
/* The position counts as lost when the mean error signal reaches 0.3 rad or the model is off by 0.5. */
#define PER_EPS_LOST    PM_Q(1.0 / 0.3)
#define PER_MISFIT_LOST PM_Q(1.0 / 0.5)
/* Noise of a single error signal: 3 ms. */
#define K_NOISE PM_FRAC(0.3)
/* The weight follows the speed through 5 ms, so that noise of the speed does not move it. */
#define K_SPEED PM_FRAC(0.2)

PM_RARE void position_reset(position_t *self, const position_config_t *config, pm_angle_t theta, pm_ab_t i,
                            bool carrier)
{
    const bool inject = carrier && config->injection;
    *self = (position_t){.pll.theta = theta,
                         .weight = inject ? 0 : PM_ONE,
                         .carrier = inject,
                         .inject = inject,
                         .gains = inject ? config->pll_low : config->pll_high,
                         .quality = PM_ONE};
    const pm_dir_t dir = pm_dir(theta);
    const obs_in_t in = {.i = i, .dir = dir, .i_dq = pm_park(i, dir)};
    observer_reset(&self->observer, &config->observer, &in);
    if (self->inject) {
        pulsating_square_reset(&self->square, &config->square, i);
    }
}

static mismatch_window_t *window_of(position_t *self)
{
    return self->inject ? NULL : &self->window;
}

/* What few drives use: one question in the period instead of one for each. */
PM_RARE static pm_q_t special_eps(position_t *self, const position_config_t *config, pm_dq_t i, pm_q_t eps)
{
    if (config->second_harmonic.id != SECOND_HARMONIC_STAYS) {
        eps = second_harmonic_step(&self->second_harmonic, &config->second_harmonic, pm_dir(self->pll.theta),
                                   eps);
    }
    if (config->mismatch.id != (uint8_t)MISMATCH_OFF) {
        const mismatch_in_t at = {.pll = &self->pll, .k_theta = self->gains.k_theta, .i = i};
        eps = mismatch_step(&self->mismatch, window_of(self), &config->mismatch, &at, self->weight, eps);
    }
    return loop_eps(&self->loop, &config->loop, &self->pll, &self->gains, eps);
}

void position_step(position_t *self, const position_config_t *config, pm_ab_t v, pm_ab_t i,
                   position_out_t *out)
{
    pm_pll_t pll = self->pll;
    pm_pll_predict(&pll, &self->gains);
    const pm_dir_t dir = pm_dir(pll.theta);
    const bool inject = self->inject;
    /* both ways twice the current, so that the halving transform gives the current itself */
    pm_ab_t twice = {.alpha = pm_shl(i.alpha, 1), .beta = pm_shl(i.beta, 1)};
    if (inject) {
        twice = pulsating_square_fundamental_twice(&self->square, i);
    }
    const pm_dq_t i_dq = pm_park_half(twice, dir);
    const obs_in_t in = {.v = v, .i = i, .dir = dir, .omega = pll.omega, .i_dq = i_dq};
    obs_out_t seen;
    observer_step(&self->observer, &config->observer, &in, &seen);
    pm_q_t eps = seen.eps;
    if (inject) {
        obs_out_t square;
        pulsating_square_demodulate(&self->square, &config->square, &in, &square);
        eps = square.eps + pm_mul(self->weight, eps - square.eps);
    }
    if (pm_rarely(config->special)) {
        self->pll = pll; /* by way of the memory, so that otherwise it stays in registers */
        eps = special_eps(self, config, i_dq, eps);
        pll = self->pll;
    }
    pm_pll_correct(&pll, &self->gains, eps);
    self->pll = pll;
    *out = (position_out_t){.dir = dir, .i = i_dq, .omega = pll.omega};
}

PM_RARE void position_change_observer(position_t *self, const position_config_t *config, pm_ab_t i,
                                      pm_dq_t i_dq)
{
    const obs_in_t in = {.i = i, .dir = pm_dir(self->pll.theta), .omega = self->pll.omega, .i_dq = i_dq};
    observer_reset(&self->observer, &config->observer, &in);
}

PM_RARE void position_lead(position_t *self, const position_config_t *config, const pm_pll_t *imposed)
{
    observer_tie(&self->observer, &config->observer);
    loop_reset(&self->loop);
    second_harmonic_reset(&self->second_harmonic);
    self->pll = *imposed;
    self->gains.kp_turn = 0;
    self->gains.ki = 0;
}

static void set_weight(position_t *self, const position_config_t *config, pm_ab_t i)
{
    const pm_q_t speed = pm_abs(pm_lp1(&self->omega_mean, self->pll.omega, K_SPEED));
    if (!self->carrier) {
        self->weight = PM_ONE;
        return;
    }
    self->weight = pm_max(0, pm_small_gain(pm_small(speed - config->omega_low), config->per_span));
    if (speed > config->omega_high) {
        self->weight = PM_ONE;
    }
    if (!self->inject && speed < config->omega_high) {
        self->inject = true;
        pulsating_square_reset(&self->square, &config->square, i);
    } else if (self->inject && speed > config->omega_high + config->omega_high / 8) {
        self->inject = false;
        self->window = (mismatch_window_t){.count = 0};
    }
}

static pm_frac_t between(pm_frac_t low, pm_frac_t high, pm_q_t weight)
{
    return low + pm_mul(high - low, weight);
}

static pm_q_t magnitude_after(pm_q_t *filter, pm_q_t x)
{
    return pm_abs(pm_lp1(filter, x, K_NOISE));
}

/* Means of magnitudes: a source that has slipped shows errors of either sign, slower than the noise that is
 * filtered before. Whichever leads, both must agree. */
static void set_quality(position_t *self, const position_config_t *config, const obs_out_t *seen, pm_dq_t i)
{
    const pm_q_t square_eps = self->inject ? magnitude_after(&self->square_eps, self->square.eps) : 0;
    /* also while the observer is tied: an EMF that the position does not explain */
    pm_q_t eps = magnitude_after(&self->observer_eps, seen->eps + mismatch_eps(&self->mismatch, i));
    pm_q_t misfit = self->weight > 0 ? pm_abs(seen->misfit) : 0;
    if (self->weight < PM_ONE) {
        eps = pm_max(eps, square_eps);
        misfit = pm_max(misfit, pm_abs(pulsating_square_misfit(&self->square, &config->square)));
    }
    (void)pm_lp1(&self->eps_mean, eps, K_MEAN);
    (void)pm_lp1(&self->misfit_mean, misfit, K_MEAN);
    const pm_q_t worst =
        pm_max(pm_mul(self->eps_mean, PER_EPS_LOST), pm_mul(self->misfit_mean, PER_MISFIT_LOST));
    self->quality = pm_max(0, PM_ONE - worst);
}

PM_RARE void position_slow(position_t *self, const position_config_t *config, pm_ab_t i, pm_dq_t i_dq)
{
    const obs_in_t in = {.omega = self->pll.omega, .i = i, .i_dq = i_dq};
    const obs_out_t seen = observer_last(&self->observer, &config->observer);
    set_weight(self, config, i);
    if (self->inject) {
        pulsating_square_slow(&self->square, &config->square, &in);
    }
    self->gains.kp_turn = between(config->pll_low.kp_turn, config->pll_high.kp_turn, self->weight);
    self->gains.ki = between(config->pll_low.ki, config->pll_high.ki, self->weight);
    loop_slow(&self->loop, &config->loop, self->weight);
    second_harmonic_slow(&self->second_harmonic, &config->second_harmonic, self->pll.omega, self->weight);
    const mismatch_in_t at = {.pll = &self->pll, .k_theta = self->gains.k_theta, .i = i_dq};
    const observer_model_t *model = &config->observer.active_flux.model; /* the first of each observer's */
    mismatch_slow(&self->mismatch, window_of(self), &config->mismatch, model, &at);
    observer_slow(&self->observer, &config->observer, &in, &seen, self->weight);
    set_quality(self, config, &seen, i_dq);
}
