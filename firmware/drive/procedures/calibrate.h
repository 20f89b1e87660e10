/* Offsets of the current channels, and of the neutral's where the program carries it: means of 1024 periods with the bridge
 * off.
 *
 *   zero = sum of the codes / 1024
 * 1024 periods; fails (OFFSET) when a channel is off mid-scale by more than offset_max, the neutral's by a quarter of its
 * full scale. Of a rotor that turns the neutral sees whole cycles of its third harmonic, or what is left of one.
 * Tests: tests/unit/drive/drive_test.cpp, tests/contract/procedure_contract_test.cpp,
 * tests/scenario/fault_sensor_offset.yaml. */
#ifndef DRIVE_PROCEDURES_CALIBRATE_H
#define DRIVE_PROCEDURES_CALIBRATE_H

#include <stdint.h>

#include "firmware/math/measure.h"

#define CALIBRATE_BITS    10
#define CALIBRATE_PERIODS 1024U /* 2^CALIBRATE_BITS */

typedef struct {
    int32_t sum[3];
#if PM_CARRIES(NEEDS_NEUTRAL)
    int32_t neutral; /* sum of its codes */
#endif
#if PM_CARRIES(NEEDS_SECOND_SET)
    int32_t second[3];
    int32_t neutral_second;
#endif
    uint16_t count; /* periods so far */
} calibrate_t;

#endif
