/* Settings and results of the trace. */
#include <stddef.h>

#include "firmware/can/dictionary_slots.h"
#include "firmware/can/trace.h"

#define OK           0U
#define NOT_MAPPABLE 0x06040041U
#define INCOMPATIBLE 0x06040043U
#define STATE        0x08000022U

/* Samples: one before the trigger, for an edge, the trigger's and one after it. */
#define LEAST 3U

enum { COMMAND_OFF, COMMAND_ARM, COMMAND_TRIGGER };

void trace_init(trace_t *trace, int16_t ring[], uint32_t length, void *context)
{
    *trace = (trace_t){
        .state = TRACE_OFF,
        .size = length,
        .context = context,
        .set_divider = 1,
        .pretrigger = 100,
    };
    trace->ring = ring;
}

static bool find(const trace_t *trace, uint32_t object, trace_signal_t *signal)
{
    return trace_host_find(trace->context, (uint16_t)(object >> 16), (uint8_t)((object >> 8) & 0xFFU),
                           signal);
}

static uint32_t length_of(const trace_t *trace)
{
    return trace->count == 0U ? 0U : trace->size / trace->count;
}

static uint32_t size_of(int32_t x)
{
    return x < 0 ? 0U - (uint32_t)x : (uint32_t)x;
}

/* Level from the unit of the signal to raw, bit by bit: a value out of range is never crossed. */
static int32_t raw_level(const trace_t *trace, const trace_signal_t *signal)
{
    const uint32_t scale = signal->scale == 0 ? 1U : size_of(signal->scale);
    const bool positive = (trace->set_level < 0) == (signal->scale < 0);
    const uint32_t level = size_of(trace->set_level);
    if (level / scale > 1U) {
        return positive ? 32768 : -32769;
    }
    uint32_t raw = level / scale;
    uint32_t rest = level % scale;
    for (uint32_t n = 0; n < 15U; n++) {
        rest *= 2U;
        raw = 2U * raw + (rest >= scale ? 1U : 0U);
        rest -= rest >= scale ? scale : 0U;
    }
    if (positive) {
        return raw > 32767U ? 32768 : (int32_t)raw;
    }
    return raw > 32768U ? -32769 : -(int32_t)raw;
}

static uint32_t set_trigger(trace_t *trace)
{
    trace->trigger = 0;
    trace->level = 0;
    trace->forced = trace->set_trigger == 0U ? -1 : 0;
    if (trace->set_trigger == 0U) {
        return OK;
    }
    /* signals that are not set are left out of the samples */
    uint32_t place = 0;
    for (uint32_t n = 0; n + 1U < trace->set_trigger; n++) {
        place += trace->object[n] != 0U ? 1U : 0U;
    }
    if (trace->object[trace->set_trigger - 1U] == 0U) {
        return INCOMPATIBLE;
    }
    trace->trigger = (int32_t)place;
    trace_signal_t signal = {.scale = 0};
    (void)find(trace, trace->object[trace->set_trigger - 1U], &signal);
    trace->level = raw_level(trace, &signal);
    return OK;
}

/* Sources of the signals that are set. */
static uint32_t gather(trace_t *trace)
{
    trace->count = 0;
    trace->angle = NULL;
    for (uint32_t n = 0; n < TRACE_SIGNALS; n++) {
        trace_signal_t signal;
        if (trace->object[n] != 0U) {
            if (!find(trace, trace->object[n], &signal)) {
                return NOT_MAPPABLE;
            }
            if (signal.angle && trace->angle != NULL) {
                return INCOMPATIBLE;
            }
            if (signal.angle) {
                trace->angle = &((const volatile int16_t *)signal.source)[1]; /* little-endian */
                trace->angle_at = trace->count;
            }
            trace->source[trace->count] = signal.source;
            trace->count++;
        }
    }
    return OK;
}

static uint32_t arm(trace_t *trace)
{
    trace->countdown = 0;
    trace->state = TRACE_OFF;
    const uint32_t code = gather(trace);
    if (code != OK) {
        return code;
    }
    const uint32_t length = length_of(trace);
    if (length < LEAST || set_trigger(trace) != OK) {
        return INCOMPATIBLE;
    }
    uint32_t before = (length * trace->pretrigger) / 1000U;
    before = before > length - 2U ? length - 2U : before;
    before = before == 0U ? 1U : before;
    trace->before_left = before;
    trace->after_left = length - before - 1U;
    trace->place = before;
    trace->end = &trace->ring[length * trace->count];
    trace->next = trace->ring;
    trace->falling = trace->set_edge == (uint8_t)TRACE_FALLING ? -1 : 0;
    trace->either = trace->set_edge == (uint8_t)TRACE_BOTH ? -1 : 0;
    trace->divider = trace->set_divider;
    trace->state = TRACE_FILLING;
    __atomic_signal_fence(__ATOMIC_RELEASE); /* the interrupt reads this alone, so it is written last */
    trace->countdown = 1;
    return OK;
}

