/* Trace: up to eight signals, sampled in the control interrupt into a ring, around a trigger. The
 * oscilloscope of the drive.
 *
 * A signal is a 32-bit number in memory, chosen by its index in the dictionary; it is kept as 16 bits: shifted
 * right by TRACE_SHIFT and limited, or of an angle, the upper half; one signal of a trace can be an angle.
 * `scale` is its value at raw 32768, in the unit of the dictionary. All signals of a sample are taken in the
 * same call.
 *
 *   trace_init(t, ring, length, context)   the ring is the caller's, `length` numbers in all
 *   trace_sample(t)    control interrupt, at its end; cost: docs/performance.md
 *   trace_put(), trace_get(), trace_read()       thread: objects 3100h to 3103h by slot (OD_LIVE_...)
 *
 * Order: set up, arm (command 1), wait for state 4, upload. While armed, settings are refused. The divider
 * counts calls per sample. `pretrigger` permille of the length lie before the trigger, at least one sample, and at
 * least one behind it. Level and edge compare successive samples of the trigger signal.
 * Tests: tests/unit/can/trace_test.cpp. */
#ifndef CAN_TRACE_H
#define CAN_TRACE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/can/dictionary.h"

#ifdef __cplusplus
extern "C" {
#endif

#define TRACE_SIGNALS 8U
#define TRACE_SHIFT   14

typedef enum {
    TRACE_OFF,
    TRACE_FILLING,   /* until there is enough before the trigger */
    TRACE_WAITING,   /* for the trigger */
    TRACE_TRIGGERED, /* until there is enough after it */
    TRACE_COMPLETE,
} trace_state_t;

typedef enum { TRACE_RISING, TRACE_FALLING, TRACE_BOTH } trace_edge_t;

typedef struct {
    const volatile int32_t *source;
    int32_t scale; /* value at raw 32768 */
    bool angle;    /* of 32 bits to the turn */
} trace_signal_t;

/* Where a dictionary entry lives; false: it cannot be traced. */
bool trace_host_find(void *context, uint16_t index, uint8_t sub, trace_signal_t *signal);

typedef struct {
    volatile uint32_t countdown; /* periods up to the next sample; 0: not armed */
    uint32_t divider;
    uint32_t count; /* signals */
    int16_t *next;  /* where the next sample goes */
    int16_t *end;   /* of what is used of the ring: whole samples */
    int16_t *ring;
    const volatile int32_t *source[TRACE_SIGNALS];
    const volatile int16_t *angle; /* the upper half of the one that is an angle; NULL: there is none */
    uint32_t angle_at;             /* its place */
    volatile trace_state_t state;
    uint32_t before_left; /* samples up to WAITING, */
    uint32_t after_left;  /* and after the trigger's, up to COMPLETE */
    int32_t trigger;      /* place of the signal */
    int32_t level;        /* raw */
    int32_t falling;      /* -1: the edge that counts is falling */
    int32_t either;       /* -1: both count */
    int32_t before;       /* the last sample: negative, the edge can come */
    int32_t forced;       /* -1: trigger as soon as there is enough before */
    uint32_t place;       /* of the trigger's sample */

    /* as set */
    uint32_t size; /* of the ring */
    void *context;
    uint32_t object[TRACE_SIGNALS]; /* index << 16 | sub << 8; 0: none */
    uint16_t set_divider, pretrigger;
    uint8_t set_trigger, set_edge; /* 0: at once, or number of the signal */
    int32_t set_level;             /* in the unit of the signal */
} trace_t;

void trace_init(trace_t *trace, int16_t ring[], uint32_t length, void *context);
void trace_record(trace_t *given);

static inline void trace_sample(trace_t *trace)
{
    const uint32_t countdown = trace->countdown;
    if (countdown != 0U) {
        if (countdown == 1U) {
            trace_record(trace);
        } else {
            trace->countdown = countdown - 1U;
        }
    }
}

/* Objects by slot. False: not one of these. `code` is an SDO abort code, 0: done. */
bool trace_get(const trace_t *trace, uint16_t slot, int32_t *value);
bool trace_put(trace_t *trace, uint16_t slot, int32_t value, uint32_t *code);

uint32_t trace_size(const trace_t *trace); /* bytes of the data; 0: there is none yet */
void trace_read(const trace_t *trace, uint32_t offset, uint8_t bytes[], uint32_t count);

#ifdef __cplusplus
}
#endif

#endif
