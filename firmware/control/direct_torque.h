/* Direct torque control: hysteresis of torque and stator flux chooses the state of the switches each period (METHODS.md
 * 1.3.2.3, row 6).
 *
 * In the estimated frame, from sample k to k+1, with the voltage v that acts until then:
 *   psi_k  = psi + k_c (L i + psi_m - psi)                 held by the currents, corner 500 Hz
 *   psi    = psi_k + T_s (v - R i) - T_s omega J psi_k     second order in T_s omega
 *   torque = psi_d i_q' - psi_q i_d'                       of 1.5 pole_pairs; i' of winding_model.h
 * References are those of i_ref: psi* = L i_ref + psi_m, torque* = psi*_d i_q* - psi*_q i_d*. With k the sector of
 * switch_states.h along which psi points in the stator:
 *            torque up   torque down   torque within
 *   flux up    k + 1        k - 1        zero state, k     beyond the wide band
 *   flux down  k + 2        k - 2        zero state, k + 3 beyond the wide band
 * Torque goes up from torque_band below torque* until torque* is passed, down likewise; flux goes up from 1 % below |psi*|, down from
 * 1 % above; 2 % is the wide band, without which nothing would magnetise at no torque. The choice acts from k+1 on, for which
 * torque and flux are predicted, so that the torque leaves its band by what a period moves it:
 *   1.5 pole_pairs psi_m (2 v_dc/3 + omega psi_m) T_s / L_q
 * i_ref is what torque and flux give: 1 % of psi_m is psi_m / (100 L_d) along d. What else holds for states: finite_set.h. Slowed it
 * is the same. limited: as predictive.h.
 *
 * Cost: 150 instructions a period more than the PI. Range: deadbeat.h, psi below 2 in per-unit. Functions as regulator.h says.
 * Tests: tests/unit/control/direct_torque_test.cpp, tests/contract/regulator_contract_test.cpp,
 * tests/scenario/direct_torque.yaml, direct_torque_step.yaml. */
#ifndef CONTROL_DIRECT_TORQUE_H
#define CONTROL_DIRECT_TORQUE_H

#include "firmware/control/winding_model.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    winding_model_t model;
    pm_q_t per_period;  /* T_s of the base speed: flux that one of voltage makes in a period */
    pm_frac_t k_drift;  /* k_c */
    pm_q_t torque_band; /* of psi x i */
} direct_torque_config_t;

typedef struct {
    pm_dq_t psi;         /* Q28; at k, by what acted until then */
    pm_dq_t v;           /* Q28; of the state commanded in the last period */
    uint16_t legs;       /* that state */
    int8_t torque, flux; /* 1 up, -1 down; torque 0: within */
} direct_torque_t;

void direct_torque_reset(direct_torque_t *self, const direct_torque_config_t *config, pm_dq_t v, pm_dq_t i,
                         pm_q_t omega);
void direct_torque_step(direct_torque_t *self, const direct_torque_config_t *config, const regulator_in_t *in,
                        regulator_out_t *out);

void make_direct_torque(maker_t *m, direct_torque_config_t *c);
pm_num_t direct_torque_bandwidth(const maker_t *m);
void direct_torque_slow_down(direct_torque_config_t *config, pm_unit_t share);

#ifdef __cplusplus
}
#endif

#endif
