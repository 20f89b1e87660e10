/* Drive profile CiA 402: from the controlword to commands for the drive, and back to the statusword.
 *
 * Modes: profile velocity (3), profile torque (4), -1: current vector of a given amplitude that turns at the
 * target velocity, -2: identification of the machine with that current up to that velocity, and in images with
 * block commutation -3: duty, a share of the DC link's voltage (drive/block.h); halt is a duty of 0. Option codes
 * that the drive supports: quick stop 0, 1, 5; shutdown 0, 1; disable operation 0, 1; halt 1; fault reaction
 * 0 (the bridge opens at once, always).
 *
 * cia402_step() runs after every frame and once per round of the main loop; its output `clear_fault` is valid
 * for that step alone. A fault is left only by the rising edge of bit 7 of the controlword after its cause
 * has gone; nothing starts by itself. The mode is latched when operation is enabled.
 * Tests: tests/unit/can/cia402_test.cpp. */
#ifndef CAN_CIA402_H
#define CAN_CIA402_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/can/dictionary.h"
#include "firmware/math/image.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    CIA402_NOT_READY,
    CIA402_SWITCH_ON_DISABLED,
    CIA402_READY_TO_SWITCH_ON,
    CIA402_SWITCHED_ON,
    CIA402_OPERATION_ENABLED,
    CIA402_QUICK_STOP_ACTIVE,
    CIA402_FAULT_REACTION_ACTIVE,
    CIA402_FAULT,
} cia402_state_t;

enum {
    CIA402_MODE_DUTY = -3,
    CIA402_MODE_IDENTIFY = -2,
    CIA402_MODE_CURRENT = -1,
    CIA402_MODE_NONE = 0,
    CIA402_MODE_VELOCITY = 3,
    CIA402_MODE_TORQUE = 4,
};

/* State of the drive */
typedef struct {
    bool ready;     /* it may be switched on: parameters and hardware are in order */
    bool fault;     /* latched */
    bool off;       /* the bridge is, and the drive is at rest */
    bool following; /* the targets: not while it calibrates, finds the position or stops */
    bool voltage;   /* DC link within its limits */
    bool limited, warning;
    int32_t velocity; /* mrad/s */
} cia402_in_t;

/* Commands to the drive */
typedef struct {
    bool enable;
    bool coast; /* when not enabled: the bridge opens at once; else the drive stops first */
    bool clear_fault;
    int8_t mode;
    int32_t velocity;                    /* mrad/s */
    int32_t torque;                      /* permille of the rated torque */
    int32_t current;                     /* mA */
    PM_IN_IMAGE(six_step, int32_t duty;) /* 1e-4 of v_dc */
} cia402_out_t;

typedef struct {
    cia402_state_t state;
    uint16_t controlword, seen; /* as given, and as at the last step */
    bool clearing;              /* the fault may go */
    bool coast;
    int16_t mode, active_mode;
    int16_t quick_stop_option, shutdown_option, disable_option;
    uint16_t window, threshold; /* mrad/s */
    int32_t target_velocity, target_torque, target_current;
    PM_IN_IMAGE(six_step, int32_t target_duty;)
} cia402_t;

void cia402_init(cia402_t *self);
cia402_out_t cia402_step(cia402_t *self, const cia402_in_t *in);
uint16_t cia402_statusword(const cia402_t *self, const cia402_in_t *in);
void cia402_abandon(cia402_t *self);  /* master silent: slows down, then off until a shutdown */
bool cia402_on(const cia402_t *self); /* the drive is on, or about to be */

/* Objects of the profile by slot (OD_LIVE_...). False: not one of these. */
bool cia402_get(const cia402_t *self, uint16_t slot, int32_t *value);
bool cia402_put(cia402_t *self, uint16_t slot, int32_t value, uint32_t *code);

#ifdef __cplusplus
}
#endif

#endif
