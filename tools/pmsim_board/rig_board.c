#include "tools/pmsim_board/rig_board.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/app/app.h"
#include "firmware/params/store.h"
#include "sim_plant/board/board.h"
#include "tools/pmsim/rig_sample.h"
#include "tools/pmsim_board/bus_load.h"
#include "tools/pmsim_board/gdb_server.h"
#include "tools/pmsim_board/load.h"
#include "tools/pmsim_board/master.h"
#include "tools/pmsim_board/watch.h"

#define STORE_ADDRESS  0x0801F000U
#define BOOT_S         0.2   /* most until the timer runs */
#define REPEAT_PERIODS 1000U /* a master repeats its commands */

struct rig {
    plant_t *plant;
    board_t *board;
    watch_t watch;
    rig_scale_t scale;
    drive_command_t sent;
    master_t master;
    load_t load;
    hal_can_state_t bus; /* as it was told last */
    uint32_t since_sent;
    bus_load_t others;
    gdb_server_t *gdb; /* NULL: none */
};

static const char *image_path;
static bool live, busy;
static int gdb_port = -1;
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

void rig_board_busy(void)
{
    busy = true;
}

void rig_board_gdb(uint16_t port)
{
    gdb_port = port;
}

static bool boot(rig_t *rig, const drive_params_t *params)
{
    uint32_t words[STORE_WORDS];
    /* refused ones too: the image has to refuse them itself */
    const uint32_t used =
        noise == BUS_QUIET ? app_page(params, 1, words) : bus_load_page(params, 1000, words);
    board_program(rig->board, STORE_ADDRESS, words, used * sizeof words[0]);
    return board_boot(rig->board, BOOT_S);
}

rig_t *rig_create(const plant_config_t *plant, double theta_e_rad, const drive_params_t *params,
                  bool refusal_expected, char *error, size_t error_size)
{
    const char *reason = NULL;
    rig_t *rig = calloc(1, sizeof *rig);
    rig->plant = plant_create(plant, theta_e_rad, &reason);
    if (rig->plant == NULL) {
        snprintf(error, error_size, "plant: %s", reason);
        rig_destroy(rig);
        return NULL;
    }
    drive_t drive;
    const drive_result_t result =
        drive_init(&drive, params, 0); /* what the image carries beside the common */
    if (!result.ok && !refusal_expected) {
        snprintf(error, error_size, "drive refuses parameter %s: %s", drive_param_table[result.param].name,
                 result.reason);
        rig_destroy(rig);
        return NULL;
    }
    rig->scale = rig_scale(&drive.config.base, params->pole_pairs, drive.config.slow_divider);
    rig->board = board_create(image_path, rig->plant, error, error_size);
    if (rig->board == NULL) {
        rig_destroy(rig);
        return NULL;
    }
    if (gdb_port >= 0) {
        rig->gdb = gdb_server_attach(board_cpu(rig->board), (uint16_t)gdb_port);
        if (rig->gdb == NULL) {
            snprintf(error, error_size, "no gdb on port %d: %s", gdb_port, strerror(errno));
            rig_destroy(rig);
            return NULL;
        }
    }
    if (!boot(rig, params)) {
        snprintf(error, error_size, "%s: %s", image_path, board_error(rig->board));
        rig_destroy(rig);
        return NULL;
    }
    if (!watch_begin(&rig->watch, rig->board)) {
        snprintf(error, error_size, "%s: has no variable app_instance of at least %zu bytes", image_path,
                 sizeof(image_memory_t));
        rig_destroy(rig);
        return NULL;
    }
    rig->others = bus_load(noise);
    if (!live) {
        rig->master = master_make(rig->board, params);
        master_start(&rig->master);
        rig->load = load_make(rig->board, params);
    }
    return rig;
}

void rig_destroy(rig_t *rig)
{
    if (rig->board != NULL) {
        rig->watch.figures.bus_frames = rig->others.frames;
        rig->watch.figures.bus_idle = rig->others.idle;
        rig->watch.figures.refused = rig->load.refused;
        watch_end(&rig->watch);
        gdb_server_detach(rig->gdb);
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

/* Hardly any is read in a scenario: the status is read from the memory, where it is complete. */
static void take_frames(rig_t *rig)
{
    board_frame_t frame;
    while (board_can_receive(rig->board, &frame)) {
        load_take(&rig->load, &frame);
    }
}

void rig_step(rig_t *rig, rig_sample_t *sample)
{
    plant_truth_windings(rig->plant, &sample->truth);
    if (!live && ++rig->since_sent >= REPEAT_PERIODS) {
        send(rig);
    }
    bus_load_fill(&rig->others, rig->board);
    if (busy && !live) {
        load_step(&rig->load);
    }
    if (rig->gdb != NULL) {
        gdb_server_poll(rig->gdb);
    }
    if (!board_run_period(rig->board)) {
        fprintf(stderr, "pmsim board: %s at %.6f s\n", board_error(rig->board), sample->truth.t_s);
        exit(2);
    }
    if (!live) {
        take_frames(rig);
    }
    rig->watch.figures.simulated_s += board_period_s(rig->board);
    const drive_out_t out = image_out(rig->watch.image);
    rig_fill_sample(&rig->scale, &rig->watch.image->drive, &out, sample);
}

uint32_t rig_slow_divider(const rig_t *rig)
{
    return rig->watch.image->drive.config.slow_divider;
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
        .temperature_dC = rig->watch.image->slow.temperature_dC,
    };
    const drive_in_t in = image_in(rig->watch.image);
    const drive_out_t out = image_out(rig->watch.image);
    rig_record_legs(&in, &out, record);
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
