/* How the headers of this folder name things, all after RM0440 and the ARMv7-M Architecture Reference Manual.
 * A peripheral is an object: TIM1.CR1 is read and written like a member of a struct. registers.ld places the
 * objects; on the host a test defines them in ordinary memory. A field is its mask: TIM_CR1_CEN. Only what
 * the port uses is here. tools/check_registers compares every definition with an independent description. */
#ifndef REGISTERS_REGISTER_H
#define REGISTERS_REGISTER_H

#include <stdint.h>

typedef volatile uint32_t reg_t;
typedef volatile uint8_t reg8_t;

/* A value in the place of its field; the division by a constant costs nothing. */
static inline uint32_t reg_field(uint32_t mask, uint32_t value)
{
    return (value * (mask & (~mask + 1U))) & mask;
}

static inline uint32_t reg_value(uint32_t mask, uint32_t word)
{
    return (word & mask) / (mask & (~mask + 1U));
}

#endif
