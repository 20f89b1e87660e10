/* TIM2 as a free-running 32-bit counter with a prescaler. RM0440 29. Tests: tim2_test.cpp. */
#ifndef BOARD_TIM2_H
#define BOARD_TIM2_H

#include "sim_plant/board/board_registers.h"
#include "sim_plant/board/board_wiring.h"

typedef struct {
    board_registers_t regs;
    uint32_t prescaler; /* in effect */
    uint32_t count;     /* at cycle `since` */
    uint64_t since;
} tim2_t;

void tim2_init(tim2_t *tim, board_chip_t *chip);
void tim2_reset(tim2_t *tim);
cpu_device_t tim2_device(tim2_t *tim);

#endif
