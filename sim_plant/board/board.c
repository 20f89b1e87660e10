#include "sim_plant/board/board.h"

#include "sim_plant/board/board_inside.h"
#include "sim_plant/board/elf_image.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RAM_BASE    0x20000000u
#define RAM_SIZE    0x5800u /* SRAM1 and SRAM2 */
#define CCM_BASE    0x10000000u
#define CCM_SIZE    0x2800u
#define CCM_ALIAS   0x20005800u
#define SYSTEM_BASE 0x1FFF7400u /* of it, identifier and calibration of the reference have their contents */
#define SYSTEM_SIZE 0x400u
#define UNIQUE_ID   0x1FFF7590u
#define VREFINT_CAL 0x1FFF75AAu
#define ERASED      0xFF
#define PAINT       0xC5
#define BOOT_STEP_S 1e-6 /* the plant begins with the timer, within this */

static const uint32_t unique_id[3] = {0x00280043u, 0x594E5004u, 0x20373358u};

struct board {
    cpu_t *cpu;
    plant_t *plant;
    elf_image_t *image;
    board_chip_t chip;
    uint32_t resets;
    uint32_t stack_low, stack_top; /* 0: the image does not say */
};

static void add_memories(cpu_t *cpu)
{
    static const cpu_memory_t memories[] = {
        {"flash", FLASH_BASE, FLASH_SIZE, true, false, 0u},
        {"flash at 0", 0u, FLASH_SIZE, true, false, FLASH_BASE},
        {"SRAM", RAM_BASE, RAM_SIZE, true, true, 0u},
        {"CCM", CCM_BASE, CCM_SIZE, true, true, 0u},
        {"CCM behind SRAM", CCM_ALIAS, CCM_SIZE, true, true, CCM_BASE},
        {"system memory", SYSTEM_BASE, SYSTEM_SIZE, false, false, 0u},
    };
    for (size_t n = 0; n < sizeof memories / sizeof *memories; n++) {
        cpu_add_memory(cpu, &memories[n]);
    }
    memset(cpu_memory(cpu, FLASH_BASE, FLASH_SIZE), ERASED, FLASH_SIZE);
    memset(cpu_memory(cpu, RAM_BASE, RAM_SIZE), PAINT, RAM_SIZE);
    memset(cpu_memory(cpu, CCM_BASE, CCM_SIZE), PAINT, CCM_SIZE);
    memset(cpu_memory(cpu, SYSTEM_BASE, SYSTEM_SIZE), ERASED, SYSTEM_SIZE);
    memcpy(cpu_memory(cpu, UNIQUE_ID, sizeof unique_id), unique_id, sizeof unique_id);
    const uint16_t vrefint = (uint16_t)(BOARD_REFERENCE_V / 3.0 * 4096.0);
    memcpy(cpu_memory(cpu, VREFINT_CAL, sizeof vrefint), &vrefint, sizeof vrefint);
}

static bool load(void *context, uint32_t address, const uint8_t *data, uint32_t size)
{
    uint8_t *to = cpu_memory(context, address, size);
    if (!to || address - FLASH_BASE >= FLASH_SIZE) {
        return false;
    }
    memcpy(to, data, size);
    return true;
}

/* To 1 %: parts have tolerances. */
static bool near(double x, double wanted)
{
    return fabs(x - wanted) <= 0.01 * wanted;
}

board_t *board_create(const char *elf_path, plant_t *plant, char *error, size_t error_size)
{
    const plant_sensor_t *sensor = plant_sensor(plant);
    if (!near(sensor->i_full_scale_A, BOARD_I_FULL_SCALE_A) ||
        !near(sensor->v_full_scale_V, BOARD_V_FULL_SCALE_V)) {
        snprintf(error, error_size,
                 "the plant's sensors for %.4g A and %.4g V are not the board's, %.4g A and %.4g V",
                 sensor->i_full_scale_A, sensor->v_full_scale_V, BOARD_I_FULL_SCALE_A, BOARD_V_FULL_SCALE_V);
        return NULL;
    }
    board_t *board = calloc(1, sizeof *board);
    if (!board) {
        snprintf(error, error_size, "out of memory");
        return NULL;
    }
    board->plant = plant;
    board->image = elf_image_open(elf_path, error, error_size);
    board->cpu = board->image ? cpu_create(error, error_size) : NULL;
    if (!board->cpu) {
        board_destroy(board);
        return NULL;
    }
    add_memories(board->cpu);
    cpu_set_symbols(board->cpu, board->image);
    board_chip_init(&board->chip, board->cpu, plant);
    if (!elf_image_load(board->image, board->cpu, load)) {
        snprintf(error, error_size, "%s: a part of it is not for this processor's flash", elf_path);
        board_destroy(board);
        return NULL;
    }
    elf_symbol_t low, top;
    if (elf_image_find(board->image, "port_stack_bottom", &low) &&
        elf_image_find(board->image, "port_stack_top", &top)) {
        board->stack_low = low.address;
        board->stack_top = top.address;
    }
    return board;
}

void board_destroy(board_t *board)
{
    if (!board) {
        return;
    }
    board_chip_free(&board->chip);
    cpu_destroy(board->cpu);
    elf_image_close(board->image);
    free(board);
}

static void reset(board_t *board, uint32_t cause)
{
    if (board->stack_low != 0u) {
        uint32_t size = board->stack_top - board->stack_low;
        memset(cpu_memory(board->cpu, board->stack_low, size), PAINT, size);
    }
    board_chip_reset(&board->chip, cause);
    cpu_halt(board->cpu, false);
    cpu_reset(board->cpu, FLASH_BASE);
}

