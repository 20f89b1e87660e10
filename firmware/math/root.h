/* Square root, length and quotient of signals. No loops, no tables.
 *
 *   pm_sqrt(x)          x in Q28, result Q28, error <= 2^-25; x <= 0 gives 0
 *   pm_hypot(x, y)      length of (x, y) in the format of its arguments; saturates; error <= 1.1e-8 relative
 *                       + 0.5 LSB
 *   pm_div(num, x)      num / x in Q28; saturates; error <= 1e-8 relative + 0.5 LSB; x <= 0 counts as the
 *                       smallest positive x, so the result is the end of the range on num's side; 0 / x = 0;
 *                       one 32-bit division
 *   pm_ratio(num, den)  num / den in Q31 for 0 <= num <= den, den > 0; error -2^-16 ... 2^-15; one 32-bit
 *                       division
 *   pm_per_volt(v)      1 / v in Q24, so that pm_mulh(x, .) gives x / v as a share (Q20); v >= 1/16, of which
 *                       16 bits count; relative error <= (v + 1 / v) 2^-16; one 32-bit division
 * Cost: docs/decisions/001-signal-format.md. Tests: tests/unit/math/root_test.cpp. */
#ifndef PM_MATH_ROOT_H
#define PM_MATH_ROOT_H

#include "firmware/math/fixed.h"

#ifdef __cplusplus
extern "C" {
#endif

pm_q_t pm_sqrt(pm_q_t x);
pm_q_t pm_hypot(pm_q_t x, pm_q_t y);
pm_q_t pm_div(pm_q_t num, pm_q_t x);
pm_unit_t pm_ratio(pm_q_t num, pm_q_t den);

#ifdef __cplusplus
}
#endif

/* Twice the square root of an integer, 0 to 6.1 % too large: one Newton step from a power of two, where a
 * rough root is enough. Six instructions. */
static inline int32_t pm_root_twice(int32_t x) /* x >= 0 */
{
    const unsigned half = (32U - (unsigned)__builtin_clz((uint32_t)x | 1U)) >> 1;
    return (INT32_C(1) << half) + (x >> half);
}

/* Root of m / 2^32 in Q29 for m >= 2^30, within 1e-8 of it.
 * Two steps of Heron from a line that is 13 % off give 4e-5; the remainder, exact in 32 bits because the root
 * is cut to 16, corrects it. Three short divisions take no longer than the constants of a polynomial. */
static inline uint32_t pm_root_q29(uint32_t m)
{
    uint32_t s = (m >> 17) + 0x7000U; /* Q16 */
    s = (s + m / s) >> 1;
    s = (s + m / s) >> 1;
    const int32_t rest = (int32_t)(m - s * s); /* Q32 */
    const int32_t more = pm_shl(rest, 12) / (int32_t)s;
    return (s << 13) + (uint32_t)more;
}

/* Root of a square from pm_mulh(), cut to a wide number: x in Q24. */
static inline pm_wide_t pm_sqrt_wide(int32_t x)
{
    if (x <= 0) {
        return 0;
    }
    const unsigned n = (unsigned)__builtin_clz((uint32_t)x) >> 1;
    return (pm_wide_t)(pm_root_q29((uint32_t)x << (2U * n)) >> (n + 3U));
}

static inline int32_t pm_per_volt(pm_q_t v)
{
    return (int32_t)((UINT32_MAX / ((uint32_t)v >> 12)) << 8);
}

#endif
