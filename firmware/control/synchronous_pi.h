/* Current control by PI in the estimated frame: the regulator of field-oriented control (METHODS.md 1.3.2.2,
 * row 5).
 *
 * PI per axis (firmware/math/pi.h) with decoupling:
 *   kp   = w_c L
 *   ki   = w_c R T_s
 *   ff_d = -omega L_q i_q
 *   ff_q =  omega (L_d i_d + psi_m)
 * Voltage limit: voltage_circle.h; back-calculation: each integral follows the limited voltage by a share of ki / kp a period, 15/16
 * where a current follows its voltage within one, R T_s > L. Step response 10-90 %: 0.35/f_c with little delay, 0.16/f_c at f_c = f_pwm/20; overshoot <= 10 % up to there.
 *
 * Cost: the reference of docs/performance.md. Functions as regulator.h says.
 * Tests: tests/unit/control/synchronous_pi_test.cpp, tests/contract/regulator_contract_test.cpp. */
#ifndef CONTROL_SYNCHRONOUS_PI_H
#define CONTROL_SYNCHRONOUS_PI_H

#include "firmware/control/regulation.h"
#include "firmware/math/pi.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_pi_config_t d, q;
    pm_q_t L_q; /* per-unit, decoupling; |L i| < 8 */
    pm_q_t L_d;
    pm_q_t psi_m;
} synchronous_pi_config_t;

typedef struct {
    pm_pi_t d, q;
} synchronous_pi_t;

void synchronous_pi_reset(synchronous_pi_t *self, const synchronous_pi_config_t *config, pm_dq_t v, pm_dq_t i,
                          pm_q_t omega);
void synchronous_pi_step(synchronous_pi_t *self, const synchronous_pi_config_t *config,
                         const regulator_in_t *in, regulator_out_t *out);

void make_synchronous_pi(maker_t *m, synchronous_pi_config_t *c);
pm_num_t synchronous_pi_bandwidth(const maker_t *m);
void synchronous_pi_slow_down(synchronous_pi_config_t *config, pm_unit_t share);

#ifdef __cplusplus
}
#endif

#endif
