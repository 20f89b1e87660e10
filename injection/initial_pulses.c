#include "injection/initial_pulses.h"

#include "firmware/math/root.h"
#include "firmware/math/trig.h"

#define PULSES 6
/* Periods with zero current before the next pulse: the current has ended and the converter shows it. */
#define QUIET 3
/* Of a quotient in Q28, a 64th of it, to PM_SIGMA_BITS. */
#define PER_SIGMA 16384

static const pm_angle_t axis[3] = {0, 1431655765U, 2863311531U}; /* 0, 120, 240 degrees */

void initial_pulses_reset(initial_pulses_t *self)
{
    *self = (initial_pulses_t){0};
}

static void apply(const initial_pulses_t *self, const initial_pulses_config_t *config,
                  initial_pulses_out_t *out)
{
    const uint16_t leg = self->pulse / 2U;
    const bool reverse = (self->pulse & 1U) != 0U;
    for (uint16_t x = 0; x < 3U; x++) {
        out->duty[x] = ((x == leg) != reverse) ? config->duty : 0;
    }
    out->driven = true;
}

static bool is_zero(const initial_pulses_config_t *config, pm_ab_t i)
{
    return pm_abs(i.alpha) < config->i_zero && pm_abs(i.beta) < config->i_zero;
}

static void take(initial_pulses_t *self, pm_ab_t i)
{
    pm_angle_t angle = axis[self->pulse / 2U];
    if ((self->pulse & 1U) != 0U) {
        angle += PM_TURN(0.5);
    }
    const pm_ab_t turned = pm_park_inverse((pm_dq_t){.d = i.alpha, .q = i.beta}, pm_dir(angle));
    self->y.alpha += turned.alpha;
    self->y.beta += turned.beta;
    self->w.alpha += i.alpha;
    self->w.beta += i.beta;
}

static pm_procedure_t conclude(initial_pulses_t *self, const initial_pulses_config_t *config)
{
    self->length = pm_hypot(self->y.alpha, self->y.beta);
    if (self->length < config->y_min) {
        return PM_FAILED_SALIENCY;
    }
    self->theta = pm_atan2(self->y.beta, self->y.alpha) / 2U;
    self->along = pm_park(self->w, pm_dir(self->theta)).d;
    if (pm_abs(self->along) < config->w_min) {
        return PM_FAILED_POLARITY;
    }
    if (self->along < 0) {
        self->theta += PM_TURN(0.5);
    }
    return PM_DONE;
}

/* The noise of a component is a fifth of w_min. */
pm_sigma_t initial_pulses_margin(const initial_pulses_t *self, const initial_pulses_config_t *config)
{
    const pm_q_t least = pm_min(self->length, pm_abs(self->along));
    return pm_div(least / 64, config->w_min) / PER_SIGMA * 5;
}

/* The output of a step acts over the next period, so a pulse commanded in n steps ends at step n + 1. */
pm_procedure_t initial_pulses_step(initial_pulses_t *self, const initial_pulses_config_t *config, pm_ab_t i,
                                   initial_pulses_out_t *out)
{
    *out = (initial_pulses_out_t){.driven = false};
    self->timer++;
    if (!self->decaying) {
        if (self->timer <= config->periods) {
            apply(self, config, out);
        } else if (self->timer > config->periods + 1U) {
            if (is_zero(config, i)) {
                return PM_FAILED_TIMEOUT; /* nothing connected */
            }
            take(self, i);
            self->decaying = true;
            self->timer = 0;
            self->quiet = 0;
        }
        return PM_RUNNING;
    }
    self->quiet = is_zero(config, i) ? self->quiet + 1U : 0U;
    if (self->quiet < QUIET) {
        return self->timer > config->timeout ? PM_FAILED_TIMEOUT : PM_RUNNING;
    }
    self->decaying = false;
    self->timer = 0;
    self->pulse++;
    return self->pulse < PULSES ? PM_RUNNING : conclude(self, config);
}
