#include "injection/pulses.h"

#include "firmware/math/root.h"
#include "firmware/math/trig.h"

/* Periods with zero current before the next pulse: the current has ended and the converter shows it. */
#define QUIET 3
/* Of a quotient in Q28, a 64th of it, to PM_SIGMA_BITS. */
#define PER_SIGMA 16384
/* Each step leaves the ratio of saliency and mean of the inductances' inverses, 0.3 at most, of what is wrong. */
#define ITERATIONS PULSES_BALANCING
#define GAIN_MAX   PM_Q(0.125)

const pm_angle_t pulses_axis[PULSES_AXES] = {0, 1431655765U, 2863311531U}; /* 0, 120, 240 degrees */

static bool is_below(pm_q_t least, pm_abc_t i)
{
    return pm_abs(i.a) < least && pm_abs(i.b) < least && pm_abs(i.c) < least;
}

/* The output of a step acts over the next period, so a pulse commanded in n steps ends at step n + 2. A zero vector
 * follows it: with all low switches on, shunts below them see the current at that instant. */
static pm_procedure_t drive_pulse(pulses_t *self, const pulses_config_t *config, uint32_t axis, bool reverse,
                                  pm_abc_t i, pulses_out_t *out)
{
    if (self->timer <= config->periods) {
        pulses_apply(out, axis, reverse, config->duty);
    } else if (self->timer > config->periods + 1U) {
        /* what rings is not zero, and no wire is off */
        if (is_below(pm_max(5 * config->i_noise, PULSES_STEPS), i)) {
            return PM_FAILED_OPEN;
        }
        self->i = i;
        self->decaying = true;
        self->timer = 0;
        self->quiet = 0;
    } else {
        out->driven = true;
    }
    return PM_RUNNING;
}

pm_procedure_t pulses_step(pulses_t *self, const pulses_config_t *config, uint32_t axis, bool reverse,
                           pm_abc_t i, pulses_out_t *out)
{
    *out = (pulses_out_t){.driven = false};
    self->timer++;
    if (!self->decaying) {
        return drive_pulse(self, config, axis, reverse, i, out);
    }
    self->quiet = is_below(config->i_zero, i) ? self->quiet + 1U : 0U;
    if (self->quiet < QUIET) {
        return self->timer > config->timeout ? PM_FAILED_TIMEOUT : PM_RUNNING;
    }
    self->decaying = false;
    self->timer = 0;
    self->pulse++;
    return PM_DONE;
}

void pulses_add(pulses_t *self, uint32_t axis, bool reverse)
{
    for (uint32_t k = 0; k < PULSES_AXES; k++) {
        const pm_q_t i = pulses_leg(&self->i, k);
        self->e[axis][k] += reverse ? -i : i;
    }
}

static bool are_gains(const pm_q_t g[PULSES_AXES])
{
    return pm_abs(g[0]) < GAIN_MAX && pm_abs(g[1]) < GAIN_MAX && pm_abs(g[2]) < GAIN_MAX;
}

/* False: these are no gains. */
static bool improve(pulses_t *self)
{
    pm_q_t change[PULSES_AXES];
    for (uint32_t x = 0; x < PULSES_AXES; x++) {
        pm_q_t left = 0;
        for (uint32_t k = 0; k < PULSES_AXES; k++) {
            left += self->e[x][k] - pm_mul(self->g[k], self->e[x][k]);
        }
        change[x] = pm_div(left, self->e[x][x]) / 3 * 2;
    }
    const pm_q_t mean = change[0] / 3 + change[1] / 3 + change[2] / 3;
    for (uint32_t k = 0; k < PULSES_AXES; k++) {
        self->g[k] += change[k] - mean;
    }
    return are_gains(self->g);
}

static void equalise(pulses_t *self)
{
    for (uint32_t x = 0; x < PULSES_AXES; x++) {
        for (uint32_t k = 0; k < PULSES_AXES; k++) {
            self->e[x][k] -= pm_mul(self->g[k], self->e[x][k]);
        }
    }
}

pm_procedure_t pulses_balance(pulses_t *self)
{
    self->steps++;
    if (self->steps > ITERATIONS) {
        return PM_DONE;
    }
    if (!improve(self)) {
        return PM_FAILED_UNEVEN;
    }
    if (self->steps == ITERATIONS) {
        equalise(self);
    }
    return PM_RUNNING;
}

/* A vector is turned by 120 degrees as its phases change places: c becomes a, a b, and b c. */
pm_ab_t pulses_saliency(const pulses_t *self)
{
    const pm_q_t *of_a = self->e[0], *of_b = self->e[1], *of_c = self->e[2];
    return pm_clarke((pm_abc_t){.a = of_a[0] + of_b[2] + of_c[1],
                                .b = of_a[1] + of_b[0] + of_c[2],
                                .c = of_a[2] + of_b[1] + of_c[0]});
}

pm_sigma_t pulses_margin(pm_q_t length, pm_q_t noise)
{
    return pm_div(length / 64, noise) / PER_SIGMA;
}

pm_q_t pulses_sum(const pulses_t *self)
{
    return self->e[0][0] + self->e[1][1] + self->e[2][2];
}

pm_procedure_t pulses_salient(pm_q_t length, pm_q_t sum, pm_q_t s_min, pm_sigma_t margin)
{
    return length < pm_mul(s_min, sum) || margin < PULSES_SURE ? PM_FAILED_SALIENCY : PM_DONE;
}

pm_procedure_t pulses_pole(pm_ab_t w, const pulses_pole_t *limits, pulses_found_t *found)
{
    const pm_dq_t seen = pm_park(w, pm_dir(found->theta));
    const pm_sigma_t margin = pulses_polarity(seen.d, pm_abs(seen.q) + limits->bridge, limits->noise);
    if (margin < PULSES_SURE) {
        return PM_FAILED_POLARITY;
    }
    found->theta += (seen.d < 0) != limits->reversed ? PM_TURN(0.5) : 0U;
    found->margin = pm_min(margin, found->margin);
    return PM_DONE;
}

pm_sigma_t pulses_polarity(pm_q_t along, pm_q_t bridge, pm_q_t noise)
{
    return pulses_margin(pm_max(pm_abs(along) - bridge, 0), noise);
}
