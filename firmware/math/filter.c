#include "firmware/math/filter.h"

#include "firmware/math/compiler.h"

enum { COEFFICIENT_BITS = 29, LIMIT_BITS = 30 /* +-4 in Q28 */ };

/* With |x|, |y| <= 4 and the documented coefficients |s2| <= 20, |s1| <= 44 and the sum <= 60 of the 64 that
 * Q57 can hold, whatever the input does. */
pm_q_t pm_biquad_step(pm_biquad_t *self, const pm_biquad_config_t *config, pm_q_t x)
{
    const int32_t in = pm_sat(x, LIMIT_BITS);
    const int64_t sum = self->s1 + (int64_t)config->b0 * in;
    const int32_t upper = (int32_t)(sum >> 32);
    const int32_t kept = pm_sat(upper, LIMIT_BITS - (32 - COEFFICIENT_BITS));
    const uint32_t lower = kept == upper ? (uint32_t)sum : 0U;
    const int32_t out = pm_shl(kept, 32 - COEFFICIENT_BITS) + (int32_t)(lower >> COEFFICIENT_BITS);
    /* What is cut off the output is added to the next one: no dead zone and no bias at low frequencies,
     * where the poles would otherwise amplify the rounding by 1 / (1 + a1 + a2). */
    const int32_t cut = (int32_t)(lower & ((1U << COEFFICIENT_BITS) - 1U));
    const int32_t back = -out; /* there is no multiply-subtract into 64 bits */
    self->s1 = self->s2 + cut + (int64_t)config->b1 * in + (int64_t)config->a1 * back;
    self->s2 = (int64_t)config->b2 * in + (int64_t)config->a2 * back;
    return out;
}

PM_APART pm_q_t pm_approach(pm_q_t y, pm_q_t x, pm_q_t step)
{
    return y + pm_clamp(x - y, -step, step);
}
