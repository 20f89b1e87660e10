/* Independent watchdog. RM0440 42. Its clock is LSI, 32 kHz; the registers cross into that domain in five of
 * its cycles, while SR says so. Expiry resets the chip. Tests: iwdg_test.cpp. */
#ifndef BOARD_IWDG_H
#define BOARD_IWDG_H

#include "sim_plant/board/board_registers.h"
#include "sim_plant/board/board_wiring.h"

typedef struct {
    board_chip_t *chip;
    board_registers_t regs;
    bool running, open, frozen, expired;
    uint32_t divider, reload;   /* in effect */
    double divider_s, reload_s; /* when a new value is taken over */
    double end_s;
    double left_s; /* while frozen */
} iwdg_t;

void iwdg_init(iwdg_t *iwdg, board_chip_t *chip);
void iwdg_reset(iwdg_t *iwdg);
cpu_device_t iwdg_device(iwdg_t *iwdg);
void iwdg_clock_changed(iwdg_t *iwdg);
void iwdg_freeze(iwdg_t *iwdg, bool frozen); /* by the debugger */

#endif
