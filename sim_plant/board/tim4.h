/* TIM4 as the trigger of the converters: reset by TIM1's update events (TRGO), its channel's level is its trigger output, high
 * from there on for CCR1 counts. RM0440 29. Tests: adc_test.cpp. */
#ifndef BOARD_TIM4_H
#define BOARD_TIM4_H

#include "sim_plant/board/board_registers.h"
#include "sim_plant/board/board_wiring.h"

typedef struct {
    board_chip_t *chip;
    board_registers_t regs;
    uint64_t since; /* cycle of the last reset; before the first one: start */
    bool high;      /* the trigger output */
} tim4_t;

void tim4_init(tim4_t *tim, board_chip_t *chip);
void tim4_reset(tim4_t *tim);
cpu_device_t tim4_device(tim4_t *tim);

/* TIM1's trigger output has risen at that cycle, and will again at `next`. */
void tim4_restart(tim4_t *tim, uint64_t cycle, uint64_t next);

#endif
