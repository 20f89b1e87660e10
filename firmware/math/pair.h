/* Two neighbouring words loaded by one instruction, LDRD on Cortex-M4: the compiler merges two loads only if
 * it happens to schedule them next to each other. `second` must directly follow `first` in the same struct;
 * the replay on the target (tests/target/drive) compares the bits. */
#ifndef PM_MATH_PAIR_H
#define PM_MATH_PAIR_H

#include "firmware/math/frames.h"

typedef struct {
    int32_t first, second;
} pm_pair_t;

static inline pm_pair_t pm_pair(const int32_t *first, const int32_t *second)
{
    pm_pair_t r;
#if PM_HAS_DSP
    __asm__("ldrd %0, %1, %2" : "=r"(r.first), "=r"(r.second) : "Uv"(*first), "m"(*second));
#else
    r.first = *first;
    r.second = *second;
#endif
    return r;
}

/* An element of a table: the address is computed once for both words. */
static inline pm_pair_t pm_pair_of(const pm_pair_t *table, uint32_t index)
{
    pm_pair_t r;
#if PM_HAS_DSP
    __asm__("ldrd %0, %1, %2" : "=r"(r.first), "=r"(r.second) : "Uv"(table[index]));
#else
    r = table[index];
#endif
    return r;
}

static inline pm_ab_t pm_pair_ab(const pm_ab_t *x)
{
    const pm_pair_t r = pm_pair(&x->alpha, &x->beta);
    pm_ab_t y;
    y.alpha = r.first;
    y.beta = r.second;
    return y;
}

static inline pm_dir_t pm_pair_dir(const pm_dir_t *x)
{
    const pm_pair_t r = pm_pair(&x->cos, &x->sin);
    const pm_dir_t y = {r.first, r.second};
    return y;
}

static inline pm_dq_t pm_pair_dq(const pm_dq_t *x)
{
    const pm_pair_t r = pm_pair(&x->d, &x->q);
    pm_dq_t y;
    y.d = r.first;
    y.q = r.second;
    return y;
}

#endif
