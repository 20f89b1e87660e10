#include "sim_plant/board/nvic.h"

#include <string.h>

#define PRIORITY_BITS 0xF0U

static uint64_t bit_of(int exception)
{
    return UINT64_C(1) << (exception & 63);
}

static bool has(const uint64_t set[2], int exception)
{
    return (set[exception >> 6] & bit_of(exception)) != 0;
}

static void put(uint64_t set[2], int exception, bool on)
{
    const uint64_t bit = bit_of(exception);
    set[exception >> 6] = on ? set[exception >> 6] | bit : set[exception >> 6] & ~bit;
}

/* The priority without its sub-priority bits; the fixed negative ones have none. */
static int grouped(const nvic_t *nvic, int priority)
{
    const int group = 2 << nvic->priority_group;
    return priority < 0 ? priority : priority - priority % group;
}

/* Among equals the lowest number comes first, so only a smaller priority value replaces. */
static int most_urgent(const nvic_t *nvic, const uint64_t set[2])
{
    int best = 0;
    for (int half = 0; half < 2; half++) {
        for (uint64_t left = set[half]; left != 0; left &= left - 1) {
            const int exception = half * 64 + __builtin_ctzll(left);
            if (best == 0 || nvic->priority[exception] < nvic->priority[best]) {
                best = exception;
            }
        }
    }
    return best;
}

static void update(nvic_t *nvic)
{
    const uint64_t ready[2] = {nvic->pending[0] & nvic->enabled[0], nvic->pending[1] & nvic->enabled[1]};
    nvic->candidate = most_urgent(nvic, ready);
    const int active = most_urgent(nvic, nvic->active);
    nvic->active_priority = active == 0 ? NVIC_IDLE : grouped(nvic, nvic->priority[active]);
}

void nvic_reset(nvic_t *nvic)
{
    const uint64_t level[2] = {nvic->level[0], nvic->level[1]};
    memset(nvic, 0, sizeof *nvic);
    nvic->priority[EXCEPTION_RESET] = -3;
    nvic->priority[EXCEPTION_NMI] = -2;
    nvic->priority[EXCEPTION_HARD_FAULT] = -1;
    static const int always[] = {EXCEPTION_NMI, EXCEPTION_HARD_FAULT, EXCEPTION_SVC, EXCEPTION_PENDSV,
                                 EXCEPTION_SYSTICK};
    for (unsigned i = 0; i < sizeof always / sizeof always[0]; i++) {
        put(nvic->enabled, always[i], true);
    }
    for (int half = 0; half < 2; half++) {
        nvic->level[half] = level[half];
        nvic->pending[half] = level[half];
    }
    update(nvic);
}

void nvic_pend(nvic_t *nvic, int exception, uint64_t now)
{
    if (!has(nvic->pending, exception)) {
        put(nvic->pending, exception, true);
        nvic->pended_at[exception] = now;
        update(nvic);
    }
}

void nvic_unpend(nvic_t *nvic, int exception)
{
    /* A line that is high pends again at once. */
    if (!has(nvic->level, exception) || has(nvic->active, exception)) {
        put(nvic->pending, exception, false);
        update(nvic);
    }
}

void nvic_set_level(nvic_t *nvic, int exception, bool high, uint64_t now)
{
    if (high != has(nvic->level, exception)) {
        put(nvic->level, exception, high);
        if (high) {
            nvic_pend(nvic, exception, now);
        }
    }
}

void nvic_enable(nvic_t *nvic, int exception, bool enabled)
{
    put(nvic->enabled, exception, enabled);
    update(nvic);
}

void nvic_set_priority(nvic_t *nvic, int exception, uint8_t priority)
{
    nvic->priority[exception] = (int16_t)(priority & PRIORITY_BITS);
    update(nvic);
}

void nvic_set_group(nvic_t *nvic, unsigned priority_group)
{
    nvic->priority_group = priority_group & 7U;
    update(nvic);
}

bool nvic_pending(const nvic_t *nvic, int exception)
{
    return has(nvic->pending, exception);
}

bool nvic_active(const nvic_t *nvic, int exception)
{
    return has(nvic->active, exception);
}

bool nvic_enabled(const nvic_t *nvic, int exception)
{
    return has(nvic->enabled, exception);
}

void nvic_activate(nvic_t *nvic, int exception)
{
    put(nvic->pending, exception, false);
    put(nvic->active, exception, true);
    nvic->active_count++;
    update(nvic);
}

void nvic_deactivate(nvic_t *nvic, int exception, uint64_t now)
{
    put(nvic->active, exception, false);
    nvic->active_count--;
    if (has(nvic->level, exception)) {
        nvic_pend(nvic, exception, now);
    }
    update(nvic);
}

int nvic_group_priority(const nvic_t *nvic, int exception)
{
    return grouped(nvic, nvic->priority[exception]);
}

int nvic_execution_priority(const nvic_t *nvic, const nvic_masks_t *masks)
{
    int boosted = NVIC_IDLE;
    if (masks->basepri != 0) {
        boosted = grouped(nvic, masks->basepri);
    }
    if (masks->primask) {
        boosted = 0;
    }
    if (masks->faultmask) {
        boosted = -1;
    }
    return boosted < nvic->active_priority ? boosted : nvic->active_priority;
}

int nvic_next(const nvic_t *nvic, int execution_priority)
{
    const int next = nvic->candidate;
    return next != 0 && grouped(nvic, nvic->priority[next]) < execution_priority ? next : 0;
}
