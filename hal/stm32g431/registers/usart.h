/* Serial port: RM0440 37. */
#ifndef REGISTERS_USART_H
#define REGISTERS_USART_H

#include "hal/stm32g431/registers/register.h"

typedef struct {
    reg_t CR1;
    reg_t CR2;
    reg_t CR3;
    reg_t BRR;
    uint32_t reserved_10[3];
    reg_t ISR;
    uint32_t reserved_20[2];
    reg_t TDR;
} usart_t;

#define USART_CR1_UE    (1U << 0)
#define USART_CR1_TE    (1U << 3)
#define USART_CR1_TXEIE (1U << 7)
#define USART_ISR_TXE   (1U << 7)

extern usart_t USART2;

#endif
