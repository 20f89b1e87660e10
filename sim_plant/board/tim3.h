/* TIM3 as the delay of TIM1's commutations: reset by TIM1's update events (TRGO), its channel's edge is TIM1's trigger.
 * RM0440 29. Tests: tim1_test.cpp. */
#ifndef BOARD_TIM3_H
#define BOARD_TIM3_H

#include "sim_plant/board/board_registers.h"
#include "sim_plant/board/board_wiring.h"

typedef struct {
    board_chip_t *chip;
    board_registers_t regs;
} tim3_t;

void tim3_init(tim3_t *tim, board_chip_t *chip);
void tim3_reset(tim3_t *tim);
cpu_device_t tim3_device(tim3_t *tim);

/* TIM1's trigger output has risen at that cycle, and will again at `next`. */
void tim3_restart(tim3_t *tim, uint64_t cycle, uint64_t next);

#endif
