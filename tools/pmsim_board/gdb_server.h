/* The emulated processor as gdb's remote target: registers, memory, breaks, steps, ctrl-C. While it stands,
 * the board's time stands. docs/board.md. */
#ifndef PMSIM_BOARD_GDB_SERVER_H
#define PMSIM_BOARD_GDB_SERVER_H

#include "sim_plant/board/cpu.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct gdb_server gdb_server_t;

/* Waits for a client (told on standard error); the processor stops before its next instruction. NULL: the
 * port cannot be had. */
gdb_server_t *gdb_server_attach(cpu_t *cpu, uint16_t port);

/* From time to time while the processor runs: notices ctrl-C. */
void gdb_server_poll(gdb_server_t *server);

void gdb_server_detach(gdb_server_t *server); /* tells the client that the run has ended; NULL: nothing */

#ifdef __cplusplus
}
#endif

#endif
