/* Deadbeat current control with a finite set of voltages: each period the legs are held in the one of eight
 * switch states whose voltage is nearest to the one that deadbeat.h asks for (METHODS.md 12.5.2, row 146,
 * finite set).
 *
 *   v* from deadbeat.h, in the stator:  e_n = unit vector at n 60 degrees, n = 0 ... 5
 *   n with the largest v* . e_n;  v = 2/3 v_dc e_n, if v* . e_n > v_dc / 3;  else v = 0
 * which are the cells of points nearest to each. Of the two zero states the one that moves fewer legs is
 * taken. What was applied, not v*, is what the prediction of the next period begins with.
 *
 * No modulator and no dead-time compensation: a leg switches at most once a period, at its beginning, where
 * the currents are sampled: it needs sensors that do not mind, in line with the phases. The current ripples
 * by V_dc T_s / L, more with wrong inductances: for 20 kHz and more, and windings of some millihenry. An
 * injected voltage would be lost in the choice, so it is refused with injection.
 *
 * Cost: 120 instructions a period more than the PI. Range and errors: deadbeat.h. Functions as regulator.h
 * says. Tests: tests/unit/control/finite_set_test.cpp, tests/contract/regulator_contract_test.cpp,
 * tests/scenario/finite_set.yaml. */
#ifndef CONTROL_FINITE_SET_H
#define CONTROL_FINITE_SET_H

#include "firmware/control/deadbeat.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    deadbeat_config_t deadbeat;
} finite_set_config_t;

typedef struct {
    deadbeat_t deadbeat;
    uint16_t legs; /* of the last period */
} finite_set_t;

void finite_set_reset(finite_set_t *self, const finite_set_config_t *config, pm_dq_t v, pm_dq_t i,
                      pm_q_t omega);
void finite_set_step(finite_set_t *self, const finite_set_config_t *config, const regulator_in_t *in,
                     regulator_out_t *out);

void make_finite_set(maker_t *m, finite_set_config_t *c);
pm_num_t finite_set_bandwidth(const maker_t *m);
void finite_set_slow_down(finite_set_config_t *config, pm_unit_t share);

#ifdef __cplusplus
}
#endif

#endif
