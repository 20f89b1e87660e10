/* Commands and status over CAN, until the CANopen node takes their place: the same identifiers as its default
 * process data. Little-endian.
 *
 *   0x200 + node  command  [0] bit 0 enable, bit 7 clear fault (rising edge); [1] mode; [2..5] speed, mrad/s
 *   0x300 + node  command  [0..3] torque, uNm; [4..7] current, mA
 *   0x180 + node  status   [0] state, [1] fault, [2..3] limits; every 10 ms
 *
 * While enabled, the first command must come at least every 500 ms: else the fault REMOTE_LOST. A frame of
 * another length or with an unknown mode is ignored and counted. Tests: tests/unit/app/remote_test.cpp. */
#ifndef APP_REMOTE_H
#define APP_REMOTE_H

#include "firmware/drive/drive.h"
#include "hal/hal.h"

#define REMOTE_NODE       1U
#define REMOTE_TIMEOUT_US 500000U

typedef struct {
    drive_command_t command;
    bool clear; /* the bit, as last seen */
    uint32_t command_us, status_us;
    uint32_t refused; /* frames that made no sense */
} remote_t;

typedef enum { REMOTE_NOTHING, REMOTE_COMMAND, REMOTE_CLEAR } remote_event_t;

/* A frame has come: what it asks for. CLEAR brings a command too. */
remote_event_t remote_take(remote_t *remote, const hal_can_frame_t *frame, uint32_t now_us);

bool remote_lost(const remote_t *remote, uint32_t now_us);

/* The frame that is due; false: none. */
bool remote_status(remote_t *remote, const drive_status_t *status, uint32_t now_us, hal_can_frame_t *frame);

#endif
