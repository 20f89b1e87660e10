/* The star point against the mean of the terminals, by a differential channel or as the difference of four (METHODS.md
 * 11.2.1, row 122; 6.1): from code to signal.
 *
 *   v_zero = v_S - v_N = (zero - code) full scale / v_base
 * S is the star of three equal resistors, N the motor's neutral. With a balanced winding this is the zero-sequence voltage
 *   v_0 = e_0 + p psi_0(i),   e_0 = -3 omega psi_3 sin 3 theta
 * at k, behind the RC of the channel, of half a period to two: at the zero vector, where the converters sample, the
 * instantaneous value has the ripple of p i in it. zero: code without voltage (procedures/calibrate.h).
 *
 * Resistors that are not equal make S a mean of the terminals with weights 1/3 + e_k, sum of e_k = 0, which has a part of the
 * voltage u of the legs in it (E12; 1 % of a resistor is 0.3 % of u, where the carrier's answer is of the same size):
 *   v_S = mean + star_alpha u_alpha + star_beta u_beta
 *   star_alpha + j star_beta = sum of e_k e^{j gamma_k},   gamma_k = 0, 120, 240 degrees
 * neutral_star() is that part behind the RC, with u over [k-1, k) and a = e^{-T_s / RC}
 *   s_k = a s_k-1 + (1 - a) (star_alpha u_alpha + star_beta u_beta)
 * and is taken off where field-oriented control runs. procedures/zero_inductance.h measures the two.
 *
 * Only in programs that carry NEEDS_NEUTRAL. Cost: 16 instructions a period. Range: +-full scale, where the converter clips.
 * Tests: tests/unit/drive/neutral_test.cpp, tests/contract/hal. */
#ifndef DRIVE_NEUTRAL_H
#define DRIVE_NEUTRAL_H

#include "firmware/math/frames.h"
#include "firmware/math/measure.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    int32_t per_code;              /* full scale over the base of voltages, Q30 */
    int32_t star_alpha, star_beta; /* times 1 - a, Q32 */
    pm_frac_t decay;               /* a */
} neutral_config_t;

typedef struct {
    pm_q_t zero; /* code without voltage, one being half of the range */
    pm_q_t star; /* s_k */
} neutral_t;

#if PM_CARRIES(NEEDS_NEUTRAL)
static inline pm_q_t neutral_signal(const neutral_t *self, const neutral_config_t *config, uint16_t code)
{
    return pm_shl(pm_mulh(self->zero - pm_shl(code, PM_Q_BITS - 15), config->per_code), 2);
}

static inline pm_q_t neutral_star(neutral_t *self, const neutral_config_t *config, pm_ab_t u)
{
    const pm_q_t now = pm_mulh_add(pm_mulh(u.alpha, config->star_alpha), u.beta, config->star_beta);
    self->star = now + pm_shl(pm_mulh(self->star, config->decay), 1);
    return self->star;
}
#endif

void make_neutral(maker_t *m, neutral_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
