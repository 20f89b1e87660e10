/* The six sectors of block commutation (METHODS.md 0.1, 10.2.3).
 *
 *   sector      0        1        2        3        4        5
 *   from       30       90      150      210      270      330   electrical degrees, for 60
 *   high, low  B A      C A      C B      A B      A C      B C
 *   open        C        B        A        C        B        A
 * The EMF of the open leg crosses zero in the middle of its sector, upwards in even ones, downwards in odd ones. In the
 * next sector the open leg is the one that comes: as the high one after an upward crossing, else as the low one.
 *
 * The other direction is the same machine with B and C exchanged: all else of this folder sees angles that rise.
 * Tests: tests/unit/bldc/patterns_test.cpp. */
#ifndef BLDC_SECTORS_H
#define BLDC_SECTORS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/math/compiler.h"

#define SECTORS 6U

typedef struct {
    uint8_t high, low, open; /* legs, 0 ... 2 */
    uint8_t stays;           /* the one of high and low that conducted in the sector before */
} sector_t;

static inline uint32_t sector_next(uint32_t sector)
{
    return sector == SECTORS - 1U ? 0U : sector + 1U;
}

/* Sectors from a to b, 0 ... 5. */
static inline uint32_t sector_distance(uint32_t a, uint32_t b)
{
    return b >= a ? b - a : b + SECTORS - a;
}

static inline bool sector_rising(uint32_t sector)
{
    return (sector & 1U) == 0U;
}

static inline sector_t sector_legs(uint32_t sector, bool reverse)
{
    static const sector_t legs[2][SECTORS] = {
        {{1, 0, 2, 1}, {2, 0, 1, 0}, {2, 1, 0, 2}, {0, 1, 2, 1}, {0, 2, 1, 0}, {1, 2, 0, 2}},
        {{2, 0, 1, 2}, {1, 0, 2, 0}, {1, 2, 0, 1}, {0, 2, 1, 2}, {0, 1, 2, 0}, {2, 1, 0, 1}},
    };
    return legs[reverse ? 1 : 0][sector];
}

#endif
