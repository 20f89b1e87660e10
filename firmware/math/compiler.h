/* Where a function's code goes: the control period is one straight piece, what is rare stands outside. */
#ifndef PM_MATH_COMPILER_H
#define PM_MATH_COMPILER_H

#include <stdbool.h>

#define PM_INLINE static inline __attribute__((always_inline))
#define PM_RARE   __attribute__((noinline, cold))
#define PM_APART  __attribute__((noinline)) /* called from what is rare, but not rare itself */

/* A condition of the control period that is next to never true. */
static inline bool pm_rarely(bool x)
{
    return __builtin_expect(x ? 1L : 0L, 0L) != 0L;
}

#endif
