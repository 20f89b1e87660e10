/* Objects of the profile: settings and displayed values. */
#include "firmware/can/cia402.h"
#include "firmware/can/dictionary_slots.h"

#define OK      0U
#define INVALID 0x06090030U /* not a valid value */

bool cia402_get(const cia402_t *self, uint16_t slot, int32_t *value)
{
    switch (slot) {
    case OD_LIVE_CONTROLWORD:
        *value = self->controlword;
        return true;
    case OD_LIVE_QUICK_STOP_OPTION:
        *value = self->quick_stop_option;
        return true;
    case OD_LIVE_SHUTDOWN_OPTION:
        *value = self->shutdown_option;
        return true;
    case OD_LIVE_DISABLE_OPTION:
        *value = self->disable_option;
        return true;
    case OD_LIVE_HALT_OPTION:
        *value = 1;
        return true;
    case OD_LIVE_FAULT_OPTION:
        *value = 0;
        return true;
    case OD_LIVE_MODE:
        *value = self->mode;
        return true;
    case OD_LIVE_MODE_DISPLAY:
        *value = self->active_mode;
        return true;
    case OD_LIVE_VELOCITY_WINDOW:
        *value = self->window;
        return true;
    case OD_LIVE_VELOCITY_THRESHOLD:
        *value = self->threshold;
        return true;
    case OD_LIVE_TARGET_VELOCITY:
        *value = self->target_velocity;
        return true;
    case OD_LIVE_TARGET_TORQUE:
        *value = self->target_torque;
        return true;
    case OD_LIVE_TARGET_CURRENT:
        *value = self->target_current;
        return true;
#if PM_HAS(six_step)
    case OD_LIVE_TARGET_DUTY:
        *value = self->target_duty;
        return true;
#endif
    default:
        return false;
    }
}

static uint32_t put_option(int16_t *place, int32_t value, int32_t other)
{
    if (value != 0 && value != 1 && value != other) {
        return INVALID;
    }
    *place = (int16_t)value;
    return OK;
}

static uint32_t put_mode(cia402_t *self, int32_t value)
{
    const bool own = value == CIA402_MODE_IDENTIFY || value == CIA402_MODE_CURRENT ||
                     (PM_HAS(six_step) != 0 && value == CIA402_MODE_DUTY);
    if (!own && value != CIA402_MODE_NONE && value != CIA402_MODE_VELOCITY && value != CIA402_MODE_TORQUE) {
        return INVALID;
    }
    self->mode = (int16_t)value;
    return OK;
}

static bool put_option_code(cia402_t *self, uint16_t slot, int32_t value, uint32_t *code)
{
    switch (slot) {
    case OD_LIVE_QUICK_STOP_OPTION:
        *code = put_option(&self->quick_stop_option, value, 5);
        return true;
    case OD_LIVE_SHUTDOWN_OPTION:
        *code = put_option(&self->shutdown_option, value, 0);
        return true;
    case OD_LIVE_DISABLE_OPTION:
        *code = put_option(&self->disable_option, value, 0);
        return true;
    case OD_LIVE_HALT_OPTION:
        *code = value == 1 ? OK : INVALID;
        return true;
    case OD_LIVE_FAULT_OPTION:
        *code = value == 0 ? OK : INVALID;
        return true;
    default:
        return false;
    }
}

bool cia402_put(cia402_t *self, uint16_t slot, int32_t value, uint32_t *code)
{
    *code = OK;
    switch (slot) {
    case OD_LIVE_CONTROLWORD:
        self->controlword = (uint16_t)((uint32_t)value & 0xFFFFU);
        return true;
    case OD_LIVE_MODE:
        *code = put_mode(self, value);
        return true;
    case OD_LIVE_VELOCITY_WINDOW:
        self->window = (uint16_t)((uint32_t)value & 0xFFFFU);
        return true;
    case OD_LIVE_VELOCITY_THRESHOLD:
        self->threshold = (uint16_t)((uint32_t)value & 0xFFFFU);
        return true;
    case OD_LIVE_TARGET_VELOCITY:
        self->target_velocity = value;
        return true;
    case OD_LIVE_TARGET_TORQUE:
        self->target_torque = value;
        return true;
    case OD_LIVE_TARGET_CURRENT:
        self->target_current = value;
        return true;
#if PM_HAS(six_step)
    case OD_LIVE_TARGET_DUTY:
        self->target_duty = value;
        return true;
#endif
    default:
        return put_option_code(self, slot, value, code);
    }
}
