/* Fixed-point numbers of the control path.
 *
 * Signals are per-unit in Q28: 32 bits, range -8 ... +8 of the base, resolution 2^-28. Products keep the
 * upper 32 bits of the 64-bit product, rounded to nearest, which is one instruction on Cortex-M4 and has no
 * bias (docs/decisions/001-signal-format.md). Angles are unsigned turns of 2^32, so they wrap by themselves.
 *
 * Which constant goes with which product (x is a signal in Q28; error is that of one product):
 *   pm_mul(x, y)    y in Q28, +-8      signal x signal, result Q28; error <= 2^-25
 *   pm_frac(x, k)   k in Q32, +-0.5    filter and integration constants, result Q28; error <= 2^-29
 *   pm_unit(x, u)   u in Q31, +-1      sines, directions, ratios, result Q28; error <= 2^-28
 *   pm_gain(x, g)   g in Q26, +-32     controller gains, result *wide*: Q22, +-512; error <= 2^-23
 * frac, unit and gain cannot overflow (pm_unit only where the product rounds to +8). pm_mul wraps when the
 * product leaves +-8; where it may, use pm_mul_sat, one instruction more. *_add adds the product to a sum at
 * no cost and wraps with it. Nothing here is undefined behaviour for any input, except where a comment gives
 * a range.
 *
 * All shifts of the firmware stand in firmware/math. Tests: tests/unit/math/fixed_test.cpp. */
#ifndef PM_MATH_FIXED_H
#define PM_MATH_FIXED_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/math/mulh.h"

typedef int32_t pm_q_t;      /* signal, Q28 per-unit */
typedef int32_t pm_wide_t;   /* controller sum, Q22 per-unit */
typedef int32_t pm_frac_t;   /* constant, Q32, -0.5 ... 0.5 */
typedef int32_t pm_unit_t;   /* -1 ... 1, Q31 */
typedef int32_t pm_gain_t;   /* constant, Q26, -32 ... 32 */
typedef uint32_t pm_angle_t; /* 2^32 per turn, electrical unless said otherwise */

#define PM_Q_BITS    28
#define PM_ONE       ((pm_q_t)1 << PM_Q_BITS)
#define PM_Q_MAX     INT32_MAX
#define PM_UNIT_MAX  INT32_MAX
#define PM_WIDE_BITS 22

/* Literals in firmware sources: folded by the compiler, never computed on the target. */
#define PM_SCALED(x, one) ((int32_t)((x) * (one) + ((x) < 0 ? -0.5 : 0.5)))
#define PM_Q(x)           PM_SCALED(x, 268435456.0)
#define PM_WIDE(x)        PM_SCALED(x, 4194304.0)
#define PM_GAIN(x)        PM_SCALED(x, 67108864.0)
#define PM_UNIT(x)        PM_SCALED(x, 2147483647.0)       /* so that 1 fits */
#define PM_FRAC(x)        PM_SCALED(x, 4294967296.0)       /* -0.5 <= x < 0.5 */
#define PM_TURN(x)        ((pm_angle_t)((x)*4294967296.0)) /* 0 <= x < 1 */

/* Left shift of a signed value; bits that do not fit are lost. Mostly free: the operand shift of the next
 * instruction. */
static inline int32_t pm_shl(int32_t x, unsigned n)
{
    return (int32_t)((uint32_t)x << n);
}

