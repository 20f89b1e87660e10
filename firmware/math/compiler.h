/* Placement of a function's code: the control period is one straight sequence, rare code lies outside it. */
#ifndef PM_MATH_COMPILER_H
#define PM_MATH_COMPILER_H

#include <stdbool.h>

#define PM_INLINE static inline __attribute__((always_inline))
#define PM_RARE   __attribute__((noinline, cold))
#define PM_APART  __attribute__((noinline)) /* called from rare code, but not rare itself */

/* What the compiler cannot know: with it, it leaves out what would only matter otherwise. */
static inline void pm_assume(bool x)
{
    if (!x) {
        __builtin_unreachable();
    }
}

/* A condition of the control period that is almost never true. */
static inline bool pm_rarely(bool x)
{
    return __builtin_expect(x ? 1L : 0L, 0L) != 0L;
}

#endif
