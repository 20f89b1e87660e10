/* Clocks, reset causes and the core's voltage range: RCC and PWR. RM0440 6 and 7.
 *
 * Oscillators become ready after their start-up times; the PLL's frequencies, the flash's wait states and the
 * voltage range must suit each other at every change of the processor's clock, and a step beyond 80 MHz goes
 * through half the frequency for 1 us. AHB and both APB run at the processor's clock: other prescalers of APB
 * are not modelled. Tests: rcc_test.cpp. */
#ifndef BOARD_RCC_H
#define BOARD_RCC_H

#include "sim_plant/board/board_registers.h"
#include "sim_plant/board/board_wiring.h"

#define RCC_AHB1ENR  0x48u
#define RCC_AHB2ENR  0x4Cu
#define RCC_APB1ENR1 0x58u
#define RCC_APB2ENR  0x60u

/* causes, in RCC_CSR */
#define RCC_PIN_RESET      0x04000000u
#define RCC_POWER_RESET    0x08000000u
#define RCC_SOFTWARE_RESET 0x10000000u
#define RCC_WATCHDOG_RESET 0x20000000u

typedef struct {
    board_chip_t *chip;
    board_registers_t regs, pwr;
    uint32_t clock_Hz; /* of the processor */
    double since_s;    /* time at since_cycle, when the clock last changed */
    uint64_t since_cycle;
    double hse_ready_s, hsi_ready_s, pll_ready_s, lsi_ready_s; /* INFINITY: off */
    double switched_s;
} rcc_t;

void rcc_init(rcc_t *rcc, board_chip_t *chip);
void rcc_reset(rcc_t *rcc, uint32_t cause);
cpu_device_t rcc_device(rcc_t *rcc);
cpu_device_t rcc_power_device(rcc_t *rcc);

bool rcc_enabled(const rcc_t *rcc, uint32_t enable_register, uint32_t bit);
double rcc_seconds(const rcc_t *rcc); /* since board_create() */
uint64_t rcc_cycles(const rcc_t *rcc, double seconds);
bool rcc_boost(const rcc_t *rcc);
bool rcc_fdcan_on_pclk(const rcc_t *rcc);
bool rcc_failed(const rcc_t *rcc);     /* the clock security system has acted and is not acknowledged */
bool rcc_supply_low(const rcc_t *rcc); /* by the voltage detector, if it is on */

/* The crystal stops, or may start again. */
void rcc_oscillator(rcc_t *rcc, bool stopped);
void rcc_start_lsi(rcc_t *rcc); /* the watchdog needs it */

#endif
