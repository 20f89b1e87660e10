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

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    int32_t m;
    int32_t e;
} pm_num_t;

pm_num_t pm_num(int32_t value);                     /* an integer */
pm_num_t pm_num_dec(int32_t value, int exponent10); /* value x 10^exponent10, -12 <= exponent10 <= 12 */
pm_num_t pm_num_ratio(int32_t num, int32_t den);    /* den == 0 gives 0 */
pm_num_t pm_num_add(pm_num_t a, pm_num_t b);
pm_num_t pm_num_sub(pm_num_t a, pm_num_t b);
pm_num_t pm_num_mul(pm_num_t a, pm_num_t b);
pm_num_t pm_num_div(pm_num_t a, pm_num_t b); /* b == 0 gives 0: check first */
pm_num_t pm_num_sqrt(pm_num_t a);            /* a <= 0 gives 0 */
pm_num_t pm_num_neg(pm_num_t a);
int pm_num_cmp(pm_num_t a, pm_num_t b); /* -1, 0, 1 */

/* value x 2^frac_bits rounded to nearest into *out; false (and *out saturated) when it does not fit. */
bool pm_num_to_fixed(pm_num_t a, int frac_bits, int32_t *out);
pm_num_t pm_num_from_fixed(int32_t x, int frac_bits);

/* value x unit x 2^frac_bits rounded to nearest, the largest of its sign where that does not fit. For values that
 * come while the drive runs: 40 instructions. */
int32_t pm_num_times(int32_t value, pm_num_t unit, int frac_bits);

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