static inline int32_t pm_min(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static inline int32_t pm_max(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

static inline int32_t pm_clamp(int32_t x, int32_t lo, int32_t hi) /* lo <= hi */
{
    return pm_max(pm_min(x, hi), lo);
}

/* Within -2^n ... 2^n - 1, n <= 31; a single SSAT on Cortex-M4 when n is a literal. */
static inline int32_t pm_sat(int32_t x, unsigned n)
{
#if PM_HAS_DSP
    if (__builtin_constant_p(n) != 0) { /* the compiler does not reliably find SSAT by itself */
        int32_t r;
        __asm__("ssat %0, %1, %2" : "=r"(r) : "i"(n + 1U), "r"(x));
        return r;
    }
#endif
    const int32_t top = (int32_t)((1U << n) - 1U);
    return pm_clamp(x, -top - 1, top);
}

/* The same for x 2^shift, whose upper bits are lost. */
static inline int32_t pm_shl_sat(int32_t x, unsigned shift, unsigned n)
{
#if PM_HAS_DSP
    if (__builtin_constant_p(n) != 0 && __builtin_constant_p(shift) != 0) {
        int32_t r;
        __asm__("ssat %0, %1, %2, lsl %3" : "=r"(r) : "i"(n + 1U), "r"(x), "i"(shift));
        return r;
    }
#endif
    return pm_sat(pm_shl(x, shift), n);
}

/* Within 0 ... 2^n - 1, n <= 30; a single USAT. */
static inline int32_t pm_sat_positive(int32_t x, unsigned n)
{
#if PM_HAS_DSP
    if (__builtin_constant_p(n) != 0) {
        int32_t r;
        __asm__("usat %0, %1, %2" : "=r"(r) : "i"(n), "r"(x));
        return r;
    }
#endif
    return pm_clamp(x, 0, (int32_t)((1U << n) - 1U));
}

#if PM_HAS_DSP

static inline int32_t pm_add_sat(int32_t a, int32_t b)
{
    int32_t r;
    __asm__("qadd %0, %1, %2" : "=r"(r) : "r"(a), "r"(b));
    return r;
}

static inline int32_t pm_sub_sat(int32_t a, int32_t b)
{
    int32_t r;
    __asm__("qsub %0, %1, %2" : "=r"(r) : "r"(a), "r"(b));
    return r;
}

#else

/* On overflow the sign of the sum differs from that of both operands: saturate on the side of a. */
static inline int32_t pm_end(int32_t a)
{
    return a < 0 ? INT32_MIN : INT32_MAX;
}

static inline int32_t pm_add_sat(int32_t a, int32_t b)
{
    const uint32_t sum = (uint32_t)a + (uint32_t)b;
    const uint32_t overflow = ((uint32_t)a ^ sum) & ((uint32_t)b ^ sum);
    return overflow > (uint32_t)INT32_MAX ? pm_end(a) : (int32_t)sum;
}

static inline int32_t pm_sub_sat(int32_t a, int32_t b)
{
    const uint32_t difference = (uint32_t)a - (uint32_t)b;
    const uint32_t overflow = ((uint32_t)a ^ (uint32_t)b) & ((uint32_t)a ^ difference);
    return overflow > (uint32_t)INT32_MAX ? pm_end(a) : (int32_t)difference;
}

#endif

/* lo <= x <= hi by one comparison; lo <= hi. */
static inline bool pm_within(int32_t x, int32_t lo, int32_t hi)
{
    return (uint32_t)x - (uint32_t)lo <= (uint32_t)hi - (uint32_t)lo;
}

static inline int32_t pm_abs(int32_t x) /* INT32_MIN -> INT32_MAX */
{
    return x < 0 ? pm_sub_sat(0, x) : x;
}

/* 1 where x > top, without a branch; top - x within 32 bits. */
static inline int32_t pm_above(int32_t x, int32_t top)
{
    return (int32_t)((uint32_t)(top - x) >> 31);
}

/* |x| without a branch, but INT32_MIN stays. */
static inline int32_t pm_magnitude(int32_t x)
{
    const uint32_t sign = x < 0 ? UINT32_MAX : 0U; /* a shift in the next operand */
    return (int32_t)(((uint32_t)x ^ sign) - sign);
}

static inline pm_q_t pm_mul(pm_q_t x, pm_q_t y)
{
    return pm_shl(pm_mulh(x, y), 32 - PM_Q_BITS);
}

/* A product beyond +-8 gives the nearest end. */
static inline pm_q_t pm_mul_sat(pm_q_t x, pm_q_t y)
{
    return pm_shl(pm_sat(pm_mulh(x, y), PM_Q_BITS - 1), 32 - PM_Q_BITS);
}

static inline pm_q_t pm_frac(pm_q_t x, pm_frac_t k)
{
    return pm_mulh(x, k);
}

static inline pm_q_t pm_frac_add(pm_q_t sum, pm_q_t x, pm_frac_t k)
{
    return pm_mulh_add(sum, x, k);
}

static inline pm_q_t pm_unit(pm_q_t x, pm_unit_t u)
{
    return pm_shl(pm_mulh(x, u), 1);
}

static inline pm_wide_t pm_gain(pm_q_t x, pm_gain_t g)
{
    return pm_mulh(x, g);
}

static inline pm_wide_t pm_gain_add(pm_wide_t sum, pm_q_t x, pm_gain_t g)
{
    return pm_mulh_add(sum, x, g);
}

static inline pm_wide_t pm_widen(pm_q_t x) /* rounds down: free in the operand of the next addition */
{
    return x >> (PM_Q_BITS - PM_WIDE_BITS);
}

/* A wide value that is known to lie within +-8; beyond, it wraps. */
static inline pm_q_t pm_narrow(pm_wide_t x)
{
    return pm_shl(x, PM_Q_BITS - PM_WIDE_BITS);
}

static inline pm_q_t pm_narrow_sat(pm_wide_t x)
{
    return pm_narrow(pm_sat(x, 31 - (PM_Q_BITS - PM_WIDE_BITS)));
}

static inline int32_t pm_half(int32_t x) /* rounds down */
{
    return x >> 1;
}

/* (a + b) / 2, rounded down; |a + b| within 32 bits. */
static inline int32_t pm_mean(int32_t a, int32_t b)
{
    return pm_half(a + b);
}

/* sum +- height x / edge for |x| below edge = 2^PM_ZONE_BITS, sum +- height beyond; |x| < 2^26, height in
 * Q(PM_HEIGHT_BITS): one saturation and one multiply-accumulate. */
#define PM_ZONE_BITS   14
#define PM_ZONE_EDGE   ((int32_t)1 << PM_ZONE_BITS)
#define PM_ZONE_LIFT   5
#define PM_HEIGHT_BITS (32 - PM_ZONE_BITS - PM_ZONE_LIFT)

static inline int32_t pm_zone_add(int32_t sum, int32_t x, int32_t height)
{
    return pm_mulh_add(sum, pm_shl_sat(x, PM_ZONE_LIFT, PM_ZONE_BITS + PM_ZONE_LIFT), height);
}

static inline int32_t pm_zone_sub(int32_t sum, int32_t x, int32_t height)
{
    return pm_mulh_sub(sum, pm_shl_sat(x, PM_ZONE_LIFT, PM_ZONE_BITS + PM_ZONE_LIFT), height);
}

/* A share, 0 ... 1 in Q20 with headroom to 2^11; the whole is an integer below 2^15. Shares beyond 0 and 1
 * are clamped. */
#define PM_SHARE_BITS 20
#define PM_SHARE_HALF ((int32_t)1 << (PM_SHARE_BITS - 1))
#define PM_SHARE_ONE  (2 * PM_SHARE_HALF)

static inline pm_unit_t pm_share_to_unit(int32_t share)
{
    return pm_shl(pm_sat_positive(share, PM_SHARE_BITS), 31 - PM_SHARE_BITS);
}

/* x times a share of 0 to below 2, so that one that rounding has left beyond 1 does not wrap; error 2 LSB. */
static inline int32_t pm_times_share(int32_t x, int32_t share)
{
    return pm_shl(pm_mulh(x, pm_shl(share, 30 - PM_SHARE_BITS)), 2);
}

/* As pm_share_of() takes it. */
static inline int32_t pm_share_whole(int32_t whole)
{
    return pm_shl(whole, 32 - PM_SHARE_BITS);
}

static inline int32_t pm_share_of(int32_t share, int32_t whole)
{
    return pm_mulh(pm_sat_positive(share, PM_SHARE_BITS), whole);
}

/* A small signal: Q32, +-0.5, saturating; for carrier currents, whose gains exceed pm_gain(). */
static inline int32_t pm_small(pm_q_t x)
{
    return pm_shl(pm_sat(x, 27), 4);
}

/* small x g, g in Q20 (+-2048), limited to +-1, as a signal. */
static inline pm_q_t pm_small_gain(int32_t small, int32_t g)
{
    return pm_shl(pm_sat(pm_mulh(small, g), 20), PM_Q_BITS - 20);
}

/* a - b by the shorter way round, in turns of 2^32. */
static inline int32_t pm_angle_diff(pm_angle_t a, pm_angle_t b)
{
    return (int32_t)(a - b);
}

/* Angle in radians, Q28 (-pi ... pi), of a signed angle, and back; error <= 2^-28 and 2^-27 rad. */
static inline pm_q_t pm_angle_to_rad(int32_t turns)
{
    return pm_mulh(turns, 1686629713); /* 2 pi / 16 in Q32 */
}

static inline int32_t pm_rad_to_angle(pm_q_t rad) /* |rad| > pi wraps, as an angle does */
{
    return pm_shl(pm_mulh(rad, 1367130551), 3); /* 16 / (2 pi) / 8 in Q32 */
}

#endif