static uint32_t command(trace_t *trace, int32_t value)
{
    switch (value) {
    case COMMAND_OFF:
        trace->countdown = 0;
        trace->state = TRACE_OFF;
        return OK;
    case COMMAND_ARM:
        return arm(trace);
    case COMMAND_TRIGGER:
    default:
        if (trace->countdown == 0U) {
            return STATE;
        }
        trace->forced = -1;
        return OK;
    }
}

static uint32_t put_signal(trace_t *trace, uint32_t number, uint32_t object)
{
    trace_signal_t signal;
    if (object != 0U && !find(trace, object, &signal)) {
        return NOT_MAPPABLE;
    }
    trace->object[number] = object;
    return OK;
}

static bool is_setting(uint16_t slot)
{
    return (slot >= (uint16_t)OD_LIVE_TRACE_DIVIDER && slot <= (uint16_t)OD_LIVE_TRACE_LEVEL) ||
           (slot >= (uint16_t)OD_LIVE_TRACE_SIGNAL_1 && slot <= (uint16_t)OD_LIVE_TRACE_SIGNAL_8);
}

static void put_setting(trace_t *trace, uint16_t slot, int32_t value, uint32_t *code)
{
    switch (slot) {
    case OD_LIVE_TRACE_DIVIDER:
        trace->set_divider = (uint16_t)((uint32_t)value & 0xFFFFU);
        break;
    case OD_LIVE_TRACE_PRETRIGGER:
        trace->pretrigger = (uint16_t)((uint32_t)value & 0xFFFFU);
        break;
    case OD_LIVE_TRACE_TRIGGER:
        trace->set_trigger = (uint8_t)((uint32_t)value & 0xFFU);
        break;
    case OD_LIVE_TRACE_EDGE:
        trace->set_edge = (uint8_t)((uint32_t)value & 0xFFU);
        break;
    case OD_LIVE_TRACE_LEVEL:
        trace->set_level = value;
        break;
    default:
        *code = put_signal(trace, (uint32_t)slot - (uint32_t)OD_LIVE_TRACE_SIGNAL_1, (uint32_t)value);
        break;
    }
}

bool trace_put(trace_t *trace, uint16_t slot, int32_t value, uint32_t *code)
{
    *code = OK;
    if (slot == (uint16_t)OD_LIVE_TRACE_COMMAND) {
        *code = command(trace, value);
        return true;
    }
    if (!is_setting(slot)) {
        return false;
    }
    if (trace->countdown != 0U) {
        *code = STATE;
    } else {
        trace->state = TRACE_OFF; /* the data are of other settings */
        put_setting(trace, slot, value, code);
    }
    return true;
}

static int32_t scale_of(const trace_t *trace, uint32_t number)
{
    trace_signal_t signal = {.scale = 0};
    const uint32_t object = trace->object[number];
    if (object != 0U) {
        (void)find(trace, object, &signal);
    }
    return signal.scale;
}

static int32_t get_list(const trace_t *trace, uint16_t slot)
{
    if (slot >= (uint16_t)OD_LIVE_TRACE_SCALE_1) {
        return scale_of(trace, (uint32_t)slot - (uint32_t)OD_LIVE_TRACE_SCALE_1);
    }
    return (int32_t)trace->object[(uint32_t)slot - (uint32_t)OD_LIVE_TRACE_SIGNAL_1];
}

bool trace_get(const trace_t *trace, uint16_t slot, int32_t *value)
{
    switch (slot) {
    case OD_LIVE_TRACE_COMMAND:
        *value = trace->countdown != 0U ? COMMAND_ARM : COMMAND_OFF;
        return true;
    case OD_LIVE_TRACE_STATE:
        *value = (int32_t)trace->state;
        return true;
    case OD_LIVE_TRACE_DIVIDER:
        *value = trace->set_divider;
        return true;
    case OD_LIVE_TRACE_PRETRIGGER:
        *value = trace->pretrigger;
        return true;
    case OD_LIVE_TRACE_TRIGGER:
        *value = trace->set_trigger;
        return true;
    case OD_LIVE_TRACE_EDGE:
        *value = trace->set_edge;
        return true;
    case OD_LIVE_TRACE_LEVEL:
        *value = trace->set_level;
        return true;
    case OD_LIVE_TRACE_LENGTH:
        *value = (int32_t)length_of(trace);
        return true;
    case OD_LIVE_TRACE_AT:
        *value = trace->state == TRACE_COMPLETE ? (int32_t)trace->place : 0;
        return true;
    default:
        if (slot >= (uint16_t)OD_LIVE_TRACE_SIGNAL_1 && slot <= (uint16_t)OD_LIVE_TRACE_SCALE_8) {
            *value = get_list(trace, slot);
            return true;
        }
        return false;
    }
}
