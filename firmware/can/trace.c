#include "firmware/can/trace.h"

#include <stddef.h>

#include "firmware/math/compiler.h"
#include "firmware/math/pair.h"

/* Shifted and limited to 16 bits. */
static inline int32_t limited(int32_t x)
{
#if defined(__ARM_FEATURE_SAT)
    int32_t r;
    __asm__("ssat %0, #16, %1, asr %2" : "=r"(r) : "r"(x), "I"(TRACE_SHIFT));
    return r;
#else
    const int32_t raw = x >> TRACE_SHIFT;
    const int32_t low = raw < -32768 ? -32768 : raw;
    return low > 32767 ? 32767 : low;
#endif
}

/* The address in a register of its own: the members are in reach of short instructions, and of LDRD. */
static inline trace_t *near(trace_t *trace)
{
    trace_t *base = trace;
#if PM_HAS_DSP
    __asm__("" : "+r"(base));
#endif
    return base;
}

static inline void put(const trace_t *trace, int16_t *sample, uint32_t n)
{
    sample[n] = (int16_t)limited(*trace->source[n]);
}

/* n and the next: two sources come with one load. */
static inline void put_two(const trace_t *trace, int16_t *sample, uint32_t n)
{
    const volatile int32_t *first = trace->source[n];
    const volatile int32_t *second = trace->source[n + 1U];
    sample[n] = (int16_t)limited(*first);
    sample[n + 1U] = (int16_t)limited(*second);
}

static inline void put_four(const trace_t *trace, int16_t *sample, uint32_t n)
{
    put_two(trace, sample, n + 2U);
    put_two(trace, sample, n);
}

/* Straight-line code for each number of signals. */
static inline void take(const trace_t *trace, int16_t *sample, uint32_t count)
{
    switch (count) {
    case 8:
        put_four(trace, sample, 4);
        put_four(trace, sample, 0);
        break;
    case 7:
        put(trace, sample, 6);
        put_two(trace, sample, 4);
        put_four(trace, sample, 0);
        break;
    case 6:
        put_two(trace, sample, 4);
        put_four(trace, sample, 0);
        break;
    case 5:
        put(trace, sample, 4);
        put_four(trace, sample, 0);
        break;
    case 4:
        put_four(trace, sample, 0);
        break;
    case 3:
        put(trace, sample, 2);
        put_two(trace, sample, 0);
        break;
    case 2:
        put_two(trace, sample, 0);
        break;
    case 1:
        put(trace, sample, 0);
        break;
    default:
        pm_assume(false);
        break;
    }
    const volatile int16_t *angle = trace->angle;
    const uint32_t angle_at = trace->angle_at;
    if (angle != NULL) {
        sample[angle_at] = *angle;
    }
}

/* The trigger signal against the level: negative when the edge has come, between the last sample and this one. */
static inline int32_t edge(trace_t *trace, const int16_t *sample, int32_t before)
{
    const pm_pair_t at = pm_pair(&trace->trigger, &trace->level);
    const pm_pair_t edges = pm_pair(&trace->falling, &trace->either);
    const int32_t now = (sample[at.first] - at.second) ^ edges.first;
    trace->before = now;
    return (before ^ now) & (before | edges.second);
}

/* Up to enough samples before the trigger; an edge may lie between the last of them and the next. */
static inline void fill(trace_t *trace, const int16_t *sample)
{
    trace->before_left--;
    if (pm_rarely(trace->before_left == 0U)) {
        (void)edge(trace, sample, 0);
        trace->state = TRACE_WAITING;
    }
}

static inline void await(trace_t *trace, const int16_t *sample)
{
    const pm_pair_t last = pm_pair(&trace->before, &trace->forced);
    if ((edge(trace, sample, last.first) | last.second) < 0) {
        trace->state = TRACE_TRIGGERED;
    }
}

static inline void finish(trace_t *trace)
{
    trace->after_left--;
    if (pm_rarely(trace->after_left == 0U)) {
        trace->countdown = 0;
        trace->state = TRACE_COMPLETE;
    }
}

void trace_record(trace_t *given)
{
    trace_t *trace = near(given);
    const uint32_t divider = trace->divider;
    const uint32_t count = trace->count;
    int16_t *sample = trace->next;
    trace->countdown = divider;
    take(trace, sample, count);
    int16_t *next = &sample[count];
    trace->next = next == trace->end ? trace->ring : next;
    const trace_state_t state = trace->state;
    if (state == TRACE_WAITING) {
        await(trace, sample);
    } else if (state == TRACE_FILLING) {
        fill(trace, sample);
    } else {
        finish(trace);
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
