/* The emulated drive board: ST's B-G431B-ESC1 around a processor that runs the flashed image, closed on the
 * plant. One PWM period after the other.
 *
 * TIM1 drives the legs, the converters sample at the instants that TIM1 triggers, the comparators act on the
 * timer's break input without software. Shunts, amplifiers and dividers are those of the schematic, below: a plant
 * whose sensors have other full scales is refused. What is not modelled is an error that names register and PC,
 * never a guess. docs/board.md.
 *
 * A period k runs from one update event of TIM1 to the next: processor until t_k+1, the plant behind it,
 * moved on where something happens in it: samples, legs switched on or off, t_k+1. A break by the comparators
 * acts in the plant at its instant; the processor sees it at its next look at TIM1, or from t_k+1 on. Until
 * TIM1 counts, and after a reset, periods go by the clock and the bridge is off.
 */
#ifndef BOARD_BOARD_H
#define BOARD_BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "sim_plant/board/cpu.h"
#include "sim_plant/plant.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Of the schematic: shunts, amplifiers with the network in front of them, divider of 169 and 18 kohm, and how long
 * the amplifiers take after an edge. */
#define BOARD_SHUNT_OHM      3e-3
#define BOARD_CURRENT_GAIN   (16.0 * 4.0 / 7.0)
#define BOARD_DIVIDER        (187.0 / 18.0)
#define BOARD_CONVERTER_V    3.3
#define BOARD_I_FULL_SCALE_A (0.5 * BOARD_CONVERTER_V / (BOARD_SHUNT_OHM * BOARD_CURRENT_GAIN))
#define BOARD_V_FULL_SCALE_V (BOARD_CONVERTER_V * BOARD_DIVIDER)
#define BOARD_SETTLE_S       1.3e-6

typedef struct board board_t;

/* NULL and a text on a file that is not an image for this processor. The plant stays the caller's. */
board_t *board_create(const char *elf_path, plant_t *plant, char *error, size_t error_size);
void board_destroy(board_t *board);

/* Reset and run until the PWM timer counts, at most `most_s`. */
bool board_boot(board_t *board, double most_s);

/* One period of the carrier. False: stopped, board_error() says why. */
bool board_run_period(board_t *board);
const char *board_error(const board_t *board);

cpu_t *board_cpu(board_t *board);
uint32_t board_clock_Hz(const board_t *board); /* of the processor, now */
double board_period_s(const board_t *board);   /* of the carrier */
uint32_t board_resets(const board_t *board);   /* since board_boot() */
bool board_bridge_on(const board_t *board);    /* TIM1's main output enable, and any leg driven */

/* The first bytes of a variable of the image; NULL when there is none of that name, or it is smaller. */
void *board_variable(board_t *board, const char *name, size_t size);

/* Flash pages as the debugger sees them: for parameters that are there before the first boot. */
void board_program(board_t *board, uint32_t address, const void *data, size_t size);
void board_read_flash(board_t *board, uint32_t address, void *data, size_t size);

/* Bus and console */
typedef struct {
    uint16_t id;
    uint8_t length;
    uint8_t data[8];
} board_frame_t;
bool board_can_send(board_t *board, const board_frame_t *frame); /* to the image; false: not started */
unsigned board_can_waiting(board_t *board);                   /* to the image, the one on the bus included */
bool board_can_receive(board_t *board, board_frame_t *frame); /* from it, the last 256; false: none */
void board_can_error(board_t *board, bool bus_off);
const char *board_console(board_t *board); /* all that the UART has said */
bool board_led(board_t *board);

/* The outside world */
void board_set_temperature(board_t *board, double temperature_degC);
void board_set_dial(board_t *board, double fraction);
void board_press_button(board_t *board, bool pressed);
void board_hold_break(board_t *board, bool held);                       /* external break input */
void board_pulse_break(board_t *board, double after_s, double width_s); /* the same, from then on so long */

/* Faults of the board itself */
void board_halt(board_t *board,
                bool halted); /* by the debugger: DBGMCU's freeze bits act, unlike cpu_halt() */
void board_stick_converter(board_t *board, bool stuck); /* conversions never end */
void board_stop_oscillator(board_t *board, bool stopped);
void board_fail_pll(board_t *board, bool fails);        /* it does not lock the next time */
void board_set_supply(board_t *board, double supply_V); /* of the processor and its converters, 3.3 V */
void board_check_parity(board_t *board, bool checked);  /* option byte SRAM_PE */
void board_flip_ram(board_t *board);                    /* a bit of the memory, which is read at once */
/* Power is lost in the midst of the n-th double word or page erase from now on: the board resets. 0: never.
 */
void board_cut_flash(board_t *board, uint32_t after_words);

/* Deepest use of the main stack and of the process stack since reset, bytes: by painted memory. */
uint32_t board_stack_used(const board_t *board);

#ifdef __cplusplus
}
#endif

#endif
