/* Current control in the rotor frame (METHODS.md 1.3.2.2, row 5).
 *
 * PI per axis (firmware/math/pi.h) with decoupling:
 *   kp   = w_c L
 *   ki   = w_c R T_s
 *   ff_d = -omega L_q i_q
 *   ff_q =  omega (L_d i_d + psi_m)
 * The voltage limit is circular and the d-axis has priority (flux before torque); back-calculation: each
 * integral follows the limited voltage. The limit is detected to 2^-12 in the square of the voltage. Step
 * response 10-90 %: 0.35/f_c with little delay, 0.16/f_c at f_c = f_pwm/20; overshoot <= 10 % up to there.
 *
 * Uses the current at k; the voltage belongs to the frame at the middle of [k+1, k+2).
 * Tests: tests/unit/control/current_control_test.cpp. */
#ifndef CONTROL_CURRENT_CONTROL_H
#define CONTROL_CURRENT_CONTROL_H

#include "firmware/math/frames.h"
#include "firmware/math/pi.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    pm_pi_config_t d, q;
    pm_q_t L_q; /* per-unit, decoupling; |L i| < 8 */
    pm_q_t L_d;
    pm_q_t psi_m;
} current_control_config_t;

typedef struct {
    pm_pi_t d, q;
    bool limited; /* set while the voltage limit acts; the reader clears it */
} current_control_t;

typedef struct {
    pm_dq_t v;    /* Q28 */
    pm_dq_t wide; /* the same in Q22 */
    bool limited;
} current_control_out_t;

/* Sets the integrals such that the first output is v at zero error. */
void current_control_reset(current_control_t *self, pm_dq_t v);
void current_control_step(current_control_t *self, const current_control_config_t *config, pm_dq_t i,
                          pm_dq_t i_ref, pm_q_t omega, pm_q_t v_max, current_control_out_t *out);

void make_current_control(maker_t *m, current_control_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
