#include "firmware/can/cia402.h"

/* Controlword */
#define SWITCH_ON      0x0001U
#define ENABLE_VOLTAGE 0x0002U
#define NO_QUICK_STOP  0x0004U
#define ENABLE         0x0008U
#define COMMAND        (SWITCH_ON | ENABLE_VOLTAGE | NO_QUICK_STOP | ENABLE)
#define FAULT_RESET    0x0080U
#define HALT           0x0100U

/* Statusword */
#define STATUS_VOLTAGE   0x0010U
#define STATUS_WARNING   0x0080U
#define STATUS_REMOTE    0x0200U
#define STATUS_REACHED   0x0400U
#define STATUS_LIMITED   0x0800U
#define STATUS_STILL     0x1000U
#define STATUS_FOLLOWING 0x4000U

enum { OPTION_COAST = 0, OPTION_RAMP = 1, OPTION_RAMP_AND_STAY = 5 };

void cia402_init(cia402_t *self)
{
    *self = (cia402_t){.state = CIA402_NOT_READY,
                       .coast = true,
                       .mode = CIA402_MODE_VELOCITY,
                       .active_mode = CIA402_MODE_VELOCITY,
                       .quick_stop_option = OPTION_RAMP,
                       .shutdown_option = OPTION_COAST,
                       .disable_option = OPTION_RAMP,
                       .window = 1000,
                       .threshold = 1000};
}

bool cia402_on(const cia402_t *self)
{
    return self->state == CIA402_OPERATION_ENABLED || self->state == CIA402_QUICK_STOP_ACTIVE;
}

static void switch_off(cia402_t *self, cia402_state_t next, int16_t option)
{
    self->state = next;
    self->coast = option == OPTION_COAST;
}

void cia402_abandon(cia402_t *self)
{
    self->controlword = ENABLE_VOLTAGE; /* a quick stop, which ends in the state that is entered here */
    switch_off(self, CIA402_SWITCH_ON_DISABLED, OPTION_RAMP);
}

static void enable(cia402_t *self)
{
    if (self->mode != CIA402_MODE_NONE) {
        self->state = CIA402_OPERATION_ENABLED;
        self->active_mode = self->mode;
    }
}

/* Operation is enabled, or a quick stop is in progress, and the bridge must stay on. */
static void obey_running(cia402_t *self, uint16_t command)
{
    const bool stopping = self->state == CIA402_QUICK_STOP_ACTIVE;
    if ((command & NO_QUICK_STOP) == 0U) {
        if (!stopping && self->quick_stop_option == OPTION_COAST) {
            switch_off(self, CIA402_SWITCH_ON_DISABLED, OPTION_COAST);
        } else {
            self->state = CIA402_QUICK_STOP_ACTIVE;
        }
    } else if (stopping) {
        if (command == COMMAND && self->quick_stop_option == OPTION_RAMP_AND_STAY) {
            self->state = CIA402_OPERATION_ENABLED;
        }
    } else if ((command & SWITCH_ON) == 0U) {
        switch_off(self, CIA402_READY_TO_SWITCH_ON, self->shutdown_option);
    } else if ((command & ENABLE) == 0U) {
        switch_off(self, CIA402_SWITCHED_ON, self->disable_option);
    } else {
        /* goes on */
    }
}

static void obey_resting(cia402_t *self, uint16_t command, bool ready)
{
    const bool shutdown = (command & (SWITCH_ON | NO_QUICK_STOP)) == NO_QUICK_STOP;
    if ((command & NO_QUICK_STOP) == 0U || !ready) {
        self->state = CIA402_SWITCH_ON_DISABLED;
    } else if (shutdown) {
        self->state = CIA402_READY_TO_SWITCH_ON;
    } else if (self->state == CIA402_SWITCH_ON_DISABLED) {
        /* by way of shutdown alone */
    } else if ((command & ENABLE) == 0U) {
        self->state = CIA402_SWITCHED_ON;
    } else {
        enable(self); /* from ready to switch on too: both steps at once */
    }
}

static void obey(cia402_t *self, const cia402_in_t *in)
{
    const uint16_t command = self->controlword & (uint16_t)COMMAND;
    if (self->state == CIA402_NOT_READY) {
        self->state = CIA402_SWITCH_ON_DISABLED;
    } else if ((command & ENABLE_VOLTAGE) == 0U) {
        switch_off(self, CIA402_SWITCH_ON_DISABLED, OPTION_COAST);
    } else if (cia402_on(self)) {
        obey_running(self, command);
    } else {
        obey_resting(self, command, in->ready);
    }
    if (self->state == CIA402_QUICK_STOP_ACTIVE && in->off &&
        self->quick_stop_option != OPTION_RAMP_AND_STAY) {
        switch_off(self, CIA402_SWITCH_ON_DISABLED, OPTION_RAMP);
    }
}

