/* INFORM: test voltages of whole periods along the axes of the stator (METHODS.md 4.6.1, row 47).
 *
 * In each period V_h is added along the axis u of axes.h. The change of current over that period is read:
 *   c = i(k) - i(k-1),  F = V_h T_s
 * A test voltage and its opposite follow each other, so that after each pair the current is without carrier:
 * that sample is the fundamental current, held for the period that follows.
 *
 * No sample beside the usual ones, so any board can do it; the change over a single period is small, and what
 * is read follows the edges of the bridge: noise and leg capacitance count as with the square wave. eps,
 * misfit: axes.h. 80 instructions a period. Functions as injection.h says.
 * Tests: tests/unit/injection/inform_test.cpp, tests/scenario/inform.yaml. */
#ifndef INJECTION_INFORM_H
#define INJECTION_INFORM_H

#include "injection/axes.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    axes_config_t axes;
    pm_q_t v_h;
} inform_config_t;

typedef struct {
    axes_t axes;
    pm_ab_t i;    /* current at k-1 */
    pm_dq_t i_dq; /* fundamental current */
} inform_t;

void inform_reset(inform_t *self, const inform_config_t *config, const obs_in_t *in);
void inform_step(inform_t *self, const inform_config_t *config, const injection_in_t *in,
                 injection_out_t *out);
void inform_slow(inform_t *self, const inform_config_t *config, const obs_in_t *in);
obs_out_t inform_last(const inform_t *self, const inform_config_t *config);

void make_inform(maker_t *m, inform_config_t *c);
injection_limits_t inform_limits(const maker_t *m);
pm_num_t inform_answer(const maker_t *m);

#ifdef __cplusplus
}
#endif

#endif
