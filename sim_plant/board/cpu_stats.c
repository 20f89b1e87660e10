#include "sim_plant/board/cpu_state.h"

#include <string.h>

/* What has run since the mark belongs to the exception on top, or to the thread. */
static void settle(cpu_t *cpu)
{
    cpu_counters_t *own = cpu->frames > 0 ? &cpu->frame[cpu->frames - 1].own : &cpu->thread;
    own->instructions += cpu->total.instructions - cpu->mark.instructions;
    own->low += cpu->total.low - cpu->mark.low;
    own->typical += cpu->total.typical - cpu->mark.typical;
    own->high += cpu->total.high - cpu->mark.high;
    own->asleep += cpu->total.asleep - cpu->mark.asleep;
    cpu->mark = cpu->total;
}

void cpu_stats_enter(cpu_t *cpu, int exception)
{
    settle(cpu);
    cpu_exception_stats_t *stats = &cpu->stats[exception];
    const uint64_t latency = cpu->total.typical - cpu->nvic.pended_at[exception];
    if (latency > stats->latency_most) {
        stats->latency_most = latency;
    }
    if (cpu->frames < NVIC_EXCEPTIONS) {
        cpu->frame[cpu->frames] = (cpu_frame_t){.exception = exception};
        cpu->frames++;
    }
}

void cpu_stats_leave(cpu_t *cpu, int exception)
{
    if (cpu->frames == 0 || cpu->frame[cpu->frames - 1].exception != exception) {
        return; /* an image that returns in another order than it came */
    }
    settle(cpu);
    cpu->frames--;
    const cpu_counters_t *own = &cpu->frame[cpu->frames].own;
    cpu_exception_stats_t *stats = &cpu->stats[exception];
    if (stats->count == 0 || own->instructions < stats->instructions_least) {
        stats->instructions_least = own->instructions;
    }
    if (own->instructions > stats->instructions_most) {
        stats->instructions_most = own->instructions;
    }
    if (own->typical > stats->cycles_most) {
        stats->cycles_most = own->typical;
    }
    stats->count++;
    stats->instructions += own->instructions;
    stats->cycles_low += own->low;
    stats->cycles_typical += own->typical;
    stats->cycles_high += own->high;
}

const cpu_exception_stats_t *cpu_exception_stats(const cpu_t *cpu, int exception)
{
    return &cpu->stats[exception];
}

void cpu_clear_stats(cpu_t *cpu)
{
    settle(cpu);
    memset(cpu->stats, 0, sizeof cpu->stats);
    memset(&cpu->thread, 0, sizeof cpu->thread);
}

uint64_t cpu_instructions(const cpu_t *cpu)
{
    return cpu->total.instructions;
}

uint64_t cpu_cycles_low(const cpu_t *cpu)
{
    return cpu->total.low;
}

uint64_t cpu_cycles_high(const cpu_t *cpu)
{
    return cpu->total.high;
}

uint64_t cpu_cycles_asleep(const cpu_t *cpu)
{
    return cpu->total.asleep;
}

uint64_t cpu_cycles_in_thread(const cpu_t *cpu)
{
    const uint64_t open = cpu->frames == 0 ? cpu->total.typical - cpu->mark.typical : 0;
    const uint64_t asleep = cpu->frames == 0 ? cpu->total.asleep - cpu->mark.asleep : 0;
    return cpu->thread.typical + open - cpu->thread.asleep - asleep;
}
