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

#if defined(__ARM_FEATURE_DSP) && __ARM_FEATURE_DSP && defined(__thumb2__)
#define PM_HAS_DSP 1
#else
#define PM_HAS_DSP 0
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

static inline int32_t pm_mulh(int32_t a, int32_t b) /* a b / 2^32 */
{
    return (int32_t)(((int64_t)a * b + INT64_C(0x80000000)) >> 32);
}

static inline int32_t pm_mulh_add(int32_t c, int32_t a, int32_t b) /* c + a b / 2^32 */
{
    return (int32_t)((uint32_t)c + (uint32_t)pm_mulh(a, b));
}

static inline int32_t pm_mulh_sub(int32_t c, int32_t a, int32_t b) /* c - a b / 2^32 */
{
    return (int32_t)((uint32_t)c + (uint32_t)((INT64_C(0x80000000) - (int64_t)a * b) >> 32));
}

#endif

/* x in both places: one store of a word where the compiler would make two. */
static inline void pm_store_twice(uint16_t *both, int32_t x) /* 0 <= x < 2^16 */
{
    const uint32_t word = (uint32_t)x | ((uint32_t)x << 16);
    __builtin_memcpy(both, &word, sizeof word);
}

/* (a b + c d) / 2^32, two roundings. */
static inline int32_t pm_mulh2(int32_t a, int32_t b, int32_t c, int32_t d)
{
    return pm_mulh_add(pm_mulh(a, b), c, d);
}

#endif
