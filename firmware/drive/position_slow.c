/* The position at 1 kHz and at its beginning. */
#include "firmware/drive/position.h"
#include "firmware/math/compiler.h"
#include "firmware/math/filter.h"
#include "firmware/math/trig.h"

/* Means of |eps| and |misfit| at 1 kHz: 20 ms. */
#define K_MEAN PM_FRAC(0.05)
/* The position counts as lost when the mean error signal reaches 0.3 rad or the model is off by 0.5. */
#define PER_EPS_LOST    PM_Q(1.0 / 0.3)
#define PER_MISFIT_LOST 2
/* Of a rotor that is not where the source says: half of the time is enough to be lost. */
#define EPS_AWAY PM_ONE
/* Noise of a single error signal: 3 ms. */
#define K_NOISE PM_FRAC(0.3)
/* The same of a source that is right in the mean over a sixth of a turn: 64 ms. */
#define K_MEAN_NOISE PM_FRAC(1.0 / 64)
/* The weight follows the speed through 5 ms, so that noise of the speed does not move it. */
#define K_SPEED PM_FRAC(0.2)

/* What is at work, where the rotor is known to be. */
static void seed(position_t *self, const position_config_t *config, pm_ab_t i)
{
    const pm_dir_t dir = pm_dir(self->pll.theta);
    const obs_in_t in = {.dir = dir, .omega = self->pll.omega, .i = i, .i_dq = pm_park(i, dir)};
    observer_reset(&self->observer, &config->observer, &in);
    if (self->inject) {
        injection_reset(&self->injection, &config->injection, &in);
    }
}

PM_RARE void position_reset(position_t *self, const position_config_t *config, const pm_pll_t *known,
                            pm_ab_t i, bool carrier)
{
    const bool may = carrier && config->injects;
    const bool inject = may && pm_abs(known->omega) <= config->omega_high;
    *self = (position_t){.pll = *known,
                         .omega_mean = known->omega,
                         .weight = inject ? 0 : PM_ONE,
                         .carrier = may,
                         .inject = inject,
                         .gains = inject ? config->pll_low : config->pll_high,
                         .quality = PM_ONE};
    seed(self, config, i);
}

void position_change_observer(position_t *self, const position_config_t *config, pm_ab_t i, pm_dq_t i_dq)
{
    const obs_in_t in = {.i = i, .dir = pm_dir(self->pll.theta), .omega = self->pll.omega, .i_dq = i_dq};
    observer_reset(&self->observer, &config->observer, &in);
#if PM_HAS(zero_vector)
    self->sample_at = 0;
#endif
}

void position_set_resistance(position_t *self, const position_config_t *config, pm_q_t R)
{
    if (config->observer.id == OBSERVER_active_flux) {
        const pm_q_t told = config->observer.active_flux.model.R;
        self->observer.active_flux.R = pm_clamp(R, pm_half(told), told + pm_half(told));
    }
}

void position_force(position_t *self, const position_config_t *config, const pm_pll_t *imposed)
{
    observer_tie(&self->observer, &config->observer);
    loop_reset(&self->loop);
    second_harmonic_reset(&self->second_harmonic);
    self->pll = *imposed;
    self->gains.kp_turn = 0;
    self->gains.ki = 0;
}

#if PM_CARRIES(NEEDS_NEUTRAL)
static bool knows_third(const position_config_t *config)
{
    return (config->traits_high & (uint8_t)SOURCE_THIRD_TURN) != 0U;
}

bool position_lacks_third(const position_t *self, const position_config_t *config)
{
    return knows_third(config) && self->square < PM_Q(0.0625) &&
           pm_abs(self->omega_mean) >= config->omega_low;
}

static void set_shown(position_t *self, pm_dq_t vector)
{
    const pm_q_t d = pm_clamp(vector.d, -2 * PM_ONE, 2 * PM_ONE);
    const pm_q_t q = pm_clamp(vector.q, -PM_ONE, PM_ONE);
    (void)pm_lp1(&self->shown, d, K_MEAN_NOISE);
    (void)pm_lp1(&self->square, pm_mul(d, d) + pm_mul(q, q), K_MEAN);
}

/* Below omega_low an offset of the channel may pass for the third harmonic, and so may, at a reversal, what a filter holds of
 * the speed before. */
static bool is_below_third(const position_t *self, const position_config_t *config)
{
    return knows_third(config) && pm_abs(self->omega_mean) < config->omega_low;
}

/* The low-speed source keeps the lead. */
static bool is_held(position_t *self, const position_config_t *config)
{
    const bool slow = is_below_third(self, config);
    self->shown = slow ? 0 : self->shown;
    const bool held = knows_third(config) && self->inject && self->weight == 0 && self->shown < PM_ONE / 2;
    self->absent_ms = held && !slow ? (uint16_t)(self->absent_ms + 1U) : 0U;
    return held;
}
#else
static bool is_below_third(const position_t *self, const position_config_t *config)
{
    (void)self;
    (void)config;
    return false;
}

static bool is_held(const position_t *self, const position_config_t *config)
{
    (void)self;
    (void)config;
    return false;
}
#endif

static void set_weight(position_t *self, const position_config_t *config, const obs_in_t *in)
{
    const pm_q_t speed = pm_abs(pm_lp1(&self->omega_mean, self->pll.omega, K_SPEED));
    if (!self->carrier) {
        self->weight = PM_ONE;
        return;
    }
    if (is_held(self, config)) {
        return;
    }
    self->weight = pm_max(0, pm_small_gain(pm_small(speed - config->omega_low), config->per_span));
    if (speed > config->omega_high) {
        self->weight = PM_ONE;
    }
    if (!self->inject && speed < config->omega_high) {
        self->inject = true;
        injection_reset(&self->injection, &config->injection, in);
    } else if (self->inject && speed > config->omega_high + config->omega_high / 8) {
        self->inject = false;
        self->window = (mismatch_window_t){.count = 0};
    }
}

