#include "tools/pmsim_board/watch.h"

#include <string.h>

enum { EXCEPTION_PENDSV = 14, EXCEPTION_SYSTICK = 15, EXCEPTION_IRQ0 = 16 };
enum { IRQ_ADC = 18, IRQ_FDCAN = 21, IRQ_USART2 = 38 };

static int mode_of(const drive_t *drive)
{
    switch (drive->stage) {
    case STAGE_OFF:
        return FIGURE_OFF;
    case STAGE_PROCEDURE:
        return drive->state == DRIVE_CALIBRATING ? FIGURE_CALIBRATE
               : drive->state == DRIVE_RUNNING   ? FIGURE_IDENTIFY
                                                 : FIGURE_PULSES;
    case STAGE_OPEN_LOOP:
        return drive->state == DRIVE_FINDING ? FIGURE_ALIGN : FIGURE_OPEN_LOOP;
    case STAGE_VECTOR:
        break;
    }
    if (drive->position.inject) {
        return drive->position.weight > 0 ? FIGURE_BLEND : FIGURE_INJECTION;
    }
    return drive->field_weakening.i_d < 0 ? FIGURE_WEAKENING : FIGURE_FLUX;
}

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

static size_t first_difference(const void *first, const void *second, size_t size)
{
    const uint8_t *a = first;
    const uint8_t *b = second;
    size_t at = 0;
    while (at < size && a[at] == b[at]) {
        at++;
    }
    return at;
}

/* Byte by byte, holes included: both have copied the same memory. */
static bool same(const void *first, const void *second, size_t size)
{
    return memcmp(first, second, size) == 0;
}

/* The limits' flags stay until the slow interrupt; this period's own are seen when they are taken away
 * before. */
static void step(watch_t *watch, drive_out_t *out)
{
    drive_t *drive = &watch->before;
    const bool current = drive->current.limited;
    const bool modulator = drive->modulator.limited;
    const bool fault = drive->fault != DRIVE_FAULT_NONE;
    watch->mode = mode_of(drive);
    drive->current.limited = false;
    drive->modulator.limited = false;
    const drive_in_t in = image_in(watch->image);
    drive_step(drive, &in, out);
    watch->event[FIGURE_LIMITED] = drive->current.limited || drive->modulator.limited;
    watch->event[FIGURE_FAULT] = !fault && drive->fault != DRIVE_FAULT_NONE;
    drive->current.limited = drive->current.limited || current;
    drive->modulator.limited = drive->modulator.limited || modulator;
}

/* The set of parameters that the image has taken, if it has, is taken from it. */
static void step_slow(watch_t *watch)
{
    drive_t *drive = &watch->before;
    const drive_config_t *now = &watch->image->drive.config;
    if (!same(&drive->config, now, sizeof *now)) {
        drive_reconfigure(drive, now);
        watch->event[FIGURE_SWAP] = true;
    }
    const drive_slow_in_t in = {.temperature_dC = watch->image->slow.temperature_dC};
    drive_slow(drive, &in);
}

/* The same step on the host, from the same memory. */
static void compare(watch_t *watch, int interrupt)
{
    drive_t *drive = &watch->before;
    drive_out_t out = image_out(watch->image);
    if (interrupt == FIGURE_CONTROL) {
        step(watch, &out);
    } else {
        step_slow(watch);
    }
    if (!same(drive, &watch->image->drive, sizeof *drive) ||
        !same(&out, &watch->image->out, sizeof watch->image->out)) {
        cpu_fail(board_cpu(watch->board),
                 "image and host differ after the %s interrupt of period %u, from byte %zu of %zu",
                 interrupt == FIGURE_CONTROL ? "control" : "slow", watch->image->drive.period,
                 first_difference(drive, &watch->image->drive, sizeof *drive), sizeof *drive);
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
        watch->before = watch->image->drive;
        watch->entered = interrupt;
    } else if (!entry) {
        watch->mode = mode_of(&watch->before);
        if (compared && watch->entered == interrupt) { /* not one that had begun before the watch */
            compare(watch, interrupt);
        }
        count(watch, interrupt, exception);
    } else {
        /* nothing to keep */
    }
}

bool watch_begin(watch_t *watch, board_t *board)
{
    *watch = (watch_t){.board = board, .entered = -1};
    watch->image = board_variable(board, "app_instance", sizeof *watch->image);
    if (watch->image == NULL) {
        return false;
    }
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
}
