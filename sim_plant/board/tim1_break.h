/* Of TIM1: main output, dead time, lock, break. Only tim1*.c and tests use it. */
#ifndef BOARD_TIM1_BREAK_H
#define BOARD_TIM1_BREAK_H

#include "sim_plant/board/tim1.h"

enum {
    TIM1_CR1 = 0x00,
    TIM1_CR2 = 0x04,
    TIM1_SMCR = 0x08,
    TIM1_SR = 0x10,
    TIM1_EGR = 0x14,
    TIM1_CCMR1 = 0x18,
    TIM1_CCMR2 = 0x1C,
    TIM1_CCER = 0x20,
    TIM1_CNT = 0x24,
    TIM1_ARR = 0x2C,
    TIM1_RCR = 0x30,
    TIM1_CCR1 = 0x34,
    TIM1_CCR2 = 0x38,
    TIM1_CCR3 = 0x3C,
    TIM1_CCR4 = 0x40,
    TIM1_BDTR = 0x44,
    TIM1_AF1 = 0x60
};

#define TIM1_CEN  0x1u
#define TIM1_UIF  0x1u
#define TIM1_BIF  0x80u
#define TIM1_SBIF 0x2000u
#define TIM1_MOE  0x8000u

double tim1_dead_time_s(const tim1_t *tim, double *step_s);

/* The value with what LOCK protects as it was. RM0440 28.6.20 */
uint32_t tim1_lock(const tim1_t *tim, uint32_t offset, uint32_t value);

void tim1_write_bdtr(tim1_t *tim, uint32_t before);
void tim1_clear_flags(tim1_t *tim, uint32_t keep);

#endif