static int32_t blend(int32_t low, int32_t high, pm_q_t weight)
{
    return low + pm_mul(high - low, weight);
}

pm_unit_t position_current_share(const position_t *self, const position_config_t *config)
{
    return self->inject ? config->current_low : PM_UNIT_MAX;
}

PM_RARE void position_turn(position_t *self, const position_config_t *config, pm_angle_t turn, pm_ab_t i)
{
    self->pll.theta += turn;
    seed(self, config, i);
    self->eps_mean = 0;
    self->misfit_mean = 0;
}

pm_angle_t position_resolve_slip(position_t *self, const position_config_t *config,
                                 const pm_machine_t *machine, pm_dq_t v, pm_dq_t i_dq, pm_ab_t i)
{
    uint32_t traits = self->inject ? config->traits : 0U;
#if PM_CARRIES(NEEDS_NEUTRAL)
    const bool third = self->weight == PM_ONE && (config->traits_high & (uint32_t)SOURCE_THIRD_TURN) != 0U;
    traits = third ? (uint32_t)SOURCE_THIRD_TURN : traits;
#endif
    if (traits == 0U) {
        return 0;
    }
    const slip_in_t in = {.traits = traits,
                          .omega_least = config->omega_low,
                          .omega_most = config->omega_high,
                          .omega = self->pll.omega,
                          .v = v,
                          .i = i_dq};
    bool away;
    const pm_angle_t turn = slip_slow(&self->slip, machine, &in, &away);
    if (away && self->inject) {
        (void)pm_lp1(&self->eps_mean, EPS_AWAY, K_MEAN);
    }
    if (turn != 0U) {
        position_turn(self, config, turn, i);
    }
#if PM_CARRIES(NEEDS_NEUTRAL)
    if (turn != 0U && third) { /* which third it is has been known from the start: something is wrong */
        self->slip.count = SLIP_MOST + 1U;
    }
#endif
    return turn;
}

static pm_q_t magnitude_after(pm_q_t *filter, pm_q_t x, pm_frac_t k)
{
    return pm_abs(pm_lp1(filter, x, k));
}

/* Means of magnitudes: a source that has slipped shows errors of either sign, slower than the noise that is
 * filtered before. Whichever leads, both must agree. */
static void set_quality(position_t *self, const position_config_t *config, const obs_out_t *seen, pm_dq_t i)
{
    obs_out_t low = {0};
    if (self->inject) {
        low = injection_last(&self->injection, &config->injection);
    }
    const bool in_mean = PM_CARRIES(NEEDS_NEUTRAL) != 0 && (config->traits & (uint8_t)SOURCE_IN_MEAN) != 0U;
    const pm_q_t low_eps = magnitude_after(&self->injection_eps, low.eps, in_mean ? K_MEAN_NOISE : K_NOISE);
    /* also while the observer is tied: an EMF that the position does not explain */
    const pm_q_t seen_eps = self->weight == 0 && is_below_third(self, config) ? 0 : seen->eps;
    pm_q_t eps = magnitude_after(&self->observer_eps, seen_eps + mismatch_eps(&self->mismatch, i), K_NOISE);
    pm_q_t misfit = pm_abs(seen->misfit);
    if (self->weight == 0) {
        eps = pm_unit(eps, config->tied_share);
        misfit = 0;
    }
    if (self->weight < PM_ONE) {
        eps = pm_max(eps, low_eps);
        misfit = pm_max(misfit, pm_abs(low.misfit));
    }
    (void)pm_lp1(&self->eps_mean, eps, K_MEAN);
    (void)pm_lp1(&self->misfit_mean, pm_sat(misfit, PM_Q_BITS), K_MEAN);
    const pm_q_t worst = pm_max(pm_mul(self->eps_mean, PER_EPS_LOST), PER_MISFIT_LOST * self->misfit_mean);
    self->quality = pm_max(0, PM_ONE - worst);
}

#if PM_HAS(carrier_rest)
void position_rest(position_t *self)
{
    self->rests = true;
    self->inject = false;
    self->pll.omega = 0;
    self->gains.kp_turn = 0;
    self->gains.ki = 0;
}
#endif

void position_slow(position_t *self, const position_config_t *config, pm_ab_t i, pm_dq_t i_dq)
{
#if PM_HAS(carrier_rest)
    if (self->rests) {
        observer_tie(&self->observer, &config->observer);
        return;
    }
#endif
    const obs_in_t in = {.dir = pm_dir(self->pll.theta), .omega = self->pll.omega, .i = i, .i_dq = i_dq};
    const obs_out_t seen = observer_last(&self->observer, &config->observer);
#if PM_CARRIES(NEEDS_NEUTRAL)
    set_shown(self, seen.vector);
#endif
    if (self->inject) { /* not yet in the millisecond in which it begins */
        injection_slow(&self->injection, &config->injection, &in);
    }
    set_weight(self, config, &in);
    self->gains.kp_turn = blend(config->pll_low.kp_turn, config->pll_high.kp_turn, self->weight);
    self->gains.ki = blend(config->pll_low.ki, config->pll_high.ki, self->weight);
    loop_slow(&self->loop, &config->loop, self->weight);
    second_harmonic_slow(&self->second_harmonic, &config->second_harmonic, self->pll.omega, self->weight);
    const mismatch_in_t at = {.pll = &self->pll, .k_theta = self->gains.k_theta, .i = i_dq};
    mismatch_slow(&self->mismatch, position_window(self), &config->mismatch, &at);
    observer_slow(&self->observer, &config->observer, &in, &seen, self->weight);
    set_quality(self, config, &seen, i_dq);
}
