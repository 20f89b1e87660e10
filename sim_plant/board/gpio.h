/* Ports A, B and C: RM0440 9. What a peripheral drives or sees depends on mode and alternate function of its
 * pin. Outside levels are those of the board: button, break input, pull resistors. Tests: gpio_test.cpp. */
#ifndef BOARD_GPIO_H
#define BOARD_GPIO_H

#include "sim_plant/board/board_registers.h"
#include "sim_plant/board/board_wiring.h"

typedef enum { PORT_A, PORT_B, PORT_C, GPIO_PORTS } gpio_port_t;

typedef struct {
    gpio_port_t port;
    int number;
    int function; /* alternate; of the peripheral that is meant */
} gpio_pin_t;

typedef struct {
    board_chip_t *chip;
    board_registers_t regs;
    gpio_port_t which;
} gpio_bank_t;

typedef struct {
    gpio_bank_t bank[GPIO_PORTS];
} gpio_t;

void gpio_init(gpio_t *gpio, board_chip_t *chip);
void gpio_reset(gpio_t *gpio);
cpu_device_t gpio_device(gpio_t *gpio, gpio_port_t port);

bool gpio_connects(const gpio_t *gpio, gpio_pin_t pin); /* mode and alternate function are the peripheral's */
bool gpio_analog(const gpio_t *gpio, gpio_port_t port, int number);
bool gpio_drives_high(const gpio_t *gpio, gpio_port_t port, int number); /* as an output */

#endif
