#include "firmware/math/root.h"

pm_q_t pm_sqrt(pm_q_t x)
{
    if (x <= 0) {
        return 0;
    }
    const unsigned n = (unsigned)__builtin_clz((uint32_t)x) >> 1;
    const uint32_t root = pm_root_q29((uint32_t)x << (2U * n)) << 2;
    return (pm_q_t)((root + (1U << n)) >> (n + 1U));
}

pm_q_t pm_hypot(pm_q_t x, pm_q_t y)
{
    const int32_t ax = pm_abs(x);
    const int32_t ay = pm_abs(y);
    if ((ax | ay) == 0) {
        return 0;
    }
    unsigned n = (unsigned)__builtin_clz((uint32_t)(ax | ay)) - 1U;
    const int32_t sx = pm_shl(ax, n);
    const int32_t sy = pm_shl(ay, n);
    const uint64_t sum = (uint64_t)((int64_t)sx * sx) + (uint64_t)((int64_t)sy * sy); /* 2^60 ... 2^63 */
    uint32_t m = (uint32_t)(sum >> 32);
    if (m < (1U << 30)) {
        m = (uint32_t)(sum >> 30);
        n += 1U;
    }
    if (n == 0U) { /* the sum is at least 2^62 and not scaled */
        return PM_Q_MAX;
    }
    const uint32_t root =
        (pm_root_q29(m) << 2) + ((1U << (n - 1U)) >> 1); /* twice the scaled length, to be rounded */
    const uint32_t length = root >> (n - 1U);
    return length > (uint32_t)PM_Q_MAX ? PM_Q_MAX : (pm_q_t)length;
}

pm_q_t pm_div(pm_q_t num, pm_q_t x)
{
    const int32_t a = pm_abs(num);
    if (a == 0) {
        return 0;
    }
    const int32_t divisor = pm_max(x, 1);
    const unsigned n = (unsigned)__builtin_clz((uint32_t)divisor) - 1U;
    const unsigned m = (unsigned)__builtin_clz((uint32_t)a) - 1U;
    const int32_t d = pm_shl(divisor, n); /* 0.5 ... 1 in Q31 */

    int32_t r = (int32_t)((UINT32_MAX / ((uint32_t)d >> 15)) << 13); /* 1 / d in Q29, to 16 bits */
    const int32_t miss = (1 << 28) - pm_mulh(d, r);
    r = pm_mulh_add(r, r, pm_shl(miss, 4)); /* one Newton step: 30 bits */

    const int32_t p = pm_mulh(pm_shl(a, m), r); /* 2^27 ... 2^29, to be shifted by n - m */
    int32_t q;
    if (n >= m) {
        const unsigned left = n - m;
        q = p > (PM_Q_MAX >> left) ? PM_Q_MAX : p << left;
    } else {
        const unsigned right = m - n;
        q = (p + (1 << (right - 1U))) >> right;
    }
    return num < 0 ? -q : q;
}

pm_unit_t pm_ratio(pm_q_t num, pm_q_t den)
{
    /* both shifted to the top, so that the quotient keeps 15 bits or more */
    const unsigned lift = (unsigned)__builtin_clz((uint32_t)den | 1U);
    const uint32_t n = (uint32_t)num << lift; /* < 2^32, as num <= den */
    const uint32_t d = ((uint32_t)den << lift) >> 16;
    const uint32_t q = n / d; /* slightly above 2^16 at most */
    return q >= 0x10000U ? PM_UNIT_MAX : (int32_t)(q << 15);
}
