/* A CAN bus of this computer, by name. Classic frames with 11-bit identifiers; others are skipped.
 *
 *   can0, vcan0 ...       SocketCAN
 *   socketcand:HOST:PORT  listens there and speaks socketcand's raw mode to one client; port 0: any free one
 *   slcan:/dev/pts/N      speaks the serial-line protocol of CAN adapters on that terminal
 *   slcan:                the same on a new pseudo-terminal, whose name can_link_where() returns
 *
 * The state is that of the controller, with SocketCAN only. A removed interface stays bus-off; one that is
 * down only receives nothing. No function blocks. Tests: tests/unit/hal_linux, and tests/vm with real buses.
 * */
#ifndef HAL_LINUX_CAN_LINK_H
#define HAL_LINUX_CAN_LINK_H

#include <stdbool.h>
#include <stddef.h>

#include "hal/can_frame.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct can_link can_link_t;

/* NULL and an error text that says how to solve it. */
can_link_t *can_link_open(const char *name, char *error, size_t error_size);
void can_link_close(can_link_t *link);

bool can_link_receive(can_link_t *link, hal_can_frame_t *frame);    /* false: none waits */
bool can_link_send(can_link_t *link, const hal_can_frame_t *frame); /* false: no room, or nobody listens */
hal_can_state_t can_link_state(const can_link_t *link);
const char *can_link_where(const can_link_t *link); /* where a peer finds it */

#ifdef __cplusplus
}
#endif

#endif
