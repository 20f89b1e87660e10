/* What the response of each axis to its own pulses says of the position (METHODS.md 9.3.2, 9.3.3; METHODS-ADDENDUM.md
 * E18): what the methods that look at one value of a pulse share. The value is a current or a drop of the DC-link
 * voltage, P_x+ at the end of the pulse + along the axis g_x, P_x- at that of -.
 *   P_x+- = I_0 + I_2 cos 2 (theta - g_x) +- 1/2 D_x
 *   D_x   = I_1 cos(theta - g_x) + I_3 cos 3 (theta - g_x)
 *   y = 2/3 sum (P_x+ + P_x-) e^{j 2 g_x} = 2 I_2 e^{j 2 theta}     saliency: the angle, modulo 180 degrees
 *   w = 2/3 sum D_x e^{j g_x}             = I_1 e^{j theta}         first-order saturation: the polarity
 * The third harmonic I_3 is alike in all three axes and leaves w, not so the largest D_x alone.
 *   s = 3 |y| / sum (P_x+ + P_x-)         pulses.h
 *   margin of saliency = |y| / noise
 *   margin of polarity: pulses_pole() of w
 * noise: 1.155 times that of one value, of both. A gain of one of three sensors is no noise: 1 % of one against the
 * others errs by 0.17 I_0 / I_2 degrees.
 * For the slow part, at most 400 instructions. Tests: tests/unit/injection/basic_pulses_test.cpp, dc_link_pulses_test.cpp. */
#ifndef INJECTION_PRIMARY_H
#define INJECTION_PRIMARY_H

#include "injection/pulses.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_q_t sum[PULSES_AXES];        /* P_x+ + P_x- */
    pm_q_t difference[PULSES_AXES]; /* D_x */
} primary_t;

typedef struct {
    pm_q_t s_min;       /* pulses.h */
    pulses_pole_t pole; /* its noise is that of y, too */
} primary_config_t;

/* PM_DONE, PM_FAILED_SALIENCY or PM_FAILED_POLARITY */
pm_procedure_t primary_locate(const primary_t *self, const primary_config_t *config, pulses_found_t *found);

/* The polarity by D; found->theta turns by half a turn where it is the other, found->margin is that of saliency before
 * and the smaller one afterwards. PM_DONE or PM_FAILED_POLARITY */
pm_procedure_t primary_polarity(const pm_q_t difference[PULSES_AXES], const primary_config_t *config,
                                pulses_found_t *found);

#ifdef __cplusplus
}
#endif

#endif
