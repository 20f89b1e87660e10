/* Commutation where the crossings of a third harmonic are uneven (METHODS.md 11.7; rows 135 and 136).
 *
 * Unlike phases move the star point, unlike dividers the mean of the terminals. With H and L the legs that conduct, O the
 * open one, K = f e'(0) of its terminal (zero_crossing.h) and gains 1 + eps_X of the dividers, in the on time
 *   virtual_third.h    e_0 = (f / 3) e - dv / 6 + (eps_H + eps_O / 2) v_dc / 3
 *   third_harmonic.h   v_zero = e_0 + dv / 3              behind a filter di/dt is zero on average
 *   dv = (R_H - R_L) i + (L_H - L_L) di/dt
 * and the crossing is seen late by an angle of
 *   virtual            delta = +-(dv / 2 - (eps_H + eps_O / 2) v_dc) / K
 *   open terminal      delta = +-(dv / 2 -          eps_O / 2  v_dc) / K              + upwards, - downwards
 * Unlike phases do the same to both, as voltage and slope are a third of the terminal's. Dividers do up to three times as
 * much: here that of the high leg counts in full. An offset of the star point's channel moves up and down crossings apart.
 *
 * The six deviations are learnt as those of terminals (thresholds.h), as voltages, which speeds share, and taken off the
 * instants instead of the voltages, at 1 kHz for the speed of that millisecond:
 *   t_z = t_seen + shift,   shift = t_60 u / swing,   u = thresholds_at(), |u| <= 3/8 swing
 * Instants can be moved whatever has found them: a filter's output, a comparator. As of thresholds, of on times only
 * where it is the terminals that are looked at.
 *
 * phase_compensation_slow(): 1 kHz, six divisions. In a period: an addition at a crossing.
 * Tests: tests/unit/bldc/phase_compensation_test.cpp, tests/scenario/six_step_unlike.yaml. */
#ifndef BLDC_PHASE_COMPENSATION_H
#define BLDC_PHASE_COMPENSATION_H

#include "bldc/thresholds.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    int32_t shift[SECTORS]; /* counts, + later */
} phase_compensation_t;

/* For 60 degrees in t_60 counts, in which the signal rises by swing > 0. */
void phase_compensation_slow(phase_compensation_t *self, const thresholds_t *learnt, bool reverse,
                             uint32_t t_60, pm_q_t swing);

#ifdef __cplusplus
}
#endif

#endif
