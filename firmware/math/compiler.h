/* Where a function's code goes: the control period is one straight piece, what is rare stands outside. */
#ifndef PM_MATH_COMPILER_H
#define PM_MATH_COMPILER_H

#define PM_INLINE static inline __attribute__((always_inline))
#define PM_RARE   __attribute__((noinline, cold))

#endif
