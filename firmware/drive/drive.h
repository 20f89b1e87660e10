/* The drive: from converter codes to timer counts, once per PWM period.
 *
 * drive_step() runs in the ADC interrupt. drive_slow() runs at 1 kHz and must not be interrupted by it: call
 * it from the same interrupt every config.slow_divider periods, or with that interrupt masked. The rest is
 * for thread context. No function blocks or allocates. The bridge is off unless the state says on.
 *
 *   drive_init(d, params, channels)
 *                           configuration from SI parameters; refuses bad ones, and methods that need what
 *                           the board has not, and names the first
 *   drive_step(d, in, out)  one control period; cost: tests/target/drive
 *   drive_slow(d, in)       state machine, speed control, derating
 *   drive_command(d, cmd)   what the user wants; at any time from thread context, with the interrupt masked
 *   drive_clear_fault(d)    only when disabled; a fault never clears or restarts by itself
 *
 * Timing: in is sampled at t_k, the centre of the all-low zero vector; out takes effect at t_k+1 and holds
 * until t_k+2. Tests: tests/unit/drive, tests/scenario. */
#ifndef DRIVE_DRIVE_H
#define DRIVE_DRIVE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/drive/config.h"
#include "firmware/drive/fault.h"
#include "firmware/math/frames.h"
#include "firmware/math/image.h"
#include "firmware/math/legs.h"
#include "firmware/math/measure.h"

