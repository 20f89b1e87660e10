#define _GNU_SOURCE
#include "hal/linux/board_lines.h"

#include <string.h>
#include <time.h>

static void wait_ms(long ms)
{
    struct timespec left = {.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000};
    while (nanosleep(&left, &left) != 0) {
        /* a signal has come: the rest */
    }
}

bool board_lines_open(board_lines_t *lines, const char *boot0, const char *nrst, char *error,
                      size_t error_size)
{
    const gpio_use_t drive = strchr(nrst, '!') != NULL ? GPIO_OPEN_DRAIN : GPIO_OUTPUT_OFF;
    lines->boot0 = gpio_line_open(boot0, GPIO_OUTPUT_OFF, error, error_size);
    lines->nrst = lines->boot0 != NULL ? gpio_line_open(nrst, drive, error, error_size) : NULL;
    if (lines->nrst == NULL) {
        board_lines_close(lines);
        return false;
    }
    return true;
}

void board_lines_close(board_lines_t *lines)
{
    gpio_line_close(lines->nrst);
    gpio_line_close(lines->boot0);
    *lines = (board_lines_t){NULL, NULL};
}

static bool reset_with(const board_lines_t *lines, bool boot0)
{
    bool well = gpio_line_set(lines->nrst, true) && gpio_line_set(lines->boot0, boot0);
    wait_ms(BOARD_HOLD_MS);
    well = gpio_line_set(lines->nrst, false) && well;
    wait_ms(BOARD_START_MS);
    return gpio_line_set(lines->boot0, false) && well;
}

bool board_lines_boot(const board_lines_t *lines)
{
    return reset_with(lines, true);
}

bool board_lines_run(const board_lines_t *lines)
{
    return reset_with(lines, false);
}
