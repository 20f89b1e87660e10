/* Devices by address. An access that no device takes, or that its device refuses, is told to the caller. */
#ifndef BOARD_BUS_H
#define BOARD_BUS_H

#include "sim_plant/board/cpu.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { BUS_DEVICES = 64 };

typedef struct {
    cpu_device_t device[BUS_DEVICES];
    unsigned count;
    unsigned last; /* that was accessed: most accesses go to the same device again */
} bus_t;

typedef enum {
    BUS_DONE,
    BUS_NO_DEVICE,
    BUS_NO_REGISTER,
} bus_answer_t;

bool bus_add(bus_t *bus, const cpu_device_t *device); /* false: full, or overlaps another device */
const cpu_device_t *bus_find(bus_t *bus, uint32_t address);

/* Sizes 1, 2 and 4, not across a word; the value is right-aligned as the processor has it. */
bus_answer_t bus_read(bus_t *bus, uint32_t address, unsigned size, uint32_t *value);
bus_answer_t bus_write(bus_t *bus, uint32_t address, unsigned size, uint32_t value);

#ifdef __cplusplus
}
#endif

#endif
