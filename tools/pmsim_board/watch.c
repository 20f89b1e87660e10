#include "tools/pmsim_board/watch.h"

#include <stdlib.h>
#include <string.h>

enum { EXCEPTION_PENDSV = 14, EXCEPTION_SYSTICK = 15, EXCEPTION_IRQ0 = 16 };
enum { IRQ_ADC = 18, IRQ_FDCAN = 21, IRQ_USART2 = 38 };

static int interrupt_of(int exception)
{
    switch (exception) {
    case EXCEPTION_IRQ0 + IRQ_ADC:
        return FIGURE_CONTROL;
    case EXCEPTION_SYSTICK:
        return FIGURE_MONITOR;
    case EXCEPTION_PENDSV:
        return FIGURE_SLOW;
    case EXCEPTION_IRQ0 + IRQ_FDCAN:
        return FIGURE_CAN;
    case EXCEPTION_IRQ0 + IRQ_USART2:
        return FIGURE_CONSOLE;
    default:
        return -1;
    }
}

static void add(interrupt_figure_t *figure, const cpu_exception_stats_t *before,
                const cpu_exception_stats_t *now)
{
    figure_add(&figure->instructions, now->instructions - before->instructions);
    figure_add(&figure->cycles, now->cycles_typical - before->cycles_typical);
    figure->cycles_low += now->cycles_low - before->cycles_low;
    figure->cycles_high += now->cycles_high - before->cycles_high;
}

/* A sample within the period is taken by the control interrupt's handler, too: it is counted with the period that it is for. */
static bool is_sample(const watch_t *watch, int interrupt)
{
    return interrupt == FIGURE_CONTROL &&
           watch->twin->period(watch->before) == watch->twin->period(watch->image);
}

static void count(watch_t *watch, int interrupt, int exception)
{
    const cpu_exception_stats_t *now = cpu_exception_stats(board_cpu(watch->board), exception);
    cpu_exception_stats_t *before = &watch->counted[interrupt];
    figures_t *figures = &watch->figures;
    add(&figures->interrupt[interrupt], before, now);
    if (interrupt == FIGURE_CONTROL) {
        add(&figures->mode[watch->mode], before, now);
        for (int n = 0; n < FIGURE_EVENTS; n++) {
            if (watch->event[n]) {
                add(&figures->event[n], before, now);
            }
            watch->event[n] = false;
        }
    }
    *before = *now;
}

/* The same step on the host, from the same memory. */
static void compare(watch_t *watch, int interrupt)
{
    const twin_t *twin = watch->twin;
    const bool control = interrupt == FIGURE_CONTROL;
    const size_t at = control ? twin->control(watch->before, watch->image, watch->event)
                              : twin->slow(watch->before, watch->image, watch->event);
    if (at != TWIN_SAME) {
        cpu_fail(board_cpu(watch->board),
                 "image and host differ after the %s interrupt of period %u, from byte %zu of %u",
                 control ? "control" : "slow", twin->period(watch->image), at, twin->drive_bytes);
    }
    watch->figures.identical++;
}

static void trace(void *owner, int exception, bool entry)
{
    watch_t *watch = owner;
    const int interrupt = interrupt_of(exception);
    if (interrupt < 0) {
        return;
    }
    const bool compared = interrupt == FIGURE_CONTROL || interrupt == FIGURE_SLOW;
    if (entry && compared) {
        memcpy(watch->before, watch->image, watch->twin->drive_bytes);
        watch->entered = interrupt;
    } else if (!entry) {
        watch->mode = watch->twin->mode(watch->before);
        const bool whole = !is_sample(watch, interrupt);
        if (compared && watch->entered == interrupt) { /* not one that had begun before the watch */
            compare(watch, interrupt);
        }
        if (whole) {
            count(watch, interrupt, exception);
        }
    } else {
        /* nothing to keep */
    }
}

bool watch_begin(watch_t *watch, board_t *board, const twin_t *twin)
{
    *watch = (watch_t){.board = board, .twin = twin, .entered = -1};
    watch->image = board_variable(board, "app_instance", twin->memory_bytes);
    if (watch->image == NULL) {
        return false;
    }
    watch->before = calloc(1, twin->drive_bytes);
    cpu_trace(board_cpu(board), watch, trace);
    return true;
}

void watch_end(watch_t *watch)
{
    if (watch->image == NULL) {
        return;
    }
    figures_t *f = &watch->figures;
    const cpu_t *cpu = board_cpu(watch->board);
    f->latency_most = cpu_exception_stats(cpu, EXCEPTION_IRQ0 + IRQ_ADC)->latency_most;
    f->cycles = cpu_now(cpu);
    f->cycles_asleep = cpu_cycles_asleep(cpu);
    f->clock_Hz = board_clock_Hz(watch->board);
    f->period_cycles = (uint64_t)(board_period_s(watch->board) * (double)f->clock_Hz + 0.5);
    f->stack_most = board_stack_used(watch->board);
    f->resets = board_resets(watch->board);
    figures_merge(f);
    free(watch->before);
}
