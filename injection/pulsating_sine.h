/* Pulsating sine injection in the estimated frame (METHODS.md 4.3.1, 5.6.3.2; rows 37 and 61) with indirect
 * cross-coupling compensation (5.2.2.2, row 51).
 *
 * Added along d of the estimated frame (carrier.h), with phi, phi' and F of sine.h:
 *   v_d = V_h cos phi_k
 * The answer in that frame, e: position error:
 *   i_d = i_fd + h_d cos(phi' - delta)    h_d = F [L_sa + K cos(2 e + theta_m)] / D
 *   i_q = i_fq + h_q cos(phi' - delta)    h_q = F K sin(2 e + theta_m) / D
 * delta is what resistance, dead time and leg capacitance do to the phase. The answer along d shows it, as it
 * is always there. The window (window.h) gives the complex amplitudes of both axes and the fundamental
 * current i_f:
 *   I     = 2/N sum i e^{-j phi'},  delta = -arg I_d
 *   h     = Re[I e^{j delta}]:      the part of each axis that is in phase with the answer along d
 *   eps   = gain(i_q) (h_q + lambda(i_q) h_d)       zero at e = 0 whatever the load (saliency.h)
 * With a fixed delta = 0 what the inverter adds in quadrature counts too (docs/methods_notes.md).
 *
 * A frame that turns makes no error: the carrier's flux across d lags it by a quarter of a period.
 * eps is exact for small e and 1/2 sin 2e beyond. misfit: h_d against its value without load, relative.
 * Bandwidths: sine.h. Each period 135 instructions; delta at 1 kHz. Functions as injection.h says.
 * Tests: tests/unit/injection/pulsating_sine_test.cpp, tests/scenario/pulsating_sine.yaml. */
#ifndef INJECTION_PULSATING_SINE_H
#define INJECTION_PULSATING_SINE_H

#include "injection/saliency.h"
#include "injection/sine.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    sine_config_t sine;
    saliency_config_t saliency;
    pm_q_t h_d;          /* expected h_d without load */
    bool phase_measured; /* delta from the answer; else 0 */
} pulsating_sine_config_t;

typedef struct {
    sine_t sine;
    pm_dir_t phase;   /* e^{j delta} */
    int32_t gain;     /* rad per unit of current, Q20 */
    pm_unit_t lambda; /* at the present current */
    pm_dq_t h;
    pm_q_t eps;
    pm_q_t misfit;
} pulsating_sine_t;

void pulsating_sine_reset(pulsating_sine_t *self, const pulsating_sine_config_t *config, const obs_in_t *in);
void pulsating_sine_step(pulsating_sine_t *self, const pulsating_sine_config_t *config,
                         const injection_in_t *in, injection_out_t *out);
void pulsating_sine_slow(pulsating_sine_t *self, const pulsating_sine_config_t *config, const obs_in_t *in);
obs_out_t pulsating_sine_last(const pulsating_sine_t *self, const pulsating_sine_config_t *config);

void make_pulsating_sine(maker_t *m, pulsating_sine_config_t *c);
injection_limits_t pulsating_sine_limits(const maker_t *m);
pm_num_t pulsating_sine_answer(const maker_t *m);

#ifdef __cplusplus
}
#endif

#endif
