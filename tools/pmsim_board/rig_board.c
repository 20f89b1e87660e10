#include "tools/pmsim_board/rig_board.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/app/app.h"
#include "firmware/params/store.h"
#include "sim_plant/board/board.h"
#include "tools/pmsim/rig_sample.h"
#include "tools/pmsim_board/bus_load.h"
#include "tools/pmsim_board/figures.h"
#include "tools/pmsim_board/master.h"

#define STORE_ADDRESS  0x0801F000U
#define BOOT_S         0.2   /* most until the timer runs */
#define REPEAT_PERIODS 1000U /* a master repeats its commands */

enum { EXCEPTION_PENDSV = 14, EXCEPTION_SYSTICK = 15, EXCEPTION_IRQ0 = 16 };
enum { IRQ_ADC = 18, IRQ_FDCAN = 21, IRQ_USART2 = 38 };

/* What the application's memory begins with, the same on processor and host. */
typedef struct {
    drive_t drive;
    drive_in_t in;
    drive_out_t out;
    hal_slow_t slow;
} watched_t;

struct rig {
    plant_t *plant;
    board_t *board;
    const watched_t *image; /* in the processor's memory */
    drive_t before;         /* at the entry of the interrupt that runs, */
    int entered;            /* which is this one; -1: none seen yet */
    rig_scale_t scale;
    drive_command_t sent;
    master_t master;
    hal_can_state_t bus; /* as it was told last */
    uint32_t since_sent;
    bus_load_t load;
    cpu_exception_stats_t counted[FIGURE_INTERRUPTS]; /* up to the last return */
    figures_t figures;
};

static const char *image_path;
static bool live;
static bus_noise_kind_t noise;

void rig_board_image(const char *elf_path, bool commands_by_bus)
{
    image_path = elf_path;
    live = commands_by_bus;
}

void rig_board_bus_load(bus_noise_kind_t kind)
{
    noise = kind;
}

