/* Pins: RM0440 9. Two bits of a pin in MODER, OSPEEDR and PUPDR, four in AFR. */
#ifndef REGISTERS_GPIO_H
#define REGISTERS_GPIO_H

#include "hal/stm32g431/registers/register.h"

typedef struct {
    reg_t MODER;
    reg_t OTYPER;
    reg_t OSPEEDR;
    reg_t PUPDR;
    reg_t IDR;
    reg_t ODR;
    reg_t BSRR; /* lower half sets, upper half clears */
    reg_t LCKR;
    reg_t AFR[2];
} gpio_t;

extern gpio_t GPIOA, GPIOB, GPIOC;

#endif
