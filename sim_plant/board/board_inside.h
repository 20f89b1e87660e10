/* For the board's own files and tests of single devices. */
#ifndef BOARD_INSIDE_H
#define BOARD_INSIDE_H

#include "sim_plant/board/board.h"
#include "sim_plant/board/board_chip.h"

board_chip_t *board_inside(board_t *board);

#endif
