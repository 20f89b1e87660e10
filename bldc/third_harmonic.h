/* Crossings of the third harmonic, which are those of the open leg (METHODS.md 11.3.1, 11.3.2.1; rows 124 and 125).
 *
 * The star point of three equal resistors against the motor's own, firmware/drive/neutral.h, has a third of the sum of the EMFs:
 *   trapezoid   e_0 = e / 3 about the crossing of the open leg's EMF e, between +-E / 3
 *   sine        e_0 = -3 omega psi_3 sin 3 theta
 * It crosses zero with the open leg, upwards in even sectors, downwards in odd ones (psi_3 > 0, either direction), whatever the
 * switches do and while the leg that has gone freewheels: nothing is blanked, a sample of any instant counts, also with a
 * duty of 1. Which of the three crossings of a kind it is, is counted.
 *
 * The crossing lies between the last sample ahead of it and the first past it, y rising towards it:
 *   t_z = t_1 + (t_2 - t_1) (-y_1) / (y_2 - y_1) - lag
 * once one sample was further ahead than an eighth of what it rises by in 60 degrees: noise about zero, or a rotor that stands,
 * is no crossing.
 *
 * lag: of the channel's RC, with which the pulses of the carrier and what unlike resistors let through are filtered:
 *   u   = (2 / pi) atan(pi RC / t_60)                       pi / t_60 = 3 omega
 *   lag = t_60 u / 2                                        sine: atan(3 omega RC) / 3 as an angle
 *   lag = t_60 (u / 2 + 0.09705 u^2 (1 - u))                trapezoid, whose e_0 is a triangle
 * The second is within 0.05 degrees of the exact one, lag = RC (1 - exp(-lag / RC) / cosh(t_60 / 2 RC)). With an RC beyond
 * t_60 the channel integrates, and what crosses is the flux, at the instants of commutation (lag = t_60 / 2).
 *
 * third_harmonic_step(): one sample a period, a division where it finds a crossing. At least two
 * samples in a sector. third_harmonic_slow(): 1 kHz, two divisions.
 * Tests: tests/unit/bldc/third_harmonic_test.cpp, tests/scenario/six_step_third.yaml. */
#ifndef BLDC_THIRD_HARMONIC_H
#define BLDC_THIRD_HARMONIC_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/math/fixed.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    int32_t pi_rc;  /* pi RC, counts, >= 0 */
    bool trapezoid; /* else a sine */
    bool negative;  /* psi_3 < 0 */
} third_harmonic_config_t;

typedef struct {
    uint32_t at;       /* of the last sample, counts */
    pm_q_t y;          /* of it, towards the crossing that is looked for: < 0 ahead */
    uint32_t crossing; /* instant of the one found last */
    uint32_t lag;      /* counts */
    pm_q_t seen;       /* ahead is what is further away than this, > 0 */
    bool ahead;        /* a sample since the last crossing was */
} third_harmonic_t;

/* Looks for a crossing from now on. */
void third_harmonic_open(third_harmonic_t *self, uint32_t now);

/* One sample, at `now`; rising: the crossing that is looked for is an upward one. True when it has found it. */
bool third_harmonic_step(third_harmonic_t *self, const third_harmonic_config_t *config, pm_q_t v_zero,
                         uint32_t now, bool rising);

/* The crossing that was looked for is not to come any more: the next one is looked for. */
void third_harmonic_skip(third_harmonic_t *self);

/* Lag at 60 degrees in t_60 counts, and what is seen of a rise of `swing` in them. */
void third_harmonic_slow(third_harmonic_t *self, const third_harmonic_config_t *config, uint32_t t_60,
                         pm_q_t swing);

#ifdef __cplusplus
}
#endif

#endif