/* The chip has asked for a reset, or lost its power. */
static void reset_if_asked(board_t *board)
{
    uint32_t cause = cpu_reset_asked(board->cpu) ? RCC_SOFTWARE_RESET : 0u;
    if (cpu_locked_up(board->cpu)) {
        cause = RCC_WATCHDOG_RESET; /* that is what ends it, some ms later */
    }
    cause |= board->chip.iwdg.expired ? RCC_WATCHDOG_RESET : 0u;
    cause = board->chip.flash.cut ? RCC_POWER_RESET : cause;
    if (cause != 0u) {
        reset(board, cause);
        board->resets++;
    }
}

bool board_boot(board_t *board, double most_s)
{
    rcc_t *rcc = &board->chip.rcc;
    board->resets = 0u;
    reset(board, RCC_POWER_RESET);
    double start_s = rcc_seconds(rcc);
    while (!tim1_counting(&board->chip.tim1)) {
        if (rcc_seconds(rcc) - start_s > most_s ||
            !cpu_run(board->cpu, cpu_now(board->cpu) + rcc_cycles(rcc, BOOT_STEP_S))) {
            return false;
        }
        reset_if_asked(board);
    }
    board->chip.wiring.start = cpu_now(board->cpu);
    return true;
}

/* The end of the plant's period: TIM1's update event, or by the clock while they are not in step. */
static uint64_t period_end(const board_t *board)
{
    const board_chip_t *chip = &board->chip;
    if (chip->wiring.in_step) {
        return tim1_next_update(&chip->tim1);
    }
    double left_s = 1.0 / plant_inverter(board->plant)->f_pwm_Hz - board_within_s(chip, cpu_now(board->cpu));
    return cpu_now(board->cpu) + rcc_cycles(&chip->rcc, left_s);
}

static void finish_period(board_t *board, uint64_t cycle)
{
    board_chip_t *chip = &board->chip;
    plant_pwm_t pwm = {.driven_after_s = 0.0};
    adc_sample_until(&chip->adc, cycle);
    for (int leg = 0; leg < BOARD_LEGS; leg++) {
        pwm.compare[leg][0] = pwm.compare[leg][1] = chip->tim1.compare[leg];
        pwm.driven[leg] = chip->wiring.driven[leg];
        pwm.state[leg] = chip->wiring.state[leg];
    }
    plant_set_pwm(board->plant, &pwm);
    plant_run_period(board->plant);
    chip->wiring.start = cycle;
    board_told(chip);
}

bool board_run_period(board_t *board)
{
    board_chip_t *chip = &board->chip;
    for (;;) {
        uint64_t end = period_end(board);
        uint64_t update = tim1_next_update(&chip->tim1);
        if (!cpu_run(board->cpu, end < update ? end : update)) {
            return false;
        }
        reset_if_asked(board);
        bool updated = tim1_counting(&chip->tim1) && cpu_now(board->cpu) >= tim1_next_update(&chip->tim1);
        uint64_t at = updated ? tim1_next_update(&chip->tim1) : cpu_now(board->cpu);
        if (updated) {
            tim1_update(&chip->tim1);
        }
        bool follows = tim1_follows_plant(&chip->tim1);
        if (updated && (follows || chip->wiring.in_step)) {
            finish_period(board, at);
            chip->wiring.in_step = follows;
            return cpu_error(board->cpu)[0] == '\0';
        }
        if (!chip->wiring.in_step &&
            board_within_s(chip, cpu_now(board->cpu)) * plant_inverter(board->plant)->f_pwm_Hz >= 1.0) {
            finish_period(board, cpu_now(board->cpu));
            return cpu_error(board->cpu)[0] == '\0';
        }
    }
}

const char *board_error(const board_t *board)
{
    return cpu_error(board->cpu);
}

cpu_t *board_cpu(board_t *board)
{
    return board->cpu;
}

board_chip_t *board_inside(board_t *board)
{
    return &board->chip;
}

uint32_t board_clock_Hz(const board_t *board)
{
    return board->chip.rcc.clock_Hz;
}

double board_period_s(const board_t *board)
{
    const tim1_t *tim = &board->chip.tim1;
    return tim1_counting(tim) ? (double)tim1_period(tim) / board->chip.rcc.clock_Hz
                              : 1.0 / plant_inverter(board->plant)->f_pwm_Hz;
}

uint32_t board_resets(const board_t *board)
{
    return board->resets;
}

bool board_bridge_on(const board_t *board)
{
    const bool *driven = board->chip.wiring.driven;
    return tim1_main_output(&board->chip.tim1) && (driven[0] || driven[1] || driven[2]);
}

void *board_variable(board_t *board, const char *name, size_t size)
{
    elf_symbol_t symbol;
    bool found = elf_image_find(board->image, name, &symbol) && symbol.size >= size;
    return found ? cpu_memory(board->cpu, symbol.address, symbol.size) : NULL;
}

uint32_t board_stack_used(const board_t *board)
{
    uint32_t size = board->stack_top - board->stack_low;
    const uint8_t *stack = size > 0u ? cpu_memory(board->cpu, board->stack_low, size) : NULL;
    uint32_t free_bytes = 0u;
    while (stack && free_bytes < size && stack[free_bytes] == PAINT) {
        free_bytes++;
    }
    return size - free_bytes;
}
