/* What the legs of the bridge do in a period: the output of a procedure that owns the bridge, and of a
 * commutation.
 *
 * With PM_LEG_PWM the mean voltage of a terminal against the negative rail is, dead time and drops aside,
 *   v = duty v_dc.
 * With PM_LEG_INVERTED it is (1 - duty) v_dc: the upper switch is closed about the start of the period. With the other
 * states a diode, the motor or a closed switch decides. One switch alone has no dead time. These changes
 * need a period of OFF or PWM between:
 *   UPPER or HIGH to LOWER of either kind
 *   LOWER of either kind or LOW to UPPER
 *   LOWER of either kind to HIGH
 * Tests: tests/contract/hal, tests/unit/drive. */
#ifndef PM_MATH_LEGS_H
#define PM_MATH_LEGS_H

#include "firmware/math/fixed.h"
#include "firmware/math/measure.h"
#include "firmware/math/mulh.h"

/* Every port can do OFF and PWM; HIGH and LOW are NEEDS_HELD, the others NEEDS_ONE_SWITCH. */
typedef enum {
    PM_LEG_OFF,      /* both switches open */
    PM_LEG_PWM,      /* complementary, with dead time */
    PM_LEG_UPPER,    /* the upper switch as with PWM, the lower one open */
    PM_LEG_LOWER,    /* the lower switch as with PWM, the upper one open */
    PM_LEG_HIGH,     /* the upper switch closed throughout; the duty does not matter */
    PM_LEG_LOW,      /* the lower switch closed throughout */
    PM_LEG_INVERTED, /* complementary, the lower switch closed for the duty, about the middle of the period */
    PM_LEG_LOWER_INVERTED, /* the lower switch as with INVERTED, the upper one open */
} pm_leg_t;

/* The states of three legs, four bits each: one word, so that a period in which nothing is unusual costs one
 * store. */
#define PM_LEGS_ALL(state) ((uint16_t)(0x111U * (uint32_t)(state)))
#define PM_LEGS_OFF        PM_LEGS_ALL(PM_LEG_OFF)
#define PM_LEGS_PWM        PM_LEGS_ALL(PM_LEG_PWM)

#define PM_LEGS_OF(a, b, c) (uint16_t)((uint32_t)(a) | (uint32_t)(b) << 4U | (uint32_t)(c) << 8U)

static inline uint16_t pm_legs_of(pm_leg_t a, pm_leg_t b, pm_leg_t c)
{
    return PM_LEGS_OF(a, b, c);
}

static inline pm_leg_t pm_leg(uint16_t legs, uint32_t leg)
{
    return (pm_leg_t)((uint32_t)legs >> 4U * leg & 15U);
}

/* On-time of a leg, in both halves of the carrier alike; a port without NEEDS_HALVES reads the first alone. */
static inline void pm_write_leg(uint16_t compare[2], int32_t on) /* 0 <= on < 2^16 */
{
#if PM_CARRIES(NEEDS_HALVES)
    pm_store_twice(compare, on);
#else
    pm_assume(on >= 0 && on <= UINT16_MAX);
    compare[0] = (uint16_t)on;
#endif
}

#endif
