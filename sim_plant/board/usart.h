/* USART2 as a transmitter: 8 data bits, one stop bit, one byte in the shift register and one waiting.
 * RM0440 37. What it sends is kept. Tests: usart_test.cpp. */
#ifndef BOARD_USART_H
#define BOARD_USART_H

#include "sim_plant/board/board_registers.h"
#include "sim_plant/board/board_wiring.h"

#include <stddef.h>

typedef struct {
    board_chip_t *chip;
    board_registers_t regs;
    bool shifting, waiting;
    uint8_t shifted, next;
    char *text;
    size_t length, room;
} usart_t;

void usart_init(usart_t *usart, board_chip_t *chip);
void usart_free(usart_t *usart);
void usart_reset(usart_t *usart);
cpu_device_t usart_device(usart_t *usart);

#endif
