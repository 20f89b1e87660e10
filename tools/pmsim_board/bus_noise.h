/* What other nodes may put on the bus, right or wrong: frames that are no command to node 1. Deterministic.
 */
#ifndef PMSIM_BOARD_BUS_NOISE_H
#define PMSIM_BOARD_BUS_NOISE_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/can_frame.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    BUS_QUIET,
    BUS_BABBLE,  /* the shortest frame there is, behind all others: most interrupts, and commands pass */
    BUS_GARBAGE, /* any identifier, half of them the node's own, any length and content */
} bus_noise_kind_t;

typedef struct {
    bus_noise_kind_t kind;
    uint32_t state;
} bus_noise_t;

hal_can_frame_t bus_noise_next(bus_noise_t *noise);

#ifdef __cplusplus
}
#endif

#endif
