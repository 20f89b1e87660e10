#include "firmware/can/trace.h"

#include <stddef.h>

static int32_t limited(int32_t x)
{
    const int32_t low = x < -32768 ? -32768 : x;
    return low > 32767 ? 32767 : low;
}

static bool triggers(const trace_t *trace, int32_t now)
{
    const bool rises = trace->previous < trace->level && now >= trace->level;
    const bool falls = trace->previous >= trace->level && now < trace->level;
    switch (trace->edge) {
    case TRACE_RISING:
        return rises;
    case TRACE_FALLING:
        return falls;
    case TRACE_BOTH:
    default:
        return rises || falls;
    }
}

static void change(trace_t *trace, trace_state_t state, uint32_t samples)
{
    trace->state = state;
    trace->left = samples;
}

/* The sample just taken is the first that the trigger saw. */
static void wait(trace_t *trace, int32_t now)
{
    if (trace->trigger == TRACE_SIGNALS || trace->forced || triggers(trace, now)) {
        change(trace, TRACE_TRIGGERED, trace->after - 1U);
    }
}

static void advance(trace_t *trace, int32_t now)
{
    switch (trace->state) {
    case TRACE_FILLING:
        trace->left--;
        if (trace->left == 0U) {
            change(trace, TRACE_WAITING, 0);
        }
        break;
    case TRACE_WAITING:
        wait(trace, now);
        break;
    case TRACE_TRIGGERED:
        trace->left--;
        break;
    case TRACE_OFF:
    case TRACE_COMPLETE:
    default:
        break;
    }
    if (trace->state == TRACE_TRIGGERED && trace->left == 0U) {
        trace->active = 0;
        trace->state = TRACE_COMPLETE;
    }
}

void trace_record(trace_t *trace)
{
    trace->countdown--;
    if (trace->countdown != 0U) {
        return;
    }
    trace->countdown = trace->divider;
    int16_t *to = &trace->ring[trace->next];
    const trace_signal_t *end = &trace->signal[trace->count];
    for (const trace_signal_t *signal = trace->signal; signal < end; signal++) {
        *to = (int16_t)limited(*signal->source >> signal->shift);
        to++;
    }
    const int32_t now = trace->trigger < TRACE_SIGNALS ? trace->ring[trace->next + trace->trigger] : 0;
    trace->next += trace->count;
    if (trace->next == trace->end) {
        trace->next = 0;
    }
    advance(trace, now);
    trace->previous = now;
}

uint32_t trace_size(const trace_t *trace)
{
    return trace->state == TRACE_COMPLETE ? trace->end * 2U : 0U;
}

/* The oldest sample is where the next would go. */
void trace_read(const trace_t *trace, uint32_t offset, uint8_t bytes[], uint32_t count)
{
    for (uint32_t n = 0; n < count; n++) {
        const uint32_t place = (trace->next + (offset + n) / 2U) % trace->end;
        const uint32_t number = (uint32_t)trace->ring[place];
        bytes[n] = (uint8_t)(((offset + n) % 2U == 0U ? number : number >> 8) & 0xFFU);
    }
}
