/* Offsets of the current channels, and of the neutral's where the program carries it: means of 1024 periods with the bridge
 * off.
 *
 *   zero = sum of the codes / 1024
 * 1024 periods in which no current differs from that of the first by more than 1/64 of full scale, or twelve times i_noise where
 * that is more. One that differs by more belongs to a rotor whose EMF is above the link, and its mean is no offset: the 1024 periods
 * begin again. So the start waits until the diodes conduct no more, and no current flows when its next step begins.
 * Fails with OFFSET when a channel is off mid-scale by more than offset_max, the neutral's by a quarter of its full scale; with
 * TIMEOUT where there is no rest in 65,535 periods: a rotor that is driven, or a channel that is not connected.
 * Of a rotor that turns the neutral sees whole cycles of its third harmonic, or what is left of one.
 * Tests: tests/unit/drive/drive_test.cpp, tests/contract/procedure_contract_test.cpp,
 * tests/scenario/fault_sensor_offset.yaml, flying_start_above_link.yaml. */
#ifndef DRIVE_PROCEDURES_CALIBRATE_H
#define DRIVE_PROCEDURES_CALIBRATE_H

#include <stdint.h>

#include "firmware/math/measure.h"

#define CALIBRATE_BITS    10
#define CALIBRATE_PERIODS 1024U /* 2^CALIBRATE_BITS */

typedef struct {
    int32_t sum[3];
    uint16_t first[3];
    uint16_t timer; /* periods since it began */
#if PM_CARRIES(NEEDS_NEUTRAL)
    int32_t neutral; /* sum of its codes */
#endif
#if PM_CARRIES(NEEDS_SECOND_SET)
    int32_t second[3];
    uint16_t second_first[3];
    int32_t neutral_second;
#endif
    uint16_t count; /* periods at rest so far */
} calibrate_t;

#endif
