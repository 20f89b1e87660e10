/* Initial position by six voltage pulses in vector form (METHODS.md 9.2, 9.4.1, 9.4.2; rows 98, 100).
 *
 * Pulses A+ A- B+ B- C+ C- (injection/pulses.h, which removes the difference of the sensors' gains). With i the
 * current vector at the end of the pulse along the direction g:
 *   y = sum i e^{j g} = 6 I_2 e^{j 2 theta}     saliency: the angle, modulo 180 degrees
 *   w = sum i         ~ e^{j theta}             first-order saturation: the polarity
 * Both sums cancel offsets. The torque of a pair of pulses averages to zero.
 *   margin of saliency = |y| / (3 i_noise)
 *   margin of polarity: pulses_pole() of w, with i_bridge and 2 i_noise
 * as a component of w has the noise of six currents of 2/3 i_noise^2 each, that of y 1.5 times as much.
 *
 * Call initial_pulses_step() each period until it is not PM_RUNNING; after PM_DONE initial_pulses_find() each
 * millisecond, outside the control interrupt, which gives the position or the reason why there is none: s too
 * small for this machine, w below five times its noise, or gains that no sensors have. Duration: about
 * 6 (2 n + 5) periods and 5 ms: 15 ms on IPM-1000. Peak of the current: i_pulse and up to half of it by saturation. Movement: 0.05
 * degrees mechanical with IPM-1000, 0.02 with SPM-400, as each pulse is followed by its opposite.
 * Tests: tests/unit/injection/initial_pulses_test.cpp, tests/scenario/ipm_start_grid.yaml. */
#ifndef INJECTION_INITIAL_PULSES_H
#define INJECTION_INITIAL_PULSES_H

#include "injection/pulses.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pulses_t train;
    pm_ab_t w;
} initial_pulses_t;

void initial_pulses_reset(initial_pulses_t *self);
pm_procedure_t initial_pulses_step(initial_pulses_t *self, const pulses_config_t *config, pm_abc_t i,
                                   pulses_out_t *out);
pm_procedure_t initial_pulses_find(initial_pulses_t *self, const pulses_config_t *config);

#ifdef __cplusplus
}
#endif

#endif
