/* The two lines of a board's processor by which another computer starts its boot loader: BOOT0 and NRST of an
 * STM32, AN2606: BOOT0 high at the end of reset selects the ROM, where the option bytes leave it to the pin.
 *
 * NRST wired directly is active low and named so ("gpiochip0:5!"): it is then driven open drain, because the
 * processor and a debugger pull it too. Through an inverting transistor it is active high and push-pull.
 * BOOT0 is push-pull; after board_lines_run() and board_lines_close() it stays off as long as the chip holds
 * it: the board needs its own pull-down.
 *
 *            hold 20 ms   start 100 ms
 *   NRST   ____|~~~~~~~~|_________________     ~ active
 *   BOOT0  ____|~~~~~~~~~~~~~~~~~~~~~~~|__     board_lines_boot(); board_lines_run() leaves it off
 *
 * Tests: tests/vm/board_lines_test.cpp, on a simulated chip. */
#ifndef HAL_LINUX_BOARD_LINES_H
#define HAL_LINUX_BOARD_LINES_H

#include "hal/linux/gpio_line.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BOARD_HOLD_MS 20 /* of NRST; the processor needs 0.3 us, a supervisor on the board more */
#define BOARD_START_MS                                                                                       \
    100 /* NRST rises (100 nF at 40 kOhm: 20 ms), BOOT0 is read, the ROM begins to listen */

typedef struct {
    gpio_line_t *boot0, *nrst;
} board_lines_t;

/* Opens both lines, inactive: the board keeps running. False and a text if one cannot be opened; then neither
 * is. */
bool board_lines_open(board_lines_t *lines, const char *boot0, const char *nrst, char *error,
                      size_t error_size);
void board_lines_close(board_lines_t *lines);

/* These block for 120 ms. False: a line could not be set; both are then off, as far as possible. */
bool board_lines_boot(const board_lines_t *lines); /* resets into the boot loader */
bool board_lines_run(const board_lines_t *lines);  /* resets into the flashed image */

#ifdef __cplusplus
}
#endif

#endif
