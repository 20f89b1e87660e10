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

static void change(trace_t *trace, trace_state_t state, uint32_t samples)
{
    trace->state = state;
    trace->left = samples;
}

static bool triggers(const trace_t *trace, bool crossed)
{
    const trace_edge_t edge = trace->side < 0 ? TRACE_FALLING : TRACE_RISING;
    return trace->forced || (crossed && (trace->edge == TRACE_BOTH || trace->edge == edge));
}

/* The sample just taken is the first that the trigger saw, has crossed the level, or ends a time. */
static __attribute__((noinline)) void advance(trace_t *trace, int32_t side)
{
    const bool crossed = (side ^ trace->side) < 0;
    trace->side = side;
    trace->poked = false;
    if (trace->state == TRACE_FILLING && trace->left == 0U) {
        change(trace, trace->forced ? TRACE_TRIGGERED : TRACE_WAITING, trace->after);
    } else if (trace->state == TRACE_WAITING) {
        change(trace, triggers(trace, crossed) ? TRACE_TRIGGERED : TRACE_WAITING, trace->after - 1U);
    } else {
        /* goes on */
    }
    if (trace->state == TRACE_TRIGGERED && trace->left == 0U) {
        trace->countdown = 0;
        trace->state = TRACE_COMPLETE;
    }
}

void trace_record(trace_t *trace)
{
    trace->countdown = trace->divider;
    const trace_channel_t *channel = trace->channel;
    const int16_t *sample = trace->next;
    int16_t *to = trace->next;
    const int16_t *end = &to[trace->count];
    do {
        *to = (int16_t)limited(*channel->source >> channel->shift);
        channel++;
        to++;
    } while (to != end);
    trace->next = to == trace->end ? trace->ring : to;
    const int32_t side = sample[trace->trigger] - trace->level;
    trace->left--;
    if (trace->left == 0U || (side ^ trace->side) < 0 || trace->poked) {
        advance(trace, side);
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
