/* The star point against the mean of the terminals, by a differential channel or as the difference of four (METHODS.md
 * 11.2.1, row 122; 6.1): from code to signal.
 *
 *   v_zero = v_S - v_N = (zero - code) full scale / v_base
 * S is the star of three equal resistors, N the motor's neutral. With a balanced winding this is the zero-sequence voltage
 *   v_0 = e_0 + p psi_0(i),   e_0 = -3 omega psi_3 sin 3 theta
 * at k, behind the RC of the channel, of half a period to two: at the zero vector, where the converters sample, the
 * instantaneous value has the ripple of p i in it. zero: code without voltage (procedures/calibrate.h).
 *
 * Only in programs that carry NEEDS_NEUTRAL. Cost: 5 instructions a period. Range: +-full scale, where the converter clips.
 * Tests: tests/unit/drive/neutral_test.cpp, tests/contract/hal. */
#ifndef DRIVE_NEUTRAL_H
#define DRIVE_NEUTRAL_H

#include "firmware/math/fixed.h"
#include "firmware/math/measure.h"
#include "firmware/params/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    int32_t per_code; /* full scale over the base of voltages, Q30 */
} neutral_config_t;

typedef struct {
    pm_q_t zero; /* code without voltage, one being half of the range */
} neutral_t;

#if PM_CARRIES(NEEDS_NEUTRAL)
static inline pm_q_t neutral_signal(const neutral_t *self, const neutral_config_t *config, uint16_t code)
{
    return pm_shl(pm_mulh(self->zero - pm_shl(code, PM_Q_BITS - 15), config->per_code), 2);
}
#endif

void make_neutral(maker_t *m, neutral_config_t *c);

#ifdef __cplusplus
}
#endif

#endif
