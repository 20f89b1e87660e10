#include "firmware/app/remote.h"

#define COMMAND_ID  (0x200U + REMOTE_NODE)
#define SETPOINT_ID (0x300U + REMOTE_NODE)
#define STATUS_ID   (0x180U + REMOTE_NODE)
#define STATUS_US   10000U

#define BIT_ENABLE 0x01U
#define BIT_CLEAR  0x80U

static int32_t word_at(const uint8_t *bytes)
{
    return (int32_t)((uint32_t)bytes[0] | ((uint32_t)bytes[1] << 8) | ((uint32_t)bytes[2] << 16) |
                     ((uint32_t)bytes[3] << 24));
}

static remote_event_t take_command(remote_t *self, const hal_can_frame_t *frame, uint32_t now_us)
{
    if (frame->length != 6U || frame->data[1] > (uint8_t)DRIVE_MODE_CURRENT) {
        self->refused++;
        return REMOTE_NOTHING;
    }
    const bool clear = (frame->data[0] & BIT_CLEAR) != 0U;
    const bool edge = clear && !self->clear;
    self->clear = clear;
    self->command.enable = (frame->data[0] & BIT_ENABLE) != 0U;
    self->command.mode = (drive_mode_t)frame->data[1];
    self->command.speed_mrad_s = word_at(&frame->data[2]);
    self->command_us = now_us;
    return edge ? REMOTE_CLEAR : REMOTE_COMMAND;
}

remote_event_t remote_take(remote_t *remote, const hal_can_frame_t *frame, uint32_t now_us)
{
    if (frame->id == COMMAND_ID) {
        return take_command(remote, frame, now_us);
    }
    if (frame->id != SETPOINT_ID) {
        return REMOTE_NOTHING; /* not for this node */
    }
    if (frame->length != 8U) {
        remote->refused++;
        return REMOTE_NOTHING;
    }
    remote->command.torque_uNm = word_at(&frame->data[0]);
    remote->command.current_mA = word_at(&frame->data[4]);
    return REMOTE_COMMAND;
}

bool remote_lost(const remote_t *remote, uint32_t now_us)
{
    return remote->command.enable && now_us - remote->command_us > REMOTE_TIMEOUT_US;
}

bool remote_status(remote_t *remote, const drive_status_t *status, uint32_t now_us, hal_can_frame_t *frame)
{
    if (now_us - remote->status_us < STATUS_US) {
        return false;
    }
    remote->status_us = now_us;
    *frame = (hal_can_frame_t){
        .id = STATUS_ID,
        .length = 4,
        .data = {(uint8_t)status->state, (uint8_t)status->fault, (uint8_t)(status->limits & 0xFFU),
                 (uint8_t)((status->limits >> 8) & 0xFFU)},
    };
    return true;
}
