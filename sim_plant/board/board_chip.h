/* The STM32G431's peripherals together, and how they reach each other. RM0440. */
#ifndef BOARD_CHIP_H
#define BOARD_CHIP_H

#include "sim_plant/board/adc.h"
#include "sim_plant/board/analog.h"
#include "sim_plant/board/board_misc.h"
#include "sim_plant/board/board_wiring.h"
#include "sim_plant/board/fdcan.h"
#include "sim_plant/board/flash.h"
#include "sim_plant/board/gpio.h"
#include "sim_plant/board/iwdg.h"
#include "sim_plant/board/rcc.h"
#include "sim_plant/board/tim1.h"
#include "sim_plant/board/tim2.h"
#include "sim_plant/board/tim3.h"
#include "sim_plant/board/tim4.h"
#include "sim_plant/board/usart.h"

#define BOARD_FIXED_DEVICES 24

/* A device behind its clock: an access while that is off is an error. */
typedef struct {
    cpu_device_t inner;
    board_chip_t *chip;
    uint32_t enable_register, enable_bit; /* in RCC; register 0: always on */
} board_gate_t;

struct board_chip {
    cpu_t *cpu;
    plant_t *plant;
    rcc_t rcc;
    flash_t flash;
    gpio_t gpio;
    tim1_t tim1;
    tim2_t tim2;
    tim3_t tim3;
    tim4_t tim4;
    adc_t adc;
    analog_t analog;
    fdcan_t fdcan;
    iwdg_t iwdg;
    usart_t usart;
    board_misc_t misc;
    board_wiring_t wiring;
    board_gate_t gate[BOARD_FIXED_DEVICES];
    int gates;
};

/* Adds the devices to the processor's bus. */
void board_chip_init(board_chip_t *chip, cpu_t *cpu, plant_t *plant);
void board_chip_free(board_chip_t *chip);

/* As after a reset for that cause, a bit of RCC_CSR. */
void board_chip_reset(board_chip_t *chip, uint32_t cause);

#endif
