/* Initial position by six voltage pulses, the basic method: of each the current of its own leg alone (METHODS.md 9.3;
 * row 99). For boards or wirings that show one current of a pulse reliably, and as a measure of what initial_pulses.h
 * gains by all three.
 *
 * Pulses A+ A- B+ B- C+ C- (injection/pulses.h). With P_x+ and P_x- the currents of leg x in its two pulses:
 *   theta = 1/2 atan2(sqrt 3 (s_C - s_B), 2 s_A - s_B - s_C),  s_x = P_x+ + P_x-
 * and the polarity by D_x = P_x+ - P_x- (injection/primary.h has the equations and the margins).
 * Offsets cancel in s and add to D. The sensors' gains do not cancel, and no sum of currents shows them: 1.01, 1 and
 * 0.99 err by up to 9 degrees where the saliency is a twentieth (SPM-400), by 2 where it is a fourth (IPM-1000).
 *
 * Use as initial_pulses.h; the same reasons but for PM_FAILED_UNEVEN. Duration: about 6 (2 n + 5) periods and 1 ms.
 * Movement and peak of the current are those of initial_pulses.h.
 * Tests: tests/unit/injection/basic_pulses_test.cpp, tests/scenario/basic_pulses.yaml, basic_pulses_spm.yaml, pulses_turning.yaml. */
#ifndef INJECTION_BASIC_PULSES_H
#define INJECTION_BASIC_PULSES_H

#include "injection/primary.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pulses_t train;
    pm_q_t difference[PULSES_AXES]; /* D_x */
} basic_pulses_t;

void basic_pulses_reset(basic_pulses_t *self);
pm_procedure_t basic_pulses_step(basic_pulses_t *self, const pulses_config_t *config, pm_abc_t i,
                                 pulses_out_t *out);
pm_procedure_t basic_pulses_find(basic_pulses_t *self, const pulses_config_t *config);

/* Of currents, from what six pulses in vector form are judged by. */
primary_config_t basic_pulses_limits(const pulses_config_t *config);

#ifdef __cplusplus
}
#endif

#endif
