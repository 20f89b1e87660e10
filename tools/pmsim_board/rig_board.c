#include "tools/pmsim_board/rig_board.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/app/app.h"
#include "firmware/params/parameters.h"
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
    twin_scale_t scale;
    drive_command_t sent;
    master_t master;
    load_t load;
    hal_can_state_t bus; /* as it was told last */
    uint32_t since_sent;
    bus_load_t others;
    gdb_server_t *gdb; /* NULL: none */
};

static const char *image_path;
static bool live, busy, similar;
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

void rig_board_similar(void)
{
    similar = true;
}

void rig_board_busy(void)
{
    busy = true;
}

void rig_board_gdb(uint16_t port)
{
    gdb_port = port;
}

/* Refused ones too: the image has to refuse them itself. */
static uint32_t make_page(const drive_params_t *params, uint32_t words[STORE_WORDS])
{
    return noise == BUS_QUIET ? app_page(params, 1, words) : bus_load_page(params, 1000, words);
}

/* Wound again with the machine: then its preset is another. */
static bool is_wound(drive_param_id_t id)
{
    static const char *const units[] = {"A", "V", "ohm", "H", "F", "Wb"};
    for (size_t n = 0; similar && n < sizeof units / sizeof units[0]; n++) {
        if (strcmp(drive_param_text[id].unit, units[n]) == 0) {
            return true;
        }
    }
    return false;
}

/* Not the user's: tools/pmsim/setup.cpp takes it from a sensor that the image does not look at. */
static bool is_of_plant(drive_param_id_t id)
{
    return is_wound(id) || id == DRIVE_PARAM_neutral_filter;
}

/* A parameter that the image has not, and that is not as it would be without it */
static const char *missing(const twin_t *twin, const uint32_t page[])
{
    const int32_t count = store_check(page);
    for (int32_t n = 0; n < count; n++) {
        bool has_index;
        const store_pair_t pair = store_pair(page, (uint32_t)n);
        const od_entry_t *entry = od_find((uint16_t)(pair.id >> 8), (uint8_t)(pair.id & 0xFFU), &has_index);
        if (entry->kind == (uint8_t)OD_PARAMETER && !twin->has(pair.id) &&
            pair.value != drive_param_table[entry->slot].def && !is_of_plant((drive_param_id_t)entry->slot)) {
            return drive_param_table[entry->slot].name;
        }
    }
    return NULL;
}

static bool check_parameters(rig_t *rig, const twin_t *twin, const uint32_t page[], bool refusal_expected,
                             char *error, size_t error_size)
{
    const char *parameter = missing(twin, page);
    if (parameter != NULL) {
        snprintf(error, error_size, "parameter %s is not in this image (%s)", parameter, twin->name);
        return false;
    }
    const char *reason = twin->configure(page, &rig->scale, &parameter);
    if (reason != NULL && !refusal_expected) {
        snprintf(error, error_size, "drive refuses parameter %s: %s%s", parameter, reason,
                 similar ? "" : " (--similar: a machine for other voltages)");
        return false;
    }
    return true;
}

static bool attach_gdb(rig_t *rig, char *error, size_t error_size)
{
    if (gdb_port >= 0) {
        rig->gdb = gdb_server_attach(board_cpu(rig->board), (uint16_t)gdb_port);
        if (rig->gdb == NULL) {
            snprintf(error, error_size, "no gdb on port %d: %s", gdb_port, strerror(errno));
            return false;
        }
    }
    return true;
}

/* The image on its board, watched. */
static bool begin(rig_t *rig, const drive_params_t *params, bool refusal_expected, char *error,
                  size_t error_size)
{
    uint32_t page[STORE_WORDS];
    char why[200];
    rig->board = board_create(image_path, rig->plant, error, error_size);
    if (rig->board == NULL) {
        return false;
    }
    const twin_t *twin =
        twin_of(board_variable(rig->board, "app_image", sizeof(app_image_t)), why, sizeof why);
    if (twin == NULL) {
        snprintf(error, error_size, "%s: %s", image_path, why);
        return false;
    }
    const uint32_t used = make_page(params, page);
    if (!check_parameters(rig, twin, page, refusal_expected, error, error_size) ||
        !attach_gdb(rig, error, error_size)) {
        return false;
    }
    board_program(rig->board, STORE_ADDRESS, page, used * sizeof page[0]);
    if (!board_boot(rig->board, BOOT_S)) {
        snprintf(error, error_size, "%s: %s", image_path, board_error(rig->board));
        return false;
    }
    if (!watch_begin(&rig->watch, rig->board, twin)) {
        snprintf(error, error_size, "%s: has no variable app_instance of at least %zu bytes", image_path,
                 twin->memory_bytes);
        return false;
    }
    return true;
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
    if (!begin(rig, params, refusal_expected, error, error_size)) {
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
/* It is in the board's memory. */
bool rig_turn_estimate(rig_t *rig, double theta_e_rad)
{
    (void)rig;
    (void)theta_e_rad;
    return false;
}

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
        if (master_is_refused(&frame)) {
            fprintf(stderr, "pmsim board: routine %d of the identification is not in this image (%s)\n",
                    rig->sent.routines, rig->watch.twin->name);
            exit(2);
        }
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
    rig->watch.twin->sample(&rig->scale, rig->watch.image, sample);
}

uint32_t rig_slow_divider(const rig_t *rig)
{
    return rig->watch.twin->slow_divider(rig->watch.image);
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
        .duty_ppm = rig->sent.duty_ppm,
    };
    rig->watch.twin->record(rig->watch.image, record);
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
