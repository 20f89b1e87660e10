/* FDCAN1 with classic frames of standard identifiers, and the bus behind it. RM0440 44.
 *
 * Receive FIFO 0 (blocking), transmit FIFO of three buffers, message memory in its fixed layout, no filters.
 * A frame takes its time on the bus, stuff bits included; who has the lower identifier goes first. Every
 * frame is acknowledged. Bus-off sets CCCR.INIT; clearing that begins the recovery of 128 times 11 bits.
 * Tests: fdcan_test.cpp. */
#ifndef BOARD_FDCAN_H
#define BOARD_FDCAN_H

#include "sim_plant/board/board_registers.h"
#include "sim_plant/board/board_wiring.h"

#define FDCAN_RAM_WORDS 212
#define FDCAN_ELEMENTS  3
#define FDCAN_QUEUE     256

typedef struct {
    uint16_t id;
    uint8_t length;
    uint8_t data[8];
} fdcan_frame_t;

typedef struct {
    fdcan_frame_t frame[FDCAN_QUEUE];
    unsigned put, taken; /* run freely */
} fdcan_queue_t;

typedef struct {
    board_chip_t *chip;
    board_registers_t regs;
    uint32_t ram[FDCAN_RAM_WORDS];
    uint32_t bit_cycles;
    unsigned rx_get, rx_fill, tx_get, tx_put, tx_fill; /* of FIFO 0 and the transmit FIFO */
    unsigned errors_sent;                              /* TEC */
    bool bus_off;
    uint64_t joined; /* cycle from which the node takes part; UINT64_MAX: it does not */
    enum { BUS_IDLE, BUS_OUT, BUS_IN } bus;
    fdcan_queue_t to_image, from_image;
} fdcan_t;

void fdcan_init(fdcan_t *can, board_chip_t *chip);
void fdcan_reset(fdcan_t *can);
cpu_device_t fdcan_device(fdcan_t *can);
cpu_device_t fdcan_ram_device(fdcan_t *can);

/* The other side of the bus. */
bool fdcan_put(fdcan_t *can, const fdcan_frame_t *frame); /* false: not on the bus, or too many wait */
bool fdcan_take(fdcan_t *can, fdcan_frame_t *frame);      /* the last 256 are kept */
void fdcan_error(fdcan_t *can, bool bus_off);             /* else error passive */

/* Length on the bus with stuff bits, acknowledgement, end of frame and the three bits behind it. */
unsigned fdcan_frame_bits(const fdcan_frame_t *frame);

#endif