static int mode_of(const drive_t *drive)
{
    switch (drive->stage) {
    case STAGE_OFF:
        return FIGURE_OFF;
    case STAGE_CALIBRATE:
        return FIGURE_CALIBRATE;
    case STAGE_PULSES:
        return FIGURE_PULSES;
    case STAGE_OPEN_LOOP:
        return FIGURE_OPEN_LOOP;
    case STAGE_VECTOR:
        break;
    }
    return drive->position.inject ? FIGURE_INJECTION : FIGURE_FLUX;
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

static void count(rig_t *rig, int interrupt, int exception)
{
    const cpu_exception_stats_t *now = cpu_exception_stats(board_cpu(rig->board), exception);
    cpu_exception_stats_t *before = &rig->counted[interrupt];
    add(&rig->figures.interrupt[interrupt], before, now);
    if (interrupt == FIGURE_CONTROL) {
        add(&rig->figures.mode[mode_of(&rig->before)], before, now);
    }
    *before = *now;
}

/* Byte by byte, holes included: both have copied the same memory. Returns `size` when all are equal. */
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

/* The same step on the host, from the same memory. */
static void compare(rig_t *rig, int interrupt)
{
    drive_t *drive = &rig->before;
    drive_out_t out = rig->image->out;
    if (interrupt == FIGURE_CONTROL) {
        drive_step(drive, &rig->image->in, &out);
    } else {
        const drive_slow_in_t in = {.temperature_dC = rig->image->slow.temperature_dC};
        drive_slow(drive, &in);
    }
    const size_t at = first_difference(drive, &rig->image->drive, sizeof *drive);
    if (at < sizeof *drive || first_difference(&out, &rig->image->out, sizeof out) < sizeof out) {
        cpu_fail(board_cpu(rig->board),
                 "image and host differ after the %s interrupt of period %u, from byte %zu of %zu",
                 interrupt == FIGURE_CONTROL ? "control" : "slow", rig->image->drive.period, at,
                 sizeof *drive);
    }
    rig->figures.identical++;
}

static void trace(void *owner, int exception, bool entry)
{
    rig_t *rig = owner;
    const int interrupt = interrupt_of(exception);
    if (interrupt < 0) {
        return;
    }
    const bool compared = interrupt == FIGURE_CONTROL || interrupt == FIGURE_SLOW;
    if (entry && compared) {
        rig->before = rig->image->drive;
        rig->entered = interrupt;
    } else if (!entry) {
        count(rig, interrupt, exception);
        if (compared && rig->entered == interrupt) { /* not one that had begun before the watch */
            compare(rig, interrupt);
        }
    } else {
        /* nothing to keep */
    }
}

static bool boot(rig_t *rig, const drive_params_t *params)
{
    uint32_t words[STORE_WORDS];
    /* refused ones too: the image has to refuse them itself */
    const uint32_t used =
        noise == BUS_QUIET ? app_page(params, 1, words) : bus_load_page(params, 1000, words);
    board_program(rig->board, STORE_ADDRESS, words, used * sizeof words[0]);
    if (!board_boot(rig->board, BOOT_S)) {
        return false;
    }
    rig->entered = -1;
    cpu_trace(board_cpu(rig->board), rig, trace);
    return true;
}

rig_t *rig_create(const plant_config_t *plant, double theta_e_rad, const drive_params_t *params,
                  bool refusal_expected, char *error, size_t error_size)
{
    const char *reason = NULL;
    rig_t *rig = calloc(1, sizeof *rig);
    drive_t *drive = &rig->before;
    rig->plant = plant_create(plant, theta_e_rad, &reason);
    if (rig->plant == NULL) {
        snprintf(error, error_size, "plant: %s", reason);
        rig_destroy(rig);
        return NULL;
    }
    const drive_result_t result = drive_init(drive, params);
    if (!result.ok && !refusal_expected) {
        snprintf(error, error_size, "drive refuses parameter %s: %s", drive_param_table[result.param].name,
                 result.reason);
        rig_destroy(rig);
        return NULL;
    }
    rig->scale = rig_scale(&drive->config.base, params->pole_pairs);
    rig->board = board_create(image_path, rig->plant, error, error_size);
    if (rig->board == NULL) {
        rig_destroy(rig);
        return NULL;
    }
    if (!boot(rig, params)) {
        snprintf(error, error_size, "%s: %s", image_path, board_error(rig->board));
        rig_destroy(rig);
        return NULL;
    }
    rig->image = board_variable(rig->board, "app_instance", sizeof *rig->image);
    if (rig->image == NULL) {
        snprintf(error, error_size, "%s: has no variable app_instance of at least %zu bytes", image_path,
                 sizeof *rig->image);
        rig_destroy(rig);
        return NULL;
    }
    rig->load = bus_load(noise);
    if (!live) {
        rig->master = master_make(rig->board, params);
        master_start(&rig->master);
    }
    return rig;
}

static void add_figures(rig_t *rig)
{
    figures_t *f = &rig->figures;
    const cpu_t *cpu = board_cpu(rig->board);
    f->latency_most = cpu_exception_stats(cpu, EXCEPTION_IRQ0 + IRQ_ADC)->latency_most;
    f->cycles = cpu_now(cpu);
    f->cycles_asleep = cpu_cycles_asleep(cpu);
    f->clock_Hz = board_clock_Hz(rig->board);
    f->period_cycles = (uint64_t)(board_period_s(rig->board) * (double)f->clock_Hz + 0.5);
    f->stack_most = board_stack_used(rig->board);
    f->resets = board_resets(rig->board);
    f->bus_frames = rig->load.frames;
    f->bus_idle = rig->load.idle;
    figures_merge(f);
}

void rig_destroy(rig_t *rig)
{
    if (rig->board != NULL) {
        if (rig->image != NULL) {
            add_figures(rig);
        }
        board_destroy(rig->board);
    }
    plant_destroy(rig->plant);
    free(rig);
}

plant_t *rig_plant(rig_t *rig)
{
    return rig->plant;
}

static void send(rig_t *rig)
{
    if (!live) {
        master_send(&rig->master, &rig->sent);
        rig->since_sent = 0;
    }
}

void rig_command(rig_t *rig, const rig_command_t *command)
{
    rig->sent = rig_drive_command(command);
    send(rig);
}

/* The drive refuses while enable is set. The profile would take the reset and the enable anew, one after the
 * other: a master that keeps to the drive's rule does not ask. */
bool rig_clear_fault(rig_t *rig)
{
    if (rig->sent.enable) {
        return false;
    }
    if (!live) {
        master_clear_fault(&rig->master, &rig->sent);
    }
    return true; /* asked for; the drive's state tells */
}

void rig_set_temperature(rig_t *rig, double temperature_degC)
{
    board_set_temperature(rig->board, temperature_degC);
}

void rig_set_hw_fault(rig_t *rig, bool held)
{
    board_hold_break(rig->board, held);
}

/* The comparators' threshold is the image's own. */
void rig_set_break(rig_t *rig, double i_break_A)
{
    (void)rig;
    (void)i_break_A;
}

bool rig_send(rig_t *rig, const hal_can_frame_t *frame)
{
    board_frame_t put = {.id = frame->id, .length = frame->length};
    memcpy(put.data, frame->data, sizeof put.data);
    return board_can_send(rig->board, &put);
}

bool rig_receive(rig_t *rig, hal_can_frame_t *frame)
{
    board_frame_t got;
    if (!board_can_receive(rig->board, &got)) {
        return false;
    }
    *frame = (hal_can_frame_t){.id = got.id, .length = got.length};
    memcpy(frame->data, got.data, sizeof frame->data);
    return true;
}

void rig_set_can_state(rig_t *rig, hal_can_state_t state)
{
    if (state != rig->bus && state != HAL_CAN_ACTIVE) { /* which it becomes by itself, frame by frame */
        board_can_error(rig->board, state == HAL_CAN_BUS_OFF);
    }
    rig->bus = state;
}

/* Nobody reads them in a scenario: the status is read from the memory, where it is complete. */
static void drop_frames(rig_t *rig)
{
    hal_can_frame_t frame;
    while (rig_receive(rig, &frame)) {
    }
}

void rig_step(rig_t *rig, rig_sample_t *sample)
{
    plant_truth_windings(rig->plant, &sample->truth);
    if (!live && ++rig->since_sent >= REPEAT_PERIODS) {
        send(rig);
    }
    bus_load_fill(&rig->load, rig->board);
    if (!board_run_period(rig->board)) {
        fprintf(stderr, "pmsim board: %s at %.6f s\n", board_error(rig->board), sample->truth.t_s);
        exit(2);
    }
    if (!live) {
        drop_frames(rig);
    }
    rig->figures.simulated_s += board_period_s(rig->board);
    rig_fill_sample(&rig->scale, &rig->image->drive, &rig->image->out, sample);
}

uint32_t rig_slow_divider(const rig_t *rig)
{
    return rig->image->drive.config.slow_divider;
}

void rig_record(const rig_t *rig, record_period_t *record)
{
    *record = (record_period_t){
        .given = RECORD_COMMAND,
        .enable = rig->sent.enable,
        .mode = (uint8_t)rig->sent.mode,
        .speed_mrad_s = rig->sent.speed_mrad_s,
        .torque_uNm = rig->sent.torque_uNm,
        .current_mA = rig->sent.current_mA,
        .temperature_dC = rig->image->slow.temperature_dC,
    };
    rig_record_legs(&rig->image->in, &rig->image->out, record);
}

/* Replays are for the drive on the host. */
void rig_step_plant(rig_t *rig, const record_period_t *record)
{
    (void)rig;
    (void)record;
    abort();
}

bool rig_step_drive(rig_t *rig, const record_period_t *record)
{
    (void)rig;
    (void)record;
    abort();
}
