/* Numbers with a binary exponent: per-unit configuration from SI parameters without floating point.
 *
 *   value = m 2^e,   |m| in [2^30, 2^31), or m = e = 0
 * Results are rounded to nearest: relative error of an operation <= 1.25 2^-31, with |e| <= 2^20 (far beyond
 * any quantity of a drive; not checked). Not for the control path: sums and products cost about 60
 * instructions, quotients 120, roots up to 600. Conversions report a result that does not fit instead of only
 * clamping it.
 * Tests: tests/unit/math/num_test.cpp. */
#ifndef PM_MATH_NUM_H
#define PM_MATH_NUM_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/math/compiler.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    int32_t m;
    int32_t e;
} pm_num_t;

/* A number as it is passed and returned: 64 bits go in registers, but a struct of two words is returned through
 * memory (AAPCS), which takes ten bytes more for every operation. m is the lower word. */
typedef uint64_t pm_num_word_t;

PM_INLINE pm_num_word_t pm_num_word(pm_num_t x)
{
    return (uint64_t)(uint32_t)x.e << 32 | (uint32_t)x.m;
}

PM_INLINE pm_num_t pm_num_of(pm_num_word_t word)
{
    const pm_num_t x = {(int32_t)(uint32_t)word, (int32_t)(uint32_t)(word >> 32)};
    return x;
}

pm_num_word_t pm_num_word_int(int32_t value);
pm_num_word_t pm_num_word_dec(int32_t value, int exponent10);
pm_num_word_t pm_num_word_ratio(int32_t num, int32_t den);
pm_num_word_t pm_num_word_add(pm_num_word_t a, pm_num_word_t b);
pm_num_word_t pm_num_word_sub(pm_num_word_t a, pm_num_word_t b);
pm_num_word_t pm_num_word_mul(pm_num_word_t a, pm_num_word_t b);
pm_num_word_t pm_num_word_div(pm_num_word_t a, pm_num_word_t b);
pm_num_word_t pm_num_word_sqrt(pm_num_word_t a);
pm_num_word_t pm_num_word_from_fixed(int32_t x, int frac_bits);
int pm_num_word_cmp(pm_num_word_t a, pm_num_word_t b);
bool pm_num_word_to_fixed(pm_num_word_t word, int frac_bits, int32_t *out);
int32_t pm_num_word_times(pm_num_word_t word, int32_t value, int frac_bits);

/* A constant is made by the compiler, with the bits that pm_num_word_int() and pm_num_word_ratio() give: it is loaded
 * where it is needed, where a call would have all other numbers moved out of its way. 0 < value, num, den. */
PM_INLINE pm_num_t pm_num_constant(int32_t value)
{
    const int spare = __builtin_clz((uint32_t)value) - 1;
    const pm_num_t x = {(int32_t)((uint32_t)value << spare), -spare};
    return x;
}

PM_INLINE pm_num_t pm_num_constant_ratio(int32_t num, int32_t den)
{
    const pm_num_t a = pm_num_constant(num);
    const pm_num_t b = pm_num_constant(den);
    const uint64_t q = ((uint64_t)(uint32_t)a.m << 33) / (uint32_t)b.m;
    const int spare = __builtin_clzll(q);
    const uint64_t m = ((q << spare >> 32) + 1U) >> 1;
    const bool carry = m >> 31 != 0U;
    const pm_num_t x = {(int32_t)(carry ? m >> 1 : m), a.e - b.e - spare + (carry ? 1 : 0)};
    return x;
}

PM_INLINE pm_num_t pm_num(int32_t value) /* an integer */
{
    return __builtin_constant_p(value) && value > 0 ? pm_num_constant(value)
                                                    : pm_num_of(pm_num_word_int(value));
}

/* value x 10^exponent10, -12 <= exponent10 <= 12 */
PM_INLINE pm_num_t pm_num_dec(int32_t value, int exponent10)
{
    return pm_num_of(pm_num_word_dec(value, exponent10));
}

PM_INLINE pm_num_t pm_num_ratio(int32_t num, int32_t den) /* den == 0 gives 0 */
{
    return __builtin_constant_p(num) && __builtin_constant_p(den) && num > 0 && den > 0
               ? pm_num_constant_ratio(num, den)
               : pm_num_of(pm_num_word_ratio(num, den));
}

PM_INLINE pm_num_t pm_num_add(pm_num_t a, pm_num_t b)
{
    return pm_num_of(pm_num_word_add(pm_num_word(a), pm_num_word(b)));
}

PM_INLINE pm_num_t pm_num_sub(pm_num_t a, pm_num_t b)
{
    return pm_num_of(pm_num_word_sub(pm_num_word(a), pm_num_word(b)));
}

PM_INLINE pm_num_t pm_num_mul(pm_num_t a, pm_num_t b)
{
    return pm_num_of(pm_num_word_mul(pm_num_word(a), pm_num_word(b)));
}

PM_INLINE pm_num_t pm_num_div(pm_num_t a, pm_num_t b) /* b == 0 gives 0: check first */
{
    return pm_num_of(pm_num_word_div(pm_num_word(a), pm_num_word(b)));
}

PM_INLINE pm_num_t pm_num_sqrt(pm_num_t a) /* a <= 0 gives 0 */
{
    return pm_num_of(pm_num_word_sqrt(pm_num_word(a)));
}

PM_INLINE pm_num_t pm_num_neg(pm_num_t a)
{
    const pm_num_t x = {-a.m, a.e};
    return x;
}

PM_INLINE int pm_num_cmp(pm_num_t a, pm_num_t b) /* -1, 0, 1 */
{
    return pm_num_word_cmp(pm_num_word(a), pm_num_word(b));
}

/* value x 2^frac_bits rounded to nearest into *out; false (and *out saturated) when it does not fit. */
PM_INLINE bool pm_num_to_fixed(pm_num_t a, int frac_bits, int32_t *out)
{
    return pm_num_word_to_fixed(pm_num_word(a), frac_bits, out);
}

PM_INLINE pm_num_t pm_num_from_fixed(int32_t x, int frac_bits)
{
    return pm_num_of(pm_num_word_from_fixed(x, frac_bits));
}

/* value x unit x 2^frac_bits rounded to nearest, the largest of its sign where that does not fit. For values that
 * come while the drive runs: 40 instructions. */
PM_INLINE int32_t pm_num_times(int32_t value, pm_num_t unit, int frac_bits)
{
    return pm_num_word_times(pm_num_word(unit), value, frac_bits);
}

/* num / den toward zero, as C does; den == 0 gives 0. 70 instructions; the compiler's own division, for
 * divisors of 64 bits, would take 800 bytes. */
int64_t pm_quotient(int64_t num, int32_t den);

#ifdef __cplusplus
}
#endif

#define PM_NUM_TWO_PI_M 1686629713
#define PM_NUM_TWO_PI_E (-28)
#define PM_NUM_TWO_PI   ((pm_num_t){.m = PM_NUM_TWO_PI_M, .e = PM_NUM_TWO_PI_E})

#endif
