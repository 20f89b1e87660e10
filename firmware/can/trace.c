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

/* Straight-line code, entered at the number of signals. */
static inline void take(const trace_t *trace, int16_t *sample)
{
    switch (trace->count % TRACE_SIGNALS) {
    case 0:
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
    default:
        put(trace, sample, 0);
        break;
    }
}

/* Not negative: the trigger signal has reached the level. */
static inline int32_t above(const trace_t *trace, const int16_t *sample)
{
    return sample[trace->trigger] - trace->level;
}

/* Enough samples before the trigger, or after it. */
static inline void advance(trace_t *trace, const int16_t *sample)
{
    if (trace->state == TRACE_TRIGGERED) {
        trace->countdown = 0;
        trace->state = TRACE_COMPLETE;
        return;
    }
    const int32_t now = above(trace, sample);
    if (trace->edge == TRACE_BOTH) { /* the one that can come next */
        trace->falling = now < 0 ? 0 : -1;
    }
    trace->before = now ^ trace->falling;
    trace->left = trace->after;
    trace->state = TRACE_WAITING;
}

void trace_record(trace_t *trace)
{
    int16_t *sample = trace->next;
    trace->countdown = trace->divider;
    take(trace, sample);
    int16_t *next = &sample[trace->count];
    trace->next = next == trace->end ? trace->ring : next;
    if (trace->state == TRACE_WAITING) {
        const int32_t now = above(trace, sample) ^ trace->falling;
        const int32_t passed = trace->before & ~now;
        trace->before = now;
        if (passed >= 0 && !trace->forced) {
            return;
        }
        trace->state = TRACE_TRIGGERED;
    }
    trace->left--;
    if (__builtin_expect(trace->left == 0U, 0) != 0) {
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
