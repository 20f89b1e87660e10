/* Square-wave injection along alpha of the stator (METHODS.md 4.4.3, row 42), with the part of the answer
 * that is the same for all positions detected first and then taken away (4.4.3.2, row 43; stationary.h).
 *
 * The voltage alternates by +-V_h along the axis g each PWM period (f_h = f_pwm / 2). The change of current
 * over a period, with the slope of the fundamental removed by a second difference in the estimated frame, and
 * with the sign s of the carrier:
 *   h   = s (delta_k - delta_k-1) / 2       F = V_h T_s,  I_p = F L_sa / D,  I_n = F K / D
 *       = [I_p e^{j g} + I_n e^{j (2 theta - 2 omega T_s + theta_m - g)}] e^{-j (theta^ - omega T_s / 2)}
 * A change belongs half a period back, and the mean of two is half a period older; the frame is that of the
 * samples.
 *   y   = (h - I_p e^{j g} e^{-j (theta^ - omega T_s / 2)}) e^{-j theta^} e^{j g} = I_n e^{j (2 e - 1.5 omega T_s + theta_m)}
 *   eps = gain(i_q) Im[y e^{j (1.5 omega T_s - theta_m)}],  gain = 1 / (2 I_n)
 * I_p is detected from the mean of y over 16 periods.
 *
 * Whatever the estimate is, the carrier is the same. eps is exact for small errors and 1/2 sin 2e beyond; it
 * is 0 in the first four steps after a reset and held in those after a change of the axis. misfit: mean |y|
 * against I_n, relative. The fundamental current is the mean of two samples. Each period 110 instructions;
 * I_p and the turn at 1 kHz. Functions as injection.h says.
 * Tests: tests/unit/injection/stationary_test.cpp, stationary_square_test.cpp,
 * tests/scenario/stationary_square.yaml. */
#ifndef INJECTION_STATIONARY_SQUARE_H
#define INJECTION_STATIONARY_SQUARE_H

#include "injection/source.h"
#include "injection/stationary.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Periods from the first command to a second difference that is whole, and then four time constants of the
 * mean. */
#define STATIONARY_SQUARE_ANSWER  4U
#define STATIONARY_SQUARE_SETTLED 64U

typedef struct {
    pm_q_t v_h;
    stationary_config_t stationary;
    saliency_config_t saliency;
    pm_frac_t half_step; /* T_s w_base / 2: rotation over half a period, per unit of speed */
} stationary_square_config_t;

typedef struct {
    stationary_t stationary;
    pm_ab_t i;          /* current at k-1 */
    pm_dq_t half_delta; /* half of the change over the last period */
    pm_q_t carrier;     /* commanded in the last period: +-v_h */
    pm_dq_t i_p;        /* I_p e^{j omega T_s / 2} */
    pm_dir_t turn;      /* e^{j (1.5 omega T_s - theta_m)} */
    int32_t gain;       /* rad per unit of current, Q20 */
    pm_dq_t y;          /* of the last step */
    pm_dq_t mean;       /* of y */
    pm_q_t eps;
    pm_q_t misfit;
    uint16_t warm; /* periods until the mean holds nothing but answers along the axis */
} stationary_square_t;

void stationary_square_reset(stationary_square_t *self, const stationary_square_config_t *config,
                             const obs_in_t *in);
void stationary_square_step(stationary_square_t *self, const stationary_square_config_t *config,
                            const injection_in_t *in, injection_out_t *out);
void stationary_square_slow(stationary_square_t *self, const stationary_square_config_t *config,
                            const obs_in_t *in);
obs_out_t stationary_square_last(const stationary_square_t *self, const stationary_square_config_t *config);

void make_stationary_square(maker_t *m, stationary_square_config_t *c);
injection_limits_t stationary_square_limits(const maker_t *m);
pm_num_t stationary_square_answer(const maker_t *m);

#ifdef __cplusplus
}
#endif

#endif
