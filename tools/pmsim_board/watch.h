/* Looks on while the image runs: what each interrupt takes, and whether its memory stays that of the host.
 *
 * After each control and each slow interrupt the drive's memory in the processor is compared, byte by byte,
 * with what the same function makes on the host of the memory before the interrupt. A difference ends the run
 * with an error that names interrupt and place. */
#ifndef PMSIM_BOARD_WATCH_H
#define PMSIM_BOARD_WATCH_H

#include "sim_plant/board/board.h"
#include "tools/pmsim_board/figures.h"
#include "tools/pmsim_board/twin.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    board_t *board;
    const twin_t *twin;
    const void *image;                                /* app_instance in the processor's memory */
    void *before;                                     /* its drive at the entry of the interrupt that runs, */
    int entered;                                      /* which is this one; -1: none seen yet */
    int mode;                                         /* of the control interrupt that ends, */
    bool event[FIGURE_EVENTS];                        /* and what happened in it */
    cpu_exception_stats_t counted[FIGURE_INTERRUPTS]; /* up to the last return */
    figures_t figures;
} watch_t;

/* From now on, on a board that has booted. False: its image has no such memory. The watch stays in place. */
bool watch_begin(watch_t *watch, board_t *board, const twin_t *twin);

/* Adds what the board tells at the end, and all of it to the program's figures. */
void watch_end(watch_t *watch);

#ifdef __cplusplus
}
#endif

#endif
