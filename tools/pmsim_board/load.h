/* A bus that keeps the image busy while a scenario runs: a trace of eight signals in every period, armed again
 * as soon as it may be complete, with a level that is crossed often; and a parameter written now and then, so
 * that the drive takes a new set. One SDO request at a time, one every few periods. */
#ifndef PMSIM_BOARD_LOAD_H
#define PMSIM_BOARD_LOAD_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/params/types.h"
#include "sim_plant/board/board.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    board_t *board;
    uint32_t periods;     /* since the last request */
    uint32_t next;        /* request: of setting up, then of what is repeated */
    int32_t acceleration; /* the parameter, as it was */
    uint32_t refused;     /* requests that the node did not do */
} load_t;

load_t load_make(board_t *board, const drive_params_t *params);

/* Each period. */
void load_step(load_t *load);

/* Of a frame from the image: answers are looked at. */
void load_take(load_t *load, const board_frame_t *frame);

#ifdef __cplusplus
}
#endif

#endif
