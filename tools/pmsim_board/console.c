#include "tools/pmsim_board/console.h"

#include <stdio.h>
#include <string.h>

#include "sim_plant/board/board.h"

#define BOOT_S 1.0

/* A motor at rest on a small supply, and converters without noise. */
static const plant_config_t bench = {
    .machine = {.R_s_ohm = 1.0, .L_d0_H = 1e-3, .L_q0_H = 1e-3, .psi_m_Wb = 0.01, .pole_pairs = 4},
    .mech = {.J_kgm2 = 1e-4, .B_Nms = 1e-5},
    .inverter = {.f_pwm_Hz = 20000.0, .dead_time_s = 500e-9, .timer_counts = 4250},
    .dclink = {.v_source_V = 24.0},
    .sensor = {.bits = 12, .i_full_scale_A = BOARD_I_FULL_SCALE_A, .v_full_scale_V = BOARD_V_FULL_SCALE_V},
};

static bool begins_line(const char *text, const char *word)
{
    const char *at = text;
    while (at != NULL) {
        if (strncmp(at, word, strlen(word)) == 0) {
            return true;
        }
        at = strchr(at, '\n');
        at = at != NULL ? at + 1 : NULL;
    }
    return false;
}

static int run(board_t *board, double duration_s, const char *last)
{
    size_t shown = 0;
    double t_s = 0.0;
    bool ended = false;
    bool well = board_boot(board, BOOT_S);
    while (well && !ended && t_s < duration_s) {
        well = board_run_period(board);
        t_s += board_period_s(board);
        const char *console = board_console(board);
        const size_t length = strlen(console);
        if (length > shown && console[length - 1] == '\n') {
            fputs(&console[shown], stdout);
            shown = length;
            ended = last != NULL && begins_line(console, last);
        }
    }
    fputs(&board_console(board)[shown], stdout);
    if (!well) {
        fprintf(stderr, "pmsim board: %s\n", board_error(board));
        return 2;
    }
    if (last != NULL && !ended) {
        fprintf(stderr, "pmsim board: no line \"%s\" in %g s\n", last, duration_s);
        return 1;
    }
    return begins_line(board_console(board), "FAIL") ? 1 : 0;
}

int board_show_console(const char *elf_path, double duration_s, const char *last, bool terminals)
{
    char error[300];
    const char *reason = NULL;
    plant_config_t config = bench;
    config.sensor.v_leg_full_scale_V = terminals ? BOARD_V_FULL_SCALE_V : 0.0;
    plant_t *plant = plant_create(&config, 0.0, &reason);
    if (plant == NULL) {
        fprintf(stderr, "pmsim board: plant: %s\n", reason);
        return 2;
    }
    board_t *board = board_create(elf_path, plant, error, sizeof error);
    int code = 2;
    if (board == NULL) {
        fprintf(stderr, "pmsim board: %s\n", error);
    } else {
        code = run(board, duration_s, last);
        board_destroy(board);
    }
    plant_destroy(plant);
    return code;
}
