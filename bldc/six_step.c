#include "bldc/six_step.h"

#include "firmware/math/compiler.h"
#include "firmware/math/root.h"

#include <stddef.h>

#define SIXTH PM_TURN(1.0 / 6)

/* In a sector: with fewer one ahead of the crossing may be near to it, and the EMF is far above its noise. */
#define SAMPLES 8U

/* What is expected of the next sector, after a crossing or one that is missed. */
static void follow(six_step_t *self)
{
    self->expected.t_60 = commutation_t_60(&self->commutation);
    self->expected.at = self->commutation.crossing + self->expected.t_60;
    self->moved = true;
}

/* A sample at `at` was still ahead of the crossing. */
static void wait_for(six_step_t *self, uint32_t at)
{
    commutation_ahead(&self->commutation, at);
    if ((int32_t)(at - self->expected.at) > 0) {
        self->moved = true;
    }
}

/* After what moves the next commutation, or ends the commutation for good. */
static void move(six_step_t *self, const six_step_config_t *config)
{
    const commutation_t *c = &self->commutation;
    self->moved = false;
    self->due = commutation_due(c, &config->commutation);
    self->lost = self->lost || commutation_state(c, &config->commutation) == COMMUTATION_LOST;
}

static void open_sector(six_step_t *self, const six_step_config_t *config, uint32_t sector, uint32_t since)
{
    zero_crossing_open(&self->crossing, sector, self->reverse, since);
    self->expected.threshold = thresholds_at(&self->thresholds, sector, self->reverse) & config->compared;
    self->expected.moved = (uint32_t)self->phase.shift[sector];
}

void six_step_slow(six_step_t *self, const six_step_config_t *config)
{
    const uint32_t t_60 = self->expected.t_60;
    const bool sure = self->commutation.young == 0U && t_60 < 2U * SAMPLES * config->pattern.half_period;
    const pm_q_t swing = zero_crossing_swing(&config->crossing, t_60);
    self->swing = swing;
    thresholds_slow(&self->thresholds);
    if (config->compared == 0) {
        phase_compensation_slow(&self->phase, &self->thresholds, self->reverse, t_60, swing);
    }
    if (config->crossings == CROSSINGS_third_harmonic) {
        third_harmonic_slow(&self->third, &config->third, t_60, swing);
        return;
    }
    self->expected.seen = sure ? 0 : swing / 8;
}

void six_step_freewheel(six_step_t *self, const six_step_config_t *config, pm_q_t u, bool flows)
{
    const bool ceases = config->pattern.id == PATTERN_H_PWM_L_PWM && !flows;
    const pm_q_t swing = self->swing;
    self->complementary = config->pattern.complementary || self->commutation.young != 0U ||
                          swing < 4 * config->crossing.rail || !pattern_shows(&config->pattern, u) || ceases;
}

/* In the middle of `sector`, whose crossing is known. */
static void begin(six_step_t *self, const six_step_config_t *config, uint32_t sector, uint32_t now)
{
    self->lost = false;
    self->learn = false;
    self->alike = 0;
    self->complementary = true;
    follow(self);
    six_step_slow(self, config);
    open_sector(self, config, sector, now);
    third_harmonic_open(&self->third, now);
    self->crossing.found = true;
    self->commutated = now;
    self->legs = pattern_states(config->pattern.id, self->complementary, sector, self->reverse);
    self->kind = (uint8_t)pattern_kind(config->pattern.id, sector);
    const six_step_plan_t none = {.sector = (uint16_t)sector};
    self->plan[0] = none;
    self->plan[1] = none;
}

void six_step_reset(six_step_t *self, const six_step_config_t *config, pm_angle_t theta, pm_q_t omega,
                    uint32_t now)
{
    self->reverse = omega < 0;
    /* Sectors from one crossing to the next: the rotor is in the latter half of `sector` or in the first of the next. */
    const pm_angle_t from = (self->reverse ? 0U - theta : theta) - SIXTH;
    const uint32_t sector = (uint32_t)pm_min((int32_t)(from / SIXTH), (int32_t)SECTORS - 1);
    const int32_t turn = pm_div((pm_q_t)config->commutation.turn_base, pm_max(pm_abs(omega), 1));
    const uint32_t since = (uint32_t)pm_mulh((int32_t)(from - sector * SIXTH), turn);
    commutation_reset(&self->commutation, sector, now - since, (uint32_t)pm_frac(turn, PM_FRAC(1.0 / 6)));
    begin(self, config, sector, now);
}

void six_step_begin(six_step_t *self, const six_step_config_t *config, pm_angle_t theta, bool reverse,
                    uint32_t t_30, uint32_t now)
{
    self->reverse = reverse;
    const pm_angle_t from = (reverse ? 0U - theta : theta) - SIXTH / 2U;
    const uint32_t sector = (uint32_t)pm_min((int32_t)(from / SIXTH), (int32_t)SECTORS - 1);
    commutation_start(&self->commutation, sector, now, t_30, START_CROSSINGS);
    begin(self, config, sector, now);
}

static void found(six_step_t *self, uint32_t at, bool like_those_learnt)
{
    commutation_crossed(&self->commutation, at);
    follow(self);
    self->learn = self->commutation.whole == SECTORS && like_those_learnt;
    if (!like_those_learnt) {
        self->alike = 0;
    }
}

/* In a period that has no crossing to look for. */
static void learn(six_step_t *self, const six_step_config_t *config)
{
    self->learn = false;
    if (self->alike < SECTORS) { /* the turn has some of the other kind */
        self->alike++;
        return;
    }
    const commutation_t *c = &self->commutation;
    thresholds_learn(&self->thresholds, &config->thresholds, c->crossed, self->reverse, c->interval, c->sum,
                     self->swing);
}

