/* Packets of gdb's remote serial protocol over a TCP connection of this machine. */
#ifndef PMSIM_BOARD_GDB_LINK_H
#define PMSIM_BOARD_GDB_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { GDB_PACKET = 4096 };

typedef struct {
    int connection;            /* -1: none */
    char sent[GDB_PACKET + 8]; /* the last packet, framed */
} gdb_link_t;

/* Waits on that port for one client; `waits` is told the port first (of 0: one that was free). */
bool gdb_link_open(gdb_link_t *link, uint16_t port, void (*waits)(uint16_t port));
void gdb_link_close(gdb_link_t *link);

/* Waits for a packet's text. An interrupt (ctrl-C) comes as "\x03". False: the client is gone. */
bool gdb_link_receive(gdb_link_t *link, char text[GDB_PACKET]);
void gdb_link_send(gdb_link_t *link, const char *text);

/* Without waiting: an interrupt has come, or the client is gone. */
bool gdb_link_interrupted(gdb_link_t *link);

#ifdef __cplusplus
}
#endif

#endif