#ifdef __cplusplus
extern "C" {
#endif

#define DRIVE_LEGS PM_LEGS

/* What every board measures, then what methods may need beside it (measure.h). */
typedef struct {
    uint16_t i_leg[DRIVE_LEGS]; /* left-aligned code, mid-scale = zero, positive into the motor */
    uint16_t v_dc;              /* left-aligned code */
    bool hw_fault;              /* break input has switched the bridge off */
#if PM_CARRIES(PM_MEASURED)
    pm_measure_t more;
#endif
} drive_in_t;

typedef struct {
    /* timer counts of the rising- and falling-edge half of the carrier: on-time of the upper switch in that
     * half; the second is written only in programs that carry NEEDS_HALVES */
    uint16_t compare[DRIVE_LEGS][2];
    uint16_t legs; /* PM_LEGS_... */
    uint16_t trip; /* 1, a fault: the port opens the bridge now, not at the update event */
#if PM_CARRIES(PM_DONE_AT)
    pm_instants_t instants;
#endif
#if PM_CARRIES(NEEDS_BRIDGES)
    uint16_t second[DRIVE_LEGS]; /* of a second bridge: timer counts of both halves, ... */
    uint16_t second_legs;        /* ... and PM_LEGS_OFF or PM_LEGS_PWM */
#endif
} drive_out_t;

/* Bytes that come first and are the same in every program. */
#if PM_CARRIES(PM_MEASURED)
#define DRIVE_IN_COMMON offsetof(drive_in_t, more)
#else
#define DRIVE_IN_COMMON sizeof(drive_in_t)
#endif
#if PM_CARRIES(PM_DONE_AT)
#define DRIVE_OUT_COMMON offsetof(drive_out_t, instants)
#elif PM_CARRIES(NEEDS_BRIDGES)
#define DRIVE_OUT_COMMON offsetof(drive_out_t, second)
#else
#define DRIVE_OUT_COMMON sizeof(drive_out_t)
#endif

typedef struct {
    int32_t temperature_dC; /* 0.1 degC, hottest of the sensors */
} drive_slow_in_t;

typedef enum {
    DRIVE_OFF,
    DRIVE_CALIBRATING, /* current offsets, bridge off */
    DRIVE_FINDING,     /* initial position: pulses, or align */
    DRIVE_RUNNING,
    DRIVE_STOPPING, /* speed ramps to zero, then off */
    DRIVE_FAULT,
} drive_state_t;

typedef enum {
    DRIVE_MODE_SPEED,
    DRIVE_MODE_TORQUE,
    DRIVE_MODE_DUTY, /* share of v_dc between the two legs of block commutation (block.h); without it the drive stays off */
    DRIVE_MODE_CURRENT, /* current vector at a given angle that turns at the speed reference: commissioning */
    DRIVE_MODE_IDENTIFY, /* the drive measures its machine, with that current up to that speed, then waits */
} drive_mode_t;

typedef struct {
    bool enable;          /* false while running: stop, then off */
    drive_mode_t mode;    /* taken when the drive starts */
    int32_t speed_mrad_s; /* mechanical, signed */
    int32_t torque_uNm;
    int32_t current_mA;                      /* current mode, identification */
    PM_IN_IMAGE(six_step, int32_t duty_ppm;) /* of v_dc, signed */
    uint8_t routines;                        /* COMMISSIONING_...: what to identify */
    bool coast;                              /* when not enabled: off at once, without a stop */
} drive_command_t;

/* Limits at work: information, not faults. */
enum {
    DRIVE_LIMIT_CURRENT = 1 << 0,     /* torque reference at the current limit, or the duty gives way to it */
    DRIVE_LIMIT_VOLTAGE = 1 << 1,     /* modulator at its limit */
    DRIVE_LIMIT_TEMPERATURE = 1 << 2, /* current derated by temperature */
    DRIVE_LIMIT_DC_VOLTAGE = 1 << 3,  /* regeneration derated by the DC-link voltage */
    DRIVE_LIMIT_SPEED = 1 << 4,       /* reference clamped to speed_max, or the torque gives way to it */
    DRIVE_LIMIT_SLIP = 1 << 5, /* the position had slipped since the start, and was put right (slip.h) */
};

/* A snapshot for traces, CAN and tests; per-unit values as in config.h. While there is no current control,
 * the bridge off, say, position, speed, currents and quality are zero. */
typedef struct {
    drive_state_t state;
    drive_fault_t fault;
    uint32_t limits;
    pm_angle_t theta; /* estimated, at the sample instant */
    pm_q_t omega;     /* estimated, electrical */
    pm_q_t omega_ref; /* after the ramp */
    pm_dq_t i, i_ref; /* estimated frame */
    pm_ab_t v;        /* voltage realised by the step's output */
    pm_q_t v_dc;
    pm_q_t weight;           /* 0: injection, 1: flux observer */
    pm_q_t quality;          /* 1: good, 0: lost */
    uint8_t slips;           /* of the position that were put right in this run */
    drive_refusal_t refusal; /* of the present start or the last */
} drive_status_t;

typedef struct drive drive_t; /* caller-owned: the struct stands in drive_state.h */

/* On refusal the drive is in DRIVE_FAULT with DRIVE_FAULT_PARAMETERS and stays off. */
drive_result_t drive_init(drive_t *drive, const drive_params_t *params, uint32_t channels);

/* Takes a new configuration, whole; ends the fault PARAMETERS, after which the drive waits for a command. Between two steps: in the
 * slow interrupt. While the drive is not off, nothing that drive_same_frame() compares may differ; the observer may. */
void drive_reconfigure(drive_t *drive, const drive_config_t *config);

/* Bases, timing and start are the same, so that the present state keeps its meaning. */
bool drive_same_frame(const drive_config_t *a, const drive_config_t *b);

void drive_step(drive_t *drive, const drive_in_t *in, drive_out_t *out);
void drive_slow(drive_t *drive, const drive_slow_in_t *in);
void drive_command(drive_t *drive, const drive_command_t *command);

/* Latches a fault, the drive's own or one that only the caller can see, with the values of the moment; the
 * first stays. The step that runs next, or this one, opens the bridge, or shorts the motor (fault_short.h).
 * From thread context with the interrupt masked. */
void drive_trip(drive_t *drive, drive_fault_t fault);
bool drive_clear_fault(drive_t *drive); /* false: cause or short are still there, or enable is still set */
const drive_status_t *drive_status(const drive_t *drive);
const drive_fault_record_t *drive_fault_record(const drive_t *drive); /* values at the moment of the fault */

#ifdef __cplusplus
}
#endif

#endif
