/* Upper half of the 64-bit product, rounded to nearest: the one multiplication of the control path.
 *
 * On Cortex-M4 each function is one instruction of one cycle (SMMULR, SMMLAR, SMMLSR). C cannot name the
 * rounding or the subtracting form, and the compiler's truncating form needs a scratch register, hence the
 * assembler. The C forms give the same bits elsewhere. Rounding is free and leaves no bias for an integrator
 * to collect; each call adds at most half an LSB. Sums wrap beyond 32 bits. Tests:
 * tests/unit/math/fixed_test.cpp; same bits on the target: tests/target/math. */
#ifndef PM_MATH_MULH_H
#define PM_MATH_MULH_H

#include <stdint.h>

#include "firmware/math/compiler.h"

#if defined(__ARM_FEATURE_DSP) && __ARM_FEATURE_DSP && defined(__thumb2__)
#define PM_HAS_DSP 1
#else
#define PM_HAS_DSP 0
#endif

/* ARMv6-M multiplies to 32 bits only; there a long product is a call. */
#if defined(__ARM_ARCH_ISA_THUMB) && __ARM_ARCH_ISA_THUMB < 2
#define PM_HAS_LONG_MUL 0
#else
#define PM_HAS_LONG_MUL 1
#endif

#if PM_HAS_DSP

static inline int32_t pm_mulh(int32_t a, int32_t b)
{
    int32_t r;
    __asm__("smmulr %0, %1, %2" : "=r"(r) : "r"(a), "r"(b));
    return r;
}

static inline int32_t pm_mulh_add(int32_t c, int32_t a, int32_t b)
{
    int32_t r;
    __asm__("smmlar %0, %1, %2, %3" : "=r"(r) : "r"(a), "r"(b), "r"(c));
    return r;
}

static inline int32_t pm_mulh_sub(int32_t c, int32_t a, int32_t b)
{
    int32_t r;
    __asm__("smmlsr %0, %1, %2, %3" : "=r"(r) : "r"(a), "r"(b), "r"(c));
    return r;
}

#else

/* (a b + 2^31 - less) / 2^32, rounded down; less is 0 or 1. From four products of halves where a product of
 * 32 bits is the longest there is; no sum overflows, with the largest halves the first reaches 2^31 - 1. */
static inline int32_t pm_mulh_halves(int32_t a, int32_t b, uint32_t less)
{
    const uint32_t a0 = (uint32_t)a & 0xFFFFU, b0 = (uint32_t)b & 0xFFFFU;
    const int32_t a1 = a >> 16, b1 = b >> 16;
    const uint32_t low = less == 0U ? ((a0 * b0) >> 16) + 0x8000U : ((a0 * b0 + 0xFFFFU) >> 16) + 0x7FFFU;
    const int32_t middle = a1 * (int32_t)b0 + (int32_t)low;
    return a1 * b1 + (middle >> 16) + (((int32_t)a0 * b1 + (int32_t)((uint32_t)middle & 0xFFFFU)) >> 16);
}

#if PM_HAS_LONG_MUL

static inline int32_t pm_mulh(int32_t a, int32_t b) /* a b / 2^32 */
{
    const int64_t p = (int64_t)a * b;
    return (int32_t)(p >> 32) + (int32_t)((uint32_t)p >> 31);
}

static inline int32_t pm_mulh_sub(int32_t c, int32_t a, int32_t b) /* c - a b / 2^32 */
{
    return (int32_t)((uint32_t)c + (uint32_t)((INT64_C(0x80000000) - (int64_t)a * b) >> 32));
}

#else

static inline int32_t pm_mulh(int32_t a, int32_t b)
{
    return pm_mulh_halves(a, b, 0U);
}

static inline int32_t pm_mulh_sub(int32_t c, int32_t a, int32_t b)
{
    return (int32_t)((uint32_t)c - (uint32_t)pm_mulh_halves(a, b, 1U));
}

#endif

static inline int32_t pm_mulh_add(int32_t c, int32_t a, int32_t b) /* c + a b / 2^32 */
{
    return (int32_t)((uint32_t)c + (uint32_t)pm_mulh(a, b));
}

#endif

/* x in both places: one store of a word where the compiler would make two. */
static inline void pm_store_twice(uint16_t *both, int32_t x) /* 0 <= x < 2^16 */
{
    pm_assume(x >= 0 && x <= UINT16_MAX);
    const uint32_t word = (uint32_t)x | ((uint32_t)x << 16);
    __builtin_memcpy(both, &word, sizeof word);
}

/* (a b + c d) / 2^32, two roundings. */
static inline int32_t pm_mulh2(int32_t a, int32_t b, int32_t c, int32_t d)
{
    return pm_mulh_add(pm_mulh(a, b), c, d);
}

#endif
