/* Periods of block commutation, for count.py: those without a crossing, with one, and those after one, in which
 * thresholds are learnt. The rotor turns evenly; its EMF is a sine and the divider of leg A 1 % too high. */
#include <stdio.h>
#include <string.h>

#include "bldc/six_step.h"
#include "firmware/math/trig.h"

#define N      2125
#define T_60   21250U /* ten periods in a turn of 30: 80 krpm, 40 kHz */
#define PERIOD (2U * N)

/* A count of its own, so that no linker takes them for one function. */
#define PERIOD_OF(name)                                                                                      \
    static unsigned name##_periods;                                                                          \
    void period_##name(six_step_t *self, const six_step_config_t *c, const six_step_in_t *in,                \
                       six_step_out_t *out);                                                                 \
    __attribute__((noinline, noclone)) void period_##name(six_step_t *self, const six_step_config_t *c,      \
                                                          const six_step_in_t *in, six_step_out_t *out)      \
    {                                                                                                        \
        name##_periods++;                                                                                    \
        six_step_step(self, c, in, out);                                                                     \
    }

PERIOD_OF(plain)
PERIOD_OF(crossing)
PERIOD_OF(learning)

static const six_step_config_t preset = {
    .pattern = {PATTERN_H_PWM_L_ON, true, N, 170, 1020},
    .crossing = {ZERO_LINK, PM_Q(0.35 / 40), 510, PM_Q(0.41), T_60},
    .commutation = {PM_FRAC(0.5 / 6), 0, 6 * T_60, 6},
    .thresholds = {PM_FRAC(0.075), PM_FRAC(0.05), PM_Q(0.05)},
    .compared = -1,
};

/* Terminals at an instant in a sector; sector 0 begins at 30 degrees at instant 0. */
static void terminals(uint32_t at, uint32_t sector, zero_sample_t *sample)
{
    const sector_t legs = sector_legs(sector, false);
    const pm_angle_t theta = (pm_angle_t)((uint64_t)at * 0x2AAAAAABU / T_60) - PM_TURN(1.0 / 12) +
                             (pm_angle_t)(0U - sector) * 0x2AAAAAABU;
    const pm_q_t e = pm_unit(PM_Q(0.39), pm_dir(theta).sin);
    sample->v_dc = PM_Q(0.6);
    sample->v[legs.high] = sample->v_dc;
    sample->v[legs.low] = 0;
    sample->v[legs.open] = pm_clamp(sample->v_dc / 2 + (sector_rising(sector) ? e : -e), 0, sample->v_dc);
    sample->v[0] += sample->v[0] / 100;
}

static six_step_config_t config; /* not known to the compiler */

int main(void)
{
    config = preset;
    static six_step_t self, ahead;
    static six_step_in_t in;
    static zero_sample_t sample;
    six_step_out_t out;
    six_step_reset(&self, &config, PM_TURN(1.0 / 12), PM_ONE, 0);
    in.u = PM_Q(0.85);
    for (uint32_t k = 0; k < 3000; k++) {
        in.now = k * PERIOD;
        ahead = self;
        six_step_step(&ahead, &config, &in, &out);
        if (self.learn && !ahead.learn) {
            period_learning(&self, &config, &in, &out);
        } else if (ahead.commutation.crossing != self.commutation.crossing) {
            period_crossing(&self, &config, &in, &out);
        } else {
            period_plain(&self, &config, &in, &out);
        }
        /* of the period that has been planned a call ago */
        const six_step_plan_t *plan = &self.plan[0];
        in.sample = plan->sample_at != 0U ? &sample : NULL;
        const bool next = plan->commutate_at != 0U && plan->commutate_at < plan->sample_at;
        terminals(in.now + plan->sample_at, next ? sector_next(plan->sector) : plan->sector, &sample);
    }
    printf("bldc_cost plain %u crossing %u learning %u lost %d t_60 %lu u_V %08lx %08lx %08lx state %lu "
           "config %lu\n",
           plain_periods, crossing_periods, learning_periods, self.lost ? 1 : 0,
           (unsigned long)commutation_t_60(&self.commutation), (unsigned long)self.thresholds.u_V[0],
           (unsigned long)self.thresholds.u_V[1], (unsigned long)self.thresholds.u_V[2],
           (unsigned long)sizeof self, (unsigned long)sizeof config);
    return self.lost || learning_periods < 10U || crossing_periods < 100U ? 1 : 0;
}
