/* Sine injection into the reference of the current, for predictive current control (METHODS.md 12.5.3, row 147), with indirect
 * cross-coupling compensation (5.2.2.2, row 51).
 *
 * A carrier added to the voltage is lost on such a regulator: one of switch states gives a zero state for any voltage below v_dc / 3,
 * and deadbeat control takes the carrier for an error. So the current is asked for, N periods to a carrier (sine.h),
 *   i_d* = ... + I_h cos(k a)
 *   a = 2 pi / N
 * and the regulator (firmware/control, trait REGULATOR_FOLLOWS) makes a voltage along d of it, of amplitude v_injection:
 *   I_h = v_injection T_s / (2 sin(a/2) L_d)
 * It controls the answer along q away as well, so that the current alone does not show the position. The voltage that the current
 * would take of L_q, compared with the one that was applied, does. In the estimated frame, e: position error, v: mean voltage over
 * [k-1, k), di = i_k - i_k-1:
 *   y = L_qh / T_s (di_q + lambda di_d) - v_q = e (L_qh - L_dh) / T_s di_d + ...
 *   v_d = L_dh / T_s di_d + ...
 * R, the EMF and what rotation adds are steady or a quarter of a period off; of the last, w / w_h R / (w_h L_d) by gain is left.
 * The window gives the complex amplitudes of both; lambda makes eps zero at e = 0 whatever the load (saliency.h):
 *   eps = gain(i_q) Re[Y V_d*] / |V_d|^2
 *   gain = L_dh / (L_qh - L_dh)
 * which is the e = Re[(j w_h I_q - V_q/L_q) D*] / |D|^2 of the row with j w_h as the difference that belongs to a mean voltage. The
 * ripple of switch states moves y no more than any other current does. 1 / |V_d| and the phase of V_d are those of the last
 * millisecond.
 *
 * A modulator is told by how much the carrier takes the current further until the middle of the period in which its voltage acts,
 *   i_d(k+1.5) - i_d(k) = (i_d*_k + i_d*_k-1) / 2 - i_d*_k-2 = -2 I_h sin(3/4 a) sin(k a - 5/4 a)
 * so that dead time is compensated with the sign of the current there: at full load that leaves 0.5 degrees of 2.
 *
 * injection_post_comp 0: v_q is not read, only the current; for comparison. L_qh and lambda are those of the present i_q.
 * eps is exact for small e; with a current that is as asked for 1/2 (L_q - L_d) sin 2e / (L_d cos^2 e + L_q sin^2 e) beyond, by
 * gain. misfit: |V_d| against that of I_h without load, relative. The current that is controlled and reported is the sampled one, with
 * the carrier. Bandwidth of the position loop: as sine.h; current control is not slowed.
 *
 * Range: v_injection up to 0.6 v_dc/sqrt(3); switch states follow a carrier from half of what one of them moves the current by,
 * I_h > v_dc T_s / (3 L_d), below which the position is lost. L_q / T_s below 60 times the base impedance. Each period 230
 * instructions in a program that carries all channels, where pulsating_sine.h takes 185; in no image. 1 kHz: 280. Functions as injection.h says.
 * Tests: tests/unit/injection/current_sine_test.cpp, tests/scenario/current_sine.yaml. */
#ifndef INJECTION_CURRENT_SINE_H
#define INJECTION_CURRENT_SINE_H

#include "firmware/math/image.h"
#include "injection/saliency.h"
#include "injection/sine.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CURRENT_SINE_K_BITS   25
#define CURRENT_SINE_K_2_BITS 16

typedef struct {
    sine_config_t sine;
    saliency_config_t saliency; /* gain: per share of V_d, Q20 */
    pm_q_t i_h;
#if PM_HAS(counted_carrier)
    pm_q_t i_later; /* 2 I_h sin(3/4 a) */
#endif
    pm_q_t v_d;        /* expected |V_d| without load */
    int32_t k_0, k_2;  /* L_qh / T_s = k_0 + k_2 i_q^2, Q25 and Q16 */
    pm_q_t half_turn;  /* of a period at omega = 1, rad */
    bool voltage_read; /* v_q counts; else the current alone */
} current_sine_config_t;

typedef struct {
    sine_t sine;
    pm_dq_t i;        /* at k-1, in the frame of k-1 */
    pm_dir_t phase;   /* e^{j delta} of V_d */
    int32_t gain;     /* rad per unit of voltage, Q20 */
    int32_t k_q;      /* L_qh / T_s at the present current, Q25 */
    pm_unit_t lambda; /* likewise */
    pm_q_t i_q;       /* without ripple */
    pm_dq_t h;        /* Re V_d e^{-j delta}, Re Y e^{-j delta} */
    pm_q_t eps;
    pm_q_t misfit;
} current_sine_t;

void current_sine_reset(current_sine_t *self, const current_sine_config_t *config, const obs_in_t *in);
void current_sine_step(current_sine_t *self, const current_sine_config_t *config, const injection_in_t *in,
                       injection_out_t *out);
void current_sine_slow(current_sine_t *self, const current_sine_config_t *config, const obs_in_t *in);
obs_out_t current_sine_last(const current_sine_t *self, const current_sine_config_t *config);

void make_current_sine(maker_t *m, current_sine_config_t *c);
injection_limits_t current_sine_limits(const maker_t *m);
pm_num_t current_sine_answer(const maker_t *m);

#ifdef __cplusplus
}
#endif

#endif
