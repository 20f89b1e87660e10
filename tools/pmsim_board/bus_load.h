/* Other nodes on the emulated bus, which is never idle then, and 1 Mbit/s fast. */
#ifndef PMSIM_BOARD_BUS_LOAD_H
#define PMSIM_BOARD_BUS_LOAD_H

#include "firmware/drive/drive.h"
#include "sim_plant/board/board.h"
#include "tools/pmsim_board/bus_noise.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    bus_noise_t noise;
    bool begun;
    uint64_t frames, idle; /* given; looks that found the bus without any */
} bus_load_t;

bus_load_t bus_load(bus_noise_kind_t kind);

/* Before each period. */
void bus_load_fill(bus_load_t *load, board_t *board);

/* app_page() with a bit rate; returns the words that are used. */
uint32_t bus_load_page(const drive_params_t *params, uint32_t kbit_s, uint32_t words[]);

#ifdef __cplusplus
}
#endif

#endif
