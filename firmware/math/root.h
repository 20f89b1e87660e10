/* Square root, length and quotient of signals. No loops, no tables.
 *
 * pm_sqrt(x): x in Q28, result Q28, error <= 2^-25; x <= 0 gives 0.
 * pm_hypot(x, y): length of (x, y) in the format of its arguments; saturates. Error <= 1.1e-8 relative +
 *   0.5 LSB.
 * pm_div(num, x): num / x in Q28; saturates. Error <= 1e-8 relative + 0.5 LSB. x <= 0 is taken as the
 *   smallest positive x, so the result is the end of the range on num's side; 0 / x = 0. One 32-bit
 *   division.
 * pm_ratio(num, den): num / den in Q31 for 0 <= num <= den, den > 0; error -2^-16 ... 2^-15. One 32-bit
 *   division.
 * pm_counts_per_unit(counts, v): 16 counts / v, so that pm_mulh(x, .) gives counts for a voltage x;
 *   v >= 1/16, of which 16 bits count; relative error <= (v + 1 / v) 2^-16, or one below the exact value when
 *   that is more. One 32-bit division. pm_counts_make() prepares the dividend; 0 < counts < 2^15.
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

/* Twice the square root of an integer, not below it and at most 6.1 % above: one step of Newton's from a
 * power of two, for those who need its shape alone. Six instructions. */
static inline int32_t pm_root_twice(int32_t x) /* x >= 0 */
{
    const unsigned half = (32U - (unsigned)__builtin_clz((uint32_t)x | 1U)) >> 1;
    return (INT32_C(1) << half) + (x >> half);
}

typedef struct {
    uint32_t dividend; /* counts, lifted as far as 32 bits and the quotient allow */
    uint32_t lift;     /* what the quotient lacks, bits */
} pm_counts_t;

static inline pm_counts_t pm_counts_make(uint32_t counts)
{
    const uint32_t free = (uint32_t)__builtin_clz(counts | 1U);
    const uint32_t lift = free < 20U ? 20U - free : 0U;
    pm_counts_t r;
    r.dividend = counts << (20U - lift);
    r.lift = lift;
    return r;
}

static inline int32_t pm_counts_per_unit(pm_counts_t counts, pm_q_t v)
{
    return (int32_t)((counts.dividend / ((uint32_t)v >> 12)) << counts.lift);
}

#endif
