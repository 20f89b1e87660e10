/* First- and second-order filters, and a limit of the slope.
 *
 * pm_lp1, first-order low-pass:
 *   y += k (x - y),   k = 1 - exp(-T_s w_c) in Q32 (w_c T_s < 0.69)
 * Unity dc gain; the output stops within 2^-29 / k of the input. The caller ensures |x - y| < 8. Two
 * instructions inline beside load and store.
 *
 * pm_biquad, for notches and second-order low-pass, transposed direct form II:
 *   y = (b0 + b1 z^-1 + b2 z^-2) / (1 + a1 z^-1 + a2 z^-2) x
 * Coefficients Q29, |b| < 4, |a1| < 2, |a2| < 1 (which stability requires anyway). Input and output saturate
 * at -4 and 4 - 2^-25. The states keep every bit, and what rounding removes from an output is added to the
 * next one, so the dc gain is that of the coefficients, without a dead zone.
 *
 * Both give y of the instant of x. Cost: docs/decisions/001-signal-format.md.
 * Tests: tests/unit/math/filter_test.cpp. */
#ifndef PM_MATH_FILTER_H
#define PM_MATH_FILTER_H

#include "firmware/math/fixed.h"

#ifdef __cplusplus
extern "C" {
#endif

static inline pm_q_t pm_lp1(pm_q_t *y, pm_q_t x, pm_frac_t k)
{
    *y = pm_frac_add(*y, x - *y, k);
    return *y;
}

typedef struct {
    int32_t b0, b1, b2, a1, a2; /* Q29 */
} pm_biquad_config_t;

typedef struct {
    int64_t s1, s2; /* Q57; zero to reset */
} pm_biquad_t;

pm_q_t pm_biquad_step(pm_biquad_t *self, const pm_biquad_config_t *config, pm_q_t x);

/* y, nearer to x by no more than `step`. */
pm_q_t pm_approach(pm_q_t y, pm_q_t x, pm_q_t step);

#ifdef __cplusplus
}
#endif

#endif
