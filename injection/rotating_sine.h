/* Rotating sine injection, negative sequence demodulated, with what the inverter and the resistance do to it
 * taken from the positive sequence (METHODS.md 4.4.1, 5.6.3.1, 5.6.4.2, 5.7; rows 39, 60 and 63).
 *
 * Added in the estimated frame (carrier.h), with phi, phi' and F of sine.h:
 *   v = V_h e^{j phi_k}
 * The answer in that frame, e: position error:
 *   i   = i_f + I_p e^{j (phi' + rho)} + I_n e^{j (-phi' + 2 e + theta_m - 2 rho')}
 *   I_p = F L_sa / D,  I_n = F K / D
 * rho comes from the resistance and from what dead time and leg capacitance add to it. A window of N samples
 * (window.h) gives the fundamental current i_f and the complex amplitudes of both sequences:
 *   rho_m = arg of the positive sequence,  rho_0 = R / (omega_h L_p): without the inverter
 *   rho'  = rho_0 + p (rho_m - rho_m0),  rho_m0 = rho_0 (1 + kappa^2): the part of rho_0 in rho_m
 *   p     = 3/4 + (1 / (2 kappa) - 3/4) |i_f|^2 / (|i_f|^2 + I_p^2),  kappa = I_n / I_p
 *   eps   = gain(i_q) Im[negative e^{j (2 rho' - theta_m)}],  gain = 1 / (2 I_n)
 * Without load all phases are governed by the carrier and p = 3/4; under load one phase at a time crosses zero.
 * Of a nearly round machine, kappa < 0.1, the second amplifies every error of rho_0: p stays 3/4. The part with p
 * is limited to what dead time, devices and an R misestimated by 50 % can cause, since p, up to 8, amplifies what a
 * transient of i_f does to rho_m:
 *   5/4 v_lost / V_h + rho_0 / 2
 *
 * Compensation of dead time before the carrier (5.6.4.1, row 62): by the fundamental current alone it does nothing
 * for the carrier, which moves the legs through their zone by itself; with `injection_pre_comp`, where the image has the option counted_carrier, it goes by the
 * current with the carrier, predicted from both sequences for the middle of the period in which the voltage acts,
 *   i = i_f + P e^{j phi'} + N e^{-j phi'},  phi' of k + 1.5;  P, N: the sequences, complex
 * Both corrections may be on. With this one alone rho' is rho_0.
 *
 * eps is exact for small e and 1/2 sin 2e beyond. misfit: the positive sequence against I_p(i_q), relative. The
 * bandwidths that sine.h allows must also suit the machine: with those of the
 * scenario, 12 Hz for the position and 3 Hz for the speed, a compressor of 2e-4 kg m2 loses its position under a
 * load of 0.3 s rise. Each period 120 instructions, 44 more to count the carrier in; rho' at 1 kHz.
 * State 400 bytes. Functions as injection.h says. Tests: tests/unit/injection/rotating_sine_test.cpp,
 * tests/scenario/rotating_sine.yaml. */
#ifndef INJECTION_ROTATING_SINE_H
#define INJECTION_ROTATING_SINE_H

#include "injection/saliency.h"
#include "injection/sine.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    sine_config_t sine;
    saliency_config_t saliency;
    pm_q_t rho_0;           /* rad */
    pm_q_t rho_m0;          /* rho_0 (1 + kappa^2) */
    pm_q_t most;            /* of what the positive sequence adds to rho_0 */
    bool with_load;         /* p depends on the load */
    bool positive_sequence; /* rho' from rho_m; else rho_0 alone */
    bool counted_in;        /* the compensation of dead time is told the current of the carrier */
} rotating_sine_config_t;

typedef struct {
    sine_t sine;
    pm_dir_t turn; /* e^{j (2 rho' - theta_m)} */
    int32_t gain;  /* rad per unit of current, Q20 */
    pm_dq_t negative;
    pm_q_t eps;
    pm_q_t misfit;
} rotating_sine_t;

void rotating_sine_reset(rotating_sine_t *self, const rotating_sine_config_t *config, const obs_in_t *in);
void rotating_sine_step(rotating_sine_t *self, const rotating_sine_config_t *config, const injection_in_t *in,
                        injection_out_t *out);
void rotating_sine_slow(rotating_sine_t *self, const rotating_sine_config_t *config, const obs_in_t *in);
obs_out_t rotating_sine_last(const rotating_sine_t *self, const rotating_sine_config_t *config);

void make_rotating_sine(maker_t *m, rotating_sine_config_t *c);
injection_limits_t rotating_sine_limits(const maker_t *m);
pm_num_t rotating_sine_answer(const maker_t *m);

#ifdef __cplusplus
}
#endif

#endif
