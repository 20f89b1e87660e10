/* Pulsating square wave of pseudo-random sequence in the estimated frame (METHODS.md 5.8.5, row 68) with indirect
 * cross-coupling compensation (5.2.2.2, row 51): the carrier of pulsating_square.h without its tone.
 *
 * A cycle of the carrier is two PWM periods, and begins with +V_h or with -V_h along d as a bit of a shift
 * register says; with the other sign it ends, so that its volt-seconds are zero and no direct current builds up.
 * What was a line at f_pwm / 2 is spread over the band. For a cycle that began with the sign s, with the
 * changes of current over its first and its second period, in the frame of their samples:
 *   h   = s (delta_1 - delta_2) / 2          h_d, h_q and F as pulsating_square.h has them
 *   eps = gain(i_q) (h_q + (lambda(i_q) + omega T_s / 2) h_d)
 * once per cycle; the period between has the last one again. The fundamental current is the sample within a cycle less
 * what the carrier has there, s times the mean of h, and stands for the whole of the next cycle: so the voltage of control
 * does not change within a cycle, where it would be taken for an answer. The swing of the current from its mean is
 * twice that of the alternating wave of the same V_h, and the noise of the position 0.87 of its: 3 sigma^2 per sample
 * in place of 4.
 *
 *   register: 32 bits, x = 2 x, xor 04C1 1DB7h where its uppermost bit was 1 (primitive: 2^32 - 1 bits)
 *
 * eps is exact for small e and 1/2 sin 2e beyond: stable at 0 and 180 degrees, so the polarity must be known.
 * misfit: distance of h_d from its value without load, relative. A period takes 60 instructions more than with the
 * alternating wave. Functions as injection.h says. Tests: tests/unit/injection/random_square_test.cpp,
 * tests/scenario/random_square.yaml. */
#ifndef INJECTION_RANDOM_SQUARE_H
#define INJECTION_RANDOM_SQUARE_H

#include "injection/pulsating_square.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef pulsating_square_config_t random_square_config_t;

typedef struct {
    pm_ab_t i;          /* current at k-1 */
    pm_dq_t i_dq;       /* fundamental */
    pm_dq_t half_delta; /* half of the change over the first period of the cycle that is seen */
    int32_t carrier;    /* commanded in the last period: +-v_h, Q30 */
    uint32_t bits;      /* the register */
    bool second;        /* this period the second half of a cycle is seen, and one commanded */
    bool negative;      /* the cycle that is seen began with -v_h */
    int32_t gain;       /* at the present current, Q20 */
    pm_unit_t lambda;   /* at the present current and speed */
    pm_dq_t h, mean;    /* of the last cycle; of some */
    pm_q_t eps;
} random_square_t;

void random_square_reset(random_square_t *self, const random_square_config_t *config, const obs_in_t *in);
void random_square_step(random_square_t *self, const random_square_config_t *config, const injection_in_t *in,
                        injection_out_t *out);
void random_square_slow(random_square_t *self, const random_square_config_t *config, const obs_in_t *in);
obs_out_t random_square_last(const random_square_t *self, const random_square_config_t *config);

void make_random_square(maker_t *m, random_square_config_t *c);
injection_limits_t random_square_limits(const maker_t *m);
pm_num_t random_square_answer(const maker_t *m);

#ifdef __cplusplus
}
#endif

#endif
