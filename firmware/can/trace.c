#include "firmware/can/trace.h"

#include <stddef.h>

static inline int32_t limited(int32_t x)
{
#if defined(__ARM_FEATURE_SAT)
    int32_t r;
    __asm__("ssat %0, #16, %1" : "=r"(r) : "r"(x));
    return r;
#else
    const int32_t low = x < -32768 ? -32768 : x;
    return low > 32767 ? 32767 : low;
#endif
}

static inline void put(const trace_t *trace, int16_t *sample, uint32_t n)
{
    const trace_channel_t *channel = &trace->channel[n];
    sample[n] = (int16_t)limited(*channel->source >> channel->shift);
}

/* Straight, as deep as there are signals. */
static inline void take(const trace_t *trace, int16_t *sample)
{
    switch (trace->count) {
    case 8:
        put(trace, sample, 7);
        __attribute__((fallthrough));
    case 7:
        put(trace, sample, 6);
        __attribute__((fallthrough));
    case 6:
        put(trace, sample, 5);
        __attribute__((fallthrough));
    case 5:
        put(trace, sample, 4);
        __attribute__((fallthrough));
    case 4:
        put(trace, sample, 3);
        __attribute__((fallthrough));
    case 3:
        put(trace, sample, 2);
        __attribute__((fallthrough));
    case 2:
        put(trace, sample, 1);
        __attribute__((fallthrough));
    case 1:
        put(trace, sample, 0);
        break;
    default:
        __builtin_unreachable();
    }
}

static int32_t side_of(const trace_t *trace, const int16_t *sample)
{
    return sample[trace->trigger] - trace->level;
}

/* There is enough before the trigger, or after it. */
static __attribute__((noinline)) void advance(trace_t *trace, const int16_t *sample)
{
    if (trace->state == TRACE_TRIGGERED) {
        trace->countdown = 0;
        trace->state = TRACE_COMPLETE;
    } else {
        trace->left = trace->after;
        trace->side = side_of(trace, sample);
        trace->state = trace->forced ? TRACE_TRIGGERED : TRACE_WAITING;
    }
}

/* The level was crossed, or the thread wants something. */
static inline bool triggers(trace_t *trace, int32_t side)
{
    trace->side = side;
    return trace->edge == TRACE_BOTH || (trace->edge == TRACE_FALLING) == (side < 0) || trace->forced;
}

void trace_record(trace_t *trace)
{
    int16_t *sample = trace->next;
    trace->countdown = trace->divider;
    take(trace, sample);
    int16_t *next = &sample[trace->count];
    trace->next = next == trace->end ? trace->ring : next;
    if (trace->state == TRACE_WAITING) {
        const int32_t side = side_of(trace, sample);
        if (((side ^ trace->side) >= 0 && !trace->poked) || !triggers(trace, side)) {
            return;
        }
        trace->state = TRACE_TRIGGERED;
    }
    trace->left--;
    if (trace->left == 0U) {
        advance(trace, sample);
    }
}

static uint32_t numbers(const trace_t *trace)
{
    return (uint32_t)(trace->end - trace->ring);
}

uint32_t trace_size(const trace_t *trace)
{
    return trace->state == TRACE_COMPLETE ? numbers(trace) * 2U : 0U;
}

/* The oldest sample is where the next would go. */
void trace_read(const trace_t *trace, uint32_t offset, uint8_t bytes[], uint32_t count)
{
    const uint32_t oldest = (uint32_t)(trace->next - trace->ring);
    for (uint32_t n = 0; n < count; n++) {
        const uint32_t place = (oldest + (offset + n) / 2U) % numbers(trace);
        const uint32_t number = (uint32_t)trace->ring[place];
        bytes[n] = (uint8_t)(((offset + n) % 2U == 0U ? number : number >> 8) & 0xFFU);
    }
}
