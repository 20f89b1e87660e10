/* Deadbeat current control with a modulated voltage (METHODS.md 12.5.2, continuous set; the finite one:
 * finite_set.h).
 *
 * The voltage commanded a period ago acts until k+1; winding_model.h says where it takes the current:
 *   i_d' = i_d + T_s/L_d (v_d - R i_d + omega L_q i_q)
 *   i_q' = i_q + T_s/L_q (v_q - R i_q - omega (L_d i_d + psi_m))
 * and which voltage takes it to its reference within the period after:
 *   v_d = R i_d' + L_d/T_s (i_d* - i_d') - omega L_q i_q'
 *   v_q = R i_q' + L_q/T_s (i_q* - i_q') + omega (L_d i_d' + psi_m)
 * Two periods from sample to reference while the voltage suffices, then as fast as it allows:
 *   t_90 <= 0.9 L_q di / (v_dc/sqrt(3) - omega psi_m) + 2.5 T_s
 * There is no integral: a voltage V that the model does not know, dead time that is not compensated say, leaves an
 * error of 2 V T_s/L. With an inductance told a L instead of L an error dies out by
 *   |z| = sqrt(|1 - a|)
 * a period, so that twice the inductance is the limit of stability. Voltage limit: voltage_circle.h. The slowed
 * form removes `share` of the error a period; a low-speed source asks for it, whose mean current is old.
 *
 * Cost: 80 instructions a period more than the PI. Range: L / T_s below 60 times the base impedance.
 * Functions as regulator.h says.
 * Tests: tests/unit/control/deadbeat_test.cpp, tests/contract/regulator_contract_test.cpp,
 * tests/scenario/deadbeat.yaml. */
#ifndef CONTROL_DEADBEAT_H
#define CONTROL_DEADBEAT_H

#include "firmware/control/winding_model.h"
#include "firmware/math/pi.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    winding_model_t model;
    int32_t k_d, k_q; /* L / T_s, and share of it, Q25 */
} deadbeat_config_t;

typedef struct {
    pm_dq_t v; /* Q28; commanded in the last period */
} deadbeat_t;

void deadbeat_reset(deadbeat_t *self, const deadbeat_config_t *config, pm_dq_t v, pm_dq_t i, pm_q_t omega);
void deadbeat_step(deadbeat_t *self, const deadbeat_config_t *config, const regulator_in_t *in,
                   regulator_out_t *out);

void make_deadbeat(maker_t *m, deadbeat_config_t *c);
pm_num_t deadbeat_bandwidth(const maker_t *m);
void deadbeat_slow_down(deadbeat_config_t *config, pm_unit_t share);

#ifdef __cplusplus
}
#endif

#endif
