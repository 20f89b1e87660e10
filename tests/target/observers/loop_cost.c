/* What follows a source, each as a function for count.py: the three position observers, the second harmonic's
 * suppression, the correction of wrong parameters, and at 1 kHz that and the speed estimate. */
#include "firmware/math/trig.h"
#include "observers/loop.h"
#include "observers/mismatch.h"
#include "observers/second_harmonic.h"
#include "observers/speed.h"

#define COST(result, name, ...)                                                                              \
    result cost_##name(__VA_ARGS__);                                                                         \
    __attribute__((noinline)) result cost_##name(__VA_ARGS__)

COST(void, loop, loop_t *self, const loop_config_t *c, pm_pll_t *pll, const pm_pll_config_t *gains,
     pm_q_t eps)
{
    pm_pll_correct(pll, gains, loop_eps(self, c, pll, gains, eps));
}

COST(pm_q_t, second_harmonic, second_harmonic_t *self, const second_harmonic_config_t *c, const pm_dir_t *dir,
     pm_q_t eps)
{
    return second_harmonic_step(self, c, *dir, eps);
}

COST(pm_q_t, mismatch, mismatch_t *self, mismatch_window_t *window, const mismatch_config_t *c,
     const mismatch_in_t *in, pm_q_t eps)
{
    return mismatch_step(self, window, c, in, PM_ONE, eps);
}

COST(void, mismatch_slow, mismatch_t *self, mismatch_window_t *window, const mismatch_config_t *c,
     const mismatch_in_t *in)
{
    mismatch_slow(self, window, c, in);
}

COST(pm_q_t, speed, speed_t *self, const speed_config_t *c, const speed_in_t *in)
{
    return speed_step(self, c, in);
}

static volatile int32_t sink;

int main(void)
{
    static pm_pll_t pll;
    static const pm_pll_config_t gains = {PM_FRAC(0.018), PM_FRAC(0.0046), PM_Q(0.55)};
    for (int32_t id = 0; id < (int32_t)LOOP_COUNT; id++) {
        const loop_config_t c = {.id = (loop_id_t)id, .k_acceleration = 1800000};
        loop_t self = {0};
        loop_slow(&self, &c, PM_ONE);
        for (int32_t k = 0; k < 50; k++) {
            cost_loop(&self, &c, &pll, &gains, k * 1000000 - 25000000);
            sink = pll.omega;
        }
    }
    for (int32_t id = 1; id < (int32_t)SECOND_HARMONIC_COUNT; id++) {
        const second_harmonic_config_t c = {
            (second_harmonic_id_t)id, PM_FRAC(0.004), PM_Q(0.52), PM_Q(0.085), 0, PM_Q(0.05), PM_FRAC(0.054)};
        second_harmonic_t self;
        second_harmonic_reset(&self);
        second_harmonic_slow(&self, &c, PM_Q(0.4), PM_ONE);
        for (uint32_t k = 0; k < 50; k++) {
            const pm_dir_t dir = pm_dir(k * 100000000U);
            sink = cost_second_harmonic(&self, &c, &dir, (int32_t)k * 1000000 - 25000000);
        }
    }
    static mismatch_t mismatch;
    static mismatch_window_t window;
    const mismatch_config_t wrong = {.id = MISMATCH_Q_AXIS,
                                     .periods = 10,
                                     .samples = 10,
                                     .i = PM_Q(0.04),
                                     .model = {.L_d = PM_Q(0.22), .L_q = PM_Q(0.25), .psi_m = PM_Q(0.58)}};
    for (uint32_t k = 0; k < 200; k++) { /* at the end of windows too */
        const mismatch_in_t in = {.pll = &pll, .k_theta = PM_Q(0.55), .i = {0, window.injected}};
        sink = cost_mismatch(&mismatch, &window, &wrong, &in, 0);
        cost_mismatch_slow(&mismatch, &window, &wrong, &in);
    }
    static speed_t speed;
    const speed_config_t c = {.id = SPEED_COMBINED,
                              .window = 6,
                              .turn_step = 10,
                              .R = PM_Q(0.13),
                              .L_d = PM_Q(0.5),
                              .psi_m = PM_Q(0.28),
                              .per_step = PM_GAIN(1.6),
                              .rise = PM_GAIN(1.7),
                              .k_theta = PM_Q(0.55),
                              .per_turn = PM_GAIN(1.9),
                              .k_ratio = PM_FRAC(0.28),
                              .k_mean = PM_FRAC(0.03)};
    for (uint32_t k = 0; k < 50; k++) {
        const speed_in_t in = {.theta = k * 80000000U, .omega = PM_Q(0.3), .i = {0, PM_Q(0.2)}};
        sink = cost_speed(&speed, &c, &in);
    }
    return 0;
}
