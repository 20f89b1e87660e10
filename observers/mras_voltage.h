/* Model reference adaptive system, voltage model (METHODS.md 12.2.3, row 138).
 *
 * From the measured currents the model computes the voltage that they need at its own adapted speed w^; the
 * voltage of the machine differs by D (mras.h):
 *   v_VM   = (R + p L_d) i + w_f (L_q - L_d) J i + (0, w^ psi_a)
 *   D      = v - v_VM
 *   D_d    = -E sin(error)
 *   D_q    =  E cos(error) - w^ psi_a
 *   w^    += (k / psi_a) D_q
 *   eps    = -mean of two D_d / (w^ psi_a)
 *   misfit = 1 - w^ / omega
 * with p i = (i(k) - i(k-1))/T_s and i the mean of both ends. psi_m moves no angle, only w^ and the loop
 * gain. w^ is the EMF ratio of speed.h.
 *
 * Called each period; the result belongs to k. Range: L_d/T_s < 128, |v| and |i| < 2, psi_a > 1/128; |D| is
 * clamped to 2, w^ to +-4. vector: E in the present frame.
 * Tests: tests/unit/observers/mras_test.cpp, tests/scenario. */
#ifndef OBSERVERS_MRAS_VOLTAGE_H
#define OBSERVERS_MRAS_VOLTAGE_H

#include "observers/mras.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef mras_config_t mras_voltage_config_t;

typedef struct {
    pm_ab_t i;             /* at k-1 */
    int32_t drop, rise;    /* R / 2 and L_d / T_s, Q24 */
    int32_t cross, half;   /* w_f (L_q - L_d), Q23; omega T_s / 2, Q32 */
    int32_t psi, adapt;    /* psi_a, Q23; k / psi_a, Q28, 0: tied */
    int32_t inverse;       /* of w^ psi_a, Q22 */
    int32_t inverse_omega; /* of omega, Q22 */
    pm_q_t omega_loop;
    pm_q_t omega; /* w^ */
    obs_out_t last;
    pm_q_t omega_f;       /* w_f */
    int32_t difference_d; /* D_d of the last step, Q19 */
} mras_voltage_t;

void mras_voltage_reset(mras_voltage_t *self, const mras_voltage_config_t *config, const obs_in_t *in);
void mras_voltage_step(mras_voltage_t *self, const mras_voltage_config_t *config, const obs_in_t *in,
                       obs_out_t *out);
obs_out_t mras_voltage_last(const mras_voltage_t *self);
void mras_voltage_tie(mras_voltage_t *self, const mras_voltage_config_t *config);
void mras_voltage_slow(mras_voltage_t *self, const mras_voltage_config_t *config, const obs_in_t *in,
                       const obs_out_t *out, pm_q_t weight);

void make_mras_voltage(maker_t *m, mras_voltage_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
