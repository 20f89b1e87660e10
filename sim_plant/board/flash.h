/* Flash controller and the 128 KiB behind it: wait states, unlocking, erasing pages, programming double
 * words. RM0440 5, one bank.
 *
 * While it is busy the processor cannot fetch from it: cpu_stall(). A write that breaks the rules sets its
 * error flag and programs nothing. Flash that a cut of the supply caught half-way holds neither old nor new.
 * The error correction's reports are not modelled. Tests: flash_test.cpp. */
#ifndef BOARD_FLASH_H
#define BOARD_FLASH_H

#include "sim_plant/board/board_registers.h"
#include "sim_plant/board/board_wiring.h"

#define FLASH_BASE      0x08000000u
#define FLASH_SIZE      0x20000u
#define FLASH_PAGE_SIZE 2048u

typedef struct {
    board_chip_t *chip;
    board_registers_t regs;
    uint8_t *memory;
    uint32_t latency; /* in effect */
    double busy_until_s;
    int keys;  /* of the sequence so far; -1: wrong, locked until reset */
    bool half; /* the first word of a double word has been written */
    uint32_t half_address, half_value;
    uint32_t cut_after; /* double words until power is lost; 0: never */
    bool cut;           /* it was */
} flash_t;

/* memory: what the processor sees at FLASH_BASE */
void flash_init(flash_t *flash, board_chip_t *chip, uint8_t *memory);
void flash_reset(flash_t *flash);
cpu_device_t flash_device(flash_t *flash);        /* registers */
cpu_device_t flash_memory_device(flash_t *flash); /* writes into the memory */
void flash_check_clock(flash_t *flash);

#endif
