/* Recorded control periods: what went into the drive and what came out, to be replayed bit for bit.
 *
 * File: record_header_t, the parameters (int32_t each, in the order of parameters.def), then one
 * record_period_t per control period. Little-endian throughout, so that a Cortex-M reads it as it stands:
 *
 *   drive_init(params)
 *   per period k: drive_command() if given & RECORD_COMMAND; drive_clear_fault() if given & RECORD_CLEAR;
 *                 drive_step() -> compare with compare[][] and driven[];
 *                 drive_slow() if k % slow_divider == 0
 *
 * Written by `pmsim record`; plain C so that firmware tests can include it. */
#ifndef PMSIM_RECORD_H
#define PMSIM_RECORD_H

#include <stdint.h>

#define RECORD_MAGIC "PMREC003"
#define RECORD_LEGS  3

enum { RECORD_LAYOUT = 27 }; /* figures of record_layout() */
enum { RECORD_COMMAND = 1, RECORD_CLEAR = 2 };

typedef struct {
    char magic[8];
    uint32_t parameters; /* count */
    uint32_t periods;    /* count */
    uint32_t slow_divider;
    uint32_t period_bytes;          /* sizeof(record_period_t) */
    uint32_t layout[RECORD_LAYOUT]; /* of the recorder's drive_t */
} record_header_t;

typedef struct {
    uint16_t i_leg[RECORD_LEGS], v_dc; /* drive_in_t */
    uint8_t hw_fault;
    uint8_t given;        /* RECORD_...: done before the step */
    uint8_t enable, mode; /* drive_command_t */
    int32_t speed_mrad_s, torque_uNm, current_mA, duty_ppm;
    int32_t temperature_dC;           /* drive_slow_in_t */
    uint16_t compare[RECORD_LEGS][2]; /* drive_out_t */
    uint8_t driven[RECORD_LEGS];
    uint8_t unused; /* 0 */
} record_period_t;

#endif
