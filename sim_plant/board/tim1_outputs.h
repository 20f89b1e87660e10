/* Of TIM1: what the legs do, by channels, modes and COM events. Only tim1.c uses it. */
#ifndef BOARD_TIM1_OUTPUTS_H
#define BOARD_TIM1_OUTPUTS_H

#include "sim_plant/board/tim1.h"

#define TIM1_CCPC 0x1u /* CR2 */
#define TIM1_CCUS 0x4u

#define TIM1_PWM_1 6u /* OCxM */
#define TIM1_PWM_2 7u

uint32_t tim1_mode(const tim1_t *tim, int channel); /* in effect */
bool tim1_preloaded(const tim1_t *tim, int channel);

/* CCER and modes of the legs wait for a COM event. */
bool tim1_waits_for_com(const tim1_t *tim);

/* What CCER and CCMR say of the legs takes effect. */
void tim1_commutate(tim1_t *tim);

/* CCMR1 or CCMR2 has been written. */
void tim1_write_modes(tim1_t *tim, uint32_t offset, uint32_t before);

void tim1_check_carrier(const tim1_t *tim); /* the plant's, or the run fails; of tim1.c */

#endif
