/* What a CiA 402 master says to the image over the emulated bus: the node with its default process data, and
 * the second of them switched on; a duty goes by the third. */
#ifndef PMSIM_BOARD_MASTER_H
#define PMSIM_BOARD_MASTER_H

#include "firmware/drive/drive.h"
#include "sim_plant/board/board.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    board_t *board;
    double rated_torque_Nm; /* whose permille the torque is given in */
    bool enabled;           /* as far as it has asked */
    uint8_t routines;       /* to identify, as told last: 0 after the start */
    bool gives_duty;        /* RPDO3 is in use */
} master_t;

master_t master_make(board_t *board, const drive_params_t *params);

/* After the image has started: RPDO2 in use, then all of it. */
void master_start(master_t *master);

/* Targets and controlword, with the steps from off to on, ahead of which the routines of an identification are told; to be
 * repeated before the node's time-out. */
void master_send(master_t *master, const drive_command_t *command);

/* Whether this answer of the node says that it cannot identify what it was told. */
bool master_is_refused(const board_frame_t *frame);

/* The edge that clears a fault; the drive is then off. */
void master_clear_fault(master_t *master, const drive_command_t *command);

#ifdef __cplusplus
}
#endif

#endif
