/* An image without a scenario: boots, runs, and what its UART says is printed as it comes. */
#ifndef PMSIM_BOARD_CONSOLE_H
#define PMSIM_BOARD_CONSOLE_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Runs for that time of the board, or until a line begins with `last`. Returns the exit code: 0, or 1 when a
 * line begins with FAIL, or 2 when the board stops. `terminals`: the dividers of the terminals are in place, at PB11, too. */
int board_show_console(const char *elf_path, double duration_s, const char *last, bool terminals);

#ifdef __cplusplus
}
#endif

#endif
