/* Sine, cosine and arctangent.
 *
 * pm_dir(angle): cosine and sine together. The nearest of 128 table directions (c, s) is turned by the rest r
 * of the angle:
 *   c' = c - r (s + r c / 2)
 *   s' = s + r (c - r s / 2)
 * with r scaled so that the missing cubic term is spread evenly. Error <= 7e-7, length within 1e-7 of 1, both
 * within +-(2^31 - 1). 13 instructions inline.
 *
 * pm_atan2(y, x): angle of (x, y), any magnitude, error <= 0.0018 degree; (0, 0) gives 0. One 32-bit
 * division and a function call: too expensive for the control period at high PWM frequencies.
 *
 * Cost: docs/decisions/001-signal-format.md. Tests: tests/unit/math/trig_test.cpp. */
#ifndef PM_MATH_TRIG_H
#define PM_MATH_TRIG_H

#include "firmware/math/pair.h"

#ifdef __cplusplus
extern "C" {
#endif

extern const pm_pair_t pm_dir_table[128]; /* cosine, sine; trig_table.c, made by tools/gen_trig_table.py */

pm_angle_t pm_atan2(int32_t y, int32_t x);

#ifdef __cplusplus
}
#endif

static inline pm_dir_t pm_dir(pm_angle_t angle)
{
    const pm_pair_t near = pm_pair_of(pm_dir_table, (angle + (1U << 24)) >> 25); /* cosine, sine */
    /* The low 25 bits, signed, are the rest. 2 pi / 128 (1 - (pi / 128)^2 / 8) in Q32. */
    const int32_t rest = pm_mulh((int32_t)(angle << 7), 210812839);
    const int32_t half = rest >> 1;
    const int32_t s_mid = pm_mulh_add(near.second, near.first, half);
    const int32_t c_mid = pm_mulh_sub(near.first, near.second, half);
    pm_dir_t r;
    r.cos = pm_mulh_sub(near.first, s_mid, rest);
    r.sin = pm_mulh_add(near.second, c_mid, rest);
    return r;
}

#endif
