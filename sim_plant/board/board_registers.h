/* A peripheral's registers: what of them is modelled, and their values.
 *
 * A write that would give a bit outside `modelled` another value than its reset value is refused with a text
 * that names register and bits: so is an offset that the list does not have. Peripherals read and write
 * value[] freely and do what else an access does. Tests: registers_test.cpp. */
#ifndef BOARD_REGISTERS_H
#define BOARD_REGISTERS_H

#include "sim_plant/board/cpu.h"

#define BOARD_REGISTERS_MOST 80

/* In the order in which a table of them reads. */
/* NOLINTNEXTLINE(clang-analyzer-optin.performance.Padding) */
typedef struct {
    uint16_t offset;
    const char *name;
    uint32_t reset;
    uint32_t modelled; /* bits that software may change */
    uint32_t hardware; /* bits that a write leaves as they are */
} board_register_t;

typedef struct {
    cpu_t *cpu;
    const char *name; /* of the peripheral */
    const board_register_t *list;
    int count;
    uint32_t value[BOARD_REGISTERS_MOST]; /* by offset / 4 */
} board_registers_t;

void board_registers_init(board_registers_t *r, cpu_t *cpu, const char *name, const board_register_t *list,
                          int count);
void board_registers_reset(board_registers_t *r);

bool board_registers_read(const board_registers_t *r, uint32_t offset, uint32_t *value);
bool board_registers_write(board_registers_t *r, uint32_t offset, uint32_t value, uint32_t mask);

static inline uint32_t *board_register(board_registers_t *r, uint32_t offset)
{
    return &r->value[offset / 4];
}

static inline uint32_t board_field(uint32_t value, int first, int width)
{
    return value / (1u << first) % (1u << width);
}

#endif
