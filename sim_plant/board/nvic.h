/* The interrupt controller of ARMv7-M: which exceptions are pending, active and enabled, their priorities,
 * and which one is taken next. ARMv7-M ARM B1.5.4 and B3.4. No processor in here: system_block.c gives it its
 * registers, exceptions.c acts on what it says. Tests: tests/unit/board/cpu_nvic_test.cpp. */
#ifndef BOARD_NVIC_H
#define BOARD_NVIC_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
    EXCEPTION_RESET = 1,
    EXCEPTION_NMI = 2,
    EXCEPTION_HARD_FAULT = 3,
    EXCEPTION_MEM_MANAGE = 4,
    EXCEPTION_BUS_FAULT = 5,
    EXCEPTION_USAGE_FAULT = 6,
    EXCEPTION_SVC = 11,
    EXCEPTION_DEBUG = 12,
    EXCEPTION_PENDSV = 14,
    EXCEPTION_SYSTICK = 15,
    EXCEPTION_IRQ0 = 16,
    NVIC_EXCEPTIONS = 128,
    NVIC_LINES = NVIC_EXCEPTIONS - EXCEPTION_IRQ0,
};

#define NVIC_IDLE 256 /* execution priority when nothing is active and nothing masked */

typedef struct {
    uint64_t pending[2], active[2], enabled[2], level[2]; /* bit per exception number */
    int16_t priority[NVIC_EXCEPTIONS];                    /* -3 to 255, the lower the more urgent */
    uint64_t pended_at[NVIC_EXCEPTIONS];
    unsigned priority_group; /* PRIGROUP */
    int active_priority;     /* of the active exceptions, grouped; NVIC_IDLE: none */
    int candidate;           /* the pending and enabled exception of best priority; 0: none */
    unsigned active_count;
} nvic_t;

/* What the processor's mask registers hold. */
typedef struct {
    bool primask, faultmask;
    uint8_t basepri;
} nvic_masks_t;

void nvic_reset(nvic_t *nvic); /* lines keep their level */

/* `now` is remembered for the latency. Pending what is pending already changes nothing. */
void nvic_pend(nvic_t *nvic, int exception, uint64_t now);
void nvic_unpend(nvic_t *nvic, int exception);
void nvic_set_level(nvic_t *nvic, int exception, bool high, uint64_t now);
void nvic_enable(nvic_t *nvic, int exception, bool enabled);
void nvic_set_priority(nvic_t *nvic, int exception, uint8_t priority); /* keeps the four bits that exist */
void nvic_set_group(nvic_t *nvic, unsigned priority_group);

bool nvic_pending(const nvic_t *nvic, int exception);
bool nvic_active(const nvic_t *nvic, int exception);
bool nvic_enabled(const nvic_t *nvic, int exception);

/* Entry and return. */
void nvic_activate(nvic_t *nvic, int exception);
void nvic_deactivate(nvic_t *nvic, int exception, uint64_t now);

int nvic_group_priority(const nvic_t *nvic, int exception);
int nvic_execution_priority(const nvic_t *nvic, const nvic_masks_t *masks);

/* The exception to take at that execution priority; 0: none. */
int nvic_next(const nvic_t *nvic, int execution_priority);

#ifdef __cplusplus
}
#endif

#endif