/* The sample of the period that began at `start`. */
static void look(six_step_t *self, const six_step_config_t *config, const six_step_in_t *in, uint32_t start)
{
    const six_step_plan_t *plan = &self->plan[0];
    const bool commutated = plan->commutate_at != 0U && plan->commutate_at < plan->sample_at;
    const uint32_t sector = commutated ? sector_next(plan->sector) : plan->sector;
    if (sector != self->crossing.sector) {
        if (!self->crossing.found) {
            commutation_missed(&self->commutation);
            follow(self);
        }
        open_sector(self, config, sector, commutated ? start + plan->commutate_at : self->commutated);
    }
    if (self->crossing.found) {
        if (self->learn) {
            learn(self, config);
        }
        return;
    }
    const bool on = plan->legs == ZERO_LEGS_APART;
    const zero_instant_t when = {start + plan->sample_at, (zero_legs_t)plan->legs};
    if (zero_crossing_step(&self->crossing, &config->crossing, in->sample, when, &self->expected)) {
        found(self, self->crossing.at, on);
    } else if (self->crossing.ahead) {
        wait_for(self, self->crossing.at);
    } else {
        /* nothing is known of it yet */
    }
}

#if PM_CARRIES(NEEDS_NEUTRAL)
/* The third harmonic crosses by the rotor alone: where a filter delays it, behind the commutation that it was for. */
PM_APART static void look_third(six_step_t *self, const six_step_config_t *config, const six_step_in_t *in)
{
    commutation_t *c = &self->commutation;
    const uint32_t next = sector_next(c->crossed), moved = (uint32_t)self->phase.shift[next];
    const bool rising = sector_rising(next);
    if (third_harmonic_step(&self->third, &config->third, in->v_zero, in->now, rising)) {
        found(self, self->third.crossing + moved, true);
        return;
    }
    if (self->learn) {
        learn(self, config);
    }
    const uint32_t at = in->now - self->third.lag + moved;
    const int32_t late = (int32_t)(at - self->expected.at);
    if (sector_distance(c->crossed, self->plan[1].sector) >= 2U &&
        late > (int32_t)(self->expected.t_60 / 2U)) {
        commutation_missed(c);
        follow(self);
        third_harmonic_skip(&self->third);
    } else if (self->third.y < 0 && (int32_t)(at - c->crossing) > 0) {
        wait_for(self, at);
    } else {
        /* past a crossing that was found, or not yet beyond it */
    }
}
#endif

/* A commutation ahead of the sample moves it to where the next sector has its own, if that is still to come. */
PM_APART static pattern_sample_t sample_behind(const six_step_plan_t *plan, const pattern_config_t *pattern,
                                               const pattern_on_t *on)
{
    const pattern_kind_t kind = pattern_kind(pattern->id, sector_next(plan->sector));
    pattern_sample_t sample = pattern_sample(pattern, kind, on);
    sample.at = (int32_t)plan->commutate_at < sample.at ? sample.at : 0;
    return sample;
}

static void plan_sample(six_step_plan_t *plan, const pattern_config_t *pattern, pattern_kind_t kind,
                        const pattern_on_t *on)
{
    pattern_sample_t sample = pattern_sample(pattern, kind, on);
    if (plan->commutate_at != 0U && (int32_t)plan->commutate_at < sample.at) {
        sample = sample_behind(plan, pattern, on);
    }
    plan->sample_at = (uint16_t)sample.at;
    plan->legs = (uint16_t)sample.legs;
}

void six_step_step(six_step_t *self, const six_step_config_t *config, const six_step_in_t *in,
                   six_step_out_t *out)
{
    const int32_t period = 2 * (int32_t)config->pattern.half_period;
    const uint32_t ended = in->now - (uint32_t)period, coming = in->now + (uint32_t)period;
    commutation_t *c = &self->commutation;
    if (in->sample != NULL) {
        look(self, config, in, ended);
#if PM_CARRIES(NEEDS_NEUTRAL)
    } else if (pm_rarely(config->crossings == CROSSINGS_third_harmonic)) {
        look_third(self, config, in);
#endif
    } else if (self->learn) {
        learn(self, config);
    } else {
        /* nothing new */
    }
    if (self->moved) {
        move(self, config);
    }
    if (self->plan[0].commutate_at != 0U) {
        self->commutated = ended + self->plan[0].commutate_at;
    }
    self->plan[0] = self->plan[1];
    six_step_plan_t *plan = &self->plan[1];
    plan->sector = c->sector;
    plan->commutate_at = 0;
    const pattern_kind_t kind = (pattern_kind_t)self->kind;
    out->on = pattern_on(&config->pattern, in->u);
    out->sector = c->sector;
    out->legs = self->legs;
    const int32_t due = (int32_t)(self->due - coming);
    if (due < period) {
        plan->commutate_at = (uint16_t)pm_max(due, 1);
        c->sector = (uint8_t)sector_next(c->sector);
        self->moved = true;
        self->legs = pattern_states(config->pattern.id, self->complementary, c->sector, self->reverse);
        self->kind = (uint8_t)pattern_kind(config->pattern.id, c->sector);
    }
    plan_sample(plan, &config->pattern, kind, &out->on);
    out->then = self->legs;
    out->commutate_at = plan->commutate_at;
    out->sample_at = plan->sample_at;
    if (self->lost) {
        out->legs = PM_LEGS_OFF;
        out->commutate_at = 0;
    }
}