/* True when the fault is to be cleared now. */
static bool obey_fault(cia402_t *self, const cia402_in_t *in, bool edge)
{
    if (in->fault) {
        self->state = in->off ? CIA402_FAULT : CIA402_FAULT_REACTION_ACTIVE;
        self->clearing = edge && in->off;
        return self->clearing;
    }
    if (self->clearing || edge) { /* whose cause has gone */
        self->state = CIA402_SWITCH_ON_DISABLED;
        self->clearing = false;
    }
    return false;
}

static void give_targets(const cia402_t *self, cia402_out_t *out)
{
    const bool halted = (self->controlword & HALT) != 0U || self->state == CIA402_QUICK_STOP_ACTIVE;
    out->mode = (int8_t)self->active_mode;
    if (!halted) {
        out->velocity = self->active_mode == CIA402_MODE_TORQUE ? 0 : self->target_velocity;
        out->torque = self->active_mode == CIA402_MODE_TORQUE ? self->target_torque : 0;
#if PM_HAS(six_step)
        out->duty = self->active_mode == CIA402_MODE_DUTY ? self->target_duty : 0;
#endif
    }
    out->current = self->active_mode < CIA402_MODE_NONE ? self->target_current : 0;
}

cia402_out_t cia402_step(cia402_t *self, const cia402_in_t *in)
{
    cia402_out_t out = {.mode = CIA402_MODE_NONE};
    const bool edge = (self->controlword & FAULT_RESET) != 0U && (self->seen & FAULT_RESET) == 0U;
    const bool faulty = self->state == CIA402_FAULT || self->state == CIA402_FAULT_REACTION_ACTIVE;
    self->seen = self->controlword;
    if (in->fault || faulty) {
        self->coast = true;
        out.clear_fault = obey_fault(self, in, edge);
    } else {
        obey(self, in);
    }
    if (!cia402_on(self)) {
        self->active_mode = self->mode;
    }
    /* after a quick stop option without staying, the drive stops by itself */
    out.enable = self->state == CIA402_OPERATION_ENABLED ||
                 (self->state == CIA402_QUICK_STOP_ACTIVE && self->quick_stop_option == OPTION_RAMP_AND_STAY);
    out.coast = !out.enable && self->state != CIA402_QUICK_STOP_ACTIVE && self->coast;
    give_targets(self, &out);
    return out;
}

static bool within(int32_t value, int32_t of, uint16_t distance)
{
    const int64_t difference = (int64_t)value - of;
    return difference <= (int64_t)distance && difference >= -(int64_t)distance;
}

static bool reached(const cia402_t *self, const cia402_in_t *in)
{
    if ((self->controlword & HALT) != 0U || self->state == CIA402_QUICK_STOP_ACTIVE) {
        return within(in->velocity, 0, self->threshold);
    }
    if (self->active_mode == CIA402_MODE_VELOCITY) {
        return in->following && within(in->velocity, self->target_velocity, self->window);
    }
    return in->following && !in->limited;
}

uint16_t cia402_statusword(const cia402_t *self, const cia402_in_t *in)
{
    static const uint8_t of_state[CIA402_FAULT + 1] = {
        [CIA402_NOT_READY] = 0x00,
        [CIA402_SWITCH_ON_DISABLED] = 0x40,
        [CIA402_READY_TO_SWITCH_ON] = 0x21,
        [CIA402_SWITCHED_ON] = 0x23,
        [CIA402_OPERATION_ENABLED] = 0x27,
        [CIA402_QUICK_STOP_ACTIVE] = 0x07,
        [CIA402_FAULT_REACTION_ACTIVE] = 0x0F,
        [CIA402_FAULT] = 0x08,
    };
    uint32_t word = (uint32_t)of_state[self->state] | STATUS_REMOTE;
    word |= in->voltage ? STATUS_VOLTAGE : 0U;
    word |= in->warning ? STATUS_WARNING : 0U;
    word |= in->limited ? STATUS_LIMITED : 0U;
    word |= in->following ? STATUS_FOLLOWING : 0U;
    if (cia402_on(self)) {
        const bool still =
            self->active_mode == CIA402_MODE_VELOCITY && within(in->velocity, 0, self->threshold);
        word |= reached(self, in) ? STATUS_REACHED : 0U;
        word |= still ? STATUS_STILL : 0U;
    }
    return (uint16_t)word;
}
