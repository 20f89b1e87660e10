/* Finite-set predictive current control: each period the legs are held in the one of eight switch states that by the model
 * brings the current nearest to its reference (METHODS.md 1.3.2.4, row 7; 12.5.1, row 145).
 *
 *   i'    where the voltage that acts until k+1 takes the current, winding_model.h
 *   i''_x where the state x takes it from there until k+2:  i''_x = i''_0 + T_s/L v_x
 *   cost  |i_d* - i''_dx| + |i_q* - i''_qx|
 * with v_x of switch_states.h in the frame at the middle of [k+1, k+2), i''_0 that of no voltage. The least cost wins; of
 * the two zero states the one that moves fewer legs. While the error is more than the link's voltage makes up for in a period,
 * the current along d counts L_d/L_q as much: else no state would be worth it for i_q where L_q > sqrt(3) L_d and an axis of the
 * bridge lies along d.
 *
 * predictive_delay = 0 takes the sampled current for i', as if the state were applied at once (row 7): the choice is then a
 * period late and the current ripples 2.3 to 2.8 times as much.
 *
 * Step of the reference, while the voltage limits it:
 *   t_90 <= 0.9 L_q di / (v_dc/sqrt(3) - omega psi_m) + 2.5 T_s
 * The current ripples by V_dc T_s / L as with finite_set.h, which has what else holds for states: sensors in the lines, 20 kHz
 * and more, no injection. Slowed, the reference is brought to `share` of its distance from i'. limited: the voltage that would
 * reach the reference exceeds the link's along an axis.
 *
 * Cost: 300 instructions a period more than the PI. Range: deadbeat.h. Functions as regulator.h says.
 * Tests: tests/unit/control/predictive_test.cpp, tests/contract/regulator_contract_test.cpp,
 * tests/scenario/predictive.yaml, predictive_step.yaml, twin_predictive.yaml. */
#ifndef CONTROL_PREDICTIVE_H
#define CONTROL_PREDICTIVE_H

#include "firmware/control/winding_model.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    winding_model_t model;
    pm_q_t weight_d;  /* L_d / L_q */
    pm_unit_t share;  /* of the way to the reference in a period */
    bool compensates; /* the delay */
} predictive_config_t;

typedef struct {
    pm_dq_t v;     /* Q28; of the state commanded in the last period */
    uint16_t legs; /* that state */
} predictive_t;

void predictive_reset(predictive_t *self, const predictive_config_t *config, pm_dq_t v, pm_dq_t i,
                      pm_q_t omega);
void predictive_step(predictive_t *self, const predictive_config_t *config, const regulator_in_t *in,
                     regulator_out_t *out);

void make_predictive(maker_t *m, predictive_config_t *c);
pm_num_t predictive_bandwidth(const maker_t *m);
void predictive_slow_down(predictive_config_t *config, pm_unit_t share);

#ifdef __cplusplus
}
#endif

#endif
