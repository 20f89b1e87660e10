#include "firmware/math/trig.h"

/* atan(r) / (2 pi) = r P(r^2) on 0 ... 1, minimax, error 1.2e-5 rad. Coefficient n is given in Q31 times 4^n,
 * because Horner's scheme below multiplies by r^2 / 4. */
enum {
    ATAN_0 = 341736952,
    ATAN_1 = -451569765,
    ATAN_2 = 985205095,
    ATAN_3 = -1862717397,
    ATAN_4 = 1823870989,
};

static uint32_t magnitude(int32_t x)
{
    return x < 0 ? 0U - (uint32_t)x : (uint32_t)x;
}

pm_angle_t pm_atan2(int32_t y, int32_t x)
{
    const uint32_t ax = magnitude(x);
    const uint32_t ay = magnitude(y);
    const bool steep = ay > ax;
    uint32_t large = steep ? ay : ax;
    uint32_t small = steep ? ax : ay;
    if (large == 0U) {
        return 0U;
    }
    /* Sixteen leading bits of the larger one are enough for a divisor and keep the division to 32 bits.
     * Truncating the divisor and truncating the quotient partly cancel. */
    const unsigned n = (unsigned)__builtin_clz(large);
    large <<= n;
    small <<= n;
    const int32_t ratio = (int32_t)((small / (large >> 16)) << 14); /* Q30 */

    const int32_t square = pm_shl(pm_mulh(ratio, ratio), 2); /* r^2 / 4 in Q32 */
    int32_t p = pm_mulh_add(ATAN_3, ATAN_4, square);
    p = pm_mulh_add(ATAN_2, p, square);
    p = pm_mulh_add(ATAN_1, p, square);
    p = pm_mulh_add(ATAN_0, p, square);
    pm_angle_t angle = (pm_angle_t)pm_shl(pm_mulh(ratio, p), 3);

    angle = steep ? PM_TURN(0.25) - angle : angle;
    angle = x < 0 ? PM_TURN(0.5) - angle : angle;
    return y < 0 ? 0U - angle : angle;
}
