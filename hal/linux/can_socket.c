/* SocketCAN */
#define _GNU_SOURCE
#include "hal/linux/can_backend.h"

#include <errno.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define RECEIVE_BYTES (1 << 20) /* a flooded vcan overflows the default */

static bool refuse(char *error, size_t error_size, const char *name, const char *what)
{
    snprintf(error, error_size, "CAN interface %s: %s", name, what);
    return false;
}

static bool socket_open(can_link_t *link, const char *name, char *error, size_t error_size)
{
    const unsigned index = if_nametoindex(name);
    if (index == 0U) {
        return refuse(
            error, error_size, name,
            "there is none; `ip link add dev vcan0 type vcan; ip link set vcan0 up` makes a virtual one");
    }
    link->fd = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    if (link->fd < 0) {
        return refuse(error, error_size, name, strerror(errno));
    }
    const can_err_mask_t errors = CAN_ERR_BUSOFF | CAN_ERR_RESTARTED | CAN_ERR_CRTL;
    const int bytes = RECEIVE_BYTES;
    (void)setsockopt(link->fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors);
    (void)setsockopt(link->fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    const struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = (int)index};
    if (bind(link->fd, (const struct sockaddr *)&address, sizeof address) != 0) {
        return refuse(error, error_size, name, strerror(errno));
    }
    snprintf(link->where, sizeof link->where, "%s", name);
    return true;
}

static void take_error(can_link_t *link, const struct can_frame *frame)
{
    const unsigned passive = CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE;
    const unsigned active = CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING | CAN_ERR_CRTL_ACTIVE;
    const unsigned told = (frame->can_id & CAN_ERR_CRTL) != 0U ? frame->data[1] : 0U; /* overflows too */
    if ((frame->can_id & CAN_ERR_BUSOFF) != 0U) {
        link->state = HAL_CAN_BUS_OFF;
    } else if ((told & passive) != 0U) {
        link->state = HAL_CAN_PASSIVE;
    } else if ((told & active) != 0U || (frame->can_id & CAN_ERR_RESTARTED) != 0U) {
        link->state = HAL_CAN_ACTIVE;
    } else {
        /* does not concern the state */
    }
}

/* A controller that was taken down and up again does not report that it has left bus-off; its frames show it.
 * */
static void note_traffic(can_link_t *link)
{
    if (link->state == HAL_CAN_BUS_OFF) {
        link->state = HAL_CAN_ACTIVE;
    }
}

static bool socket_receive(can_link_t *link, hal_can_frame_t *frame)
{
    struct can_frame got;
    ssize_t size;
    while ((size = read(link->fd, &got, sizeof got)) == (ssize_t)sizeof got) {
        if ((got.can_id & CAN_ERR_FLAG) != 0U) {
            take_error(link, &got);
        } else if ((got.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG)) == 0U) {
            *frame = (hal_can_frame_t){.id = (uint16_t)(got.can_id & CAN_SFF_MASK), .length = got.can_dlc};
            memcpy(frame->data, got.data, sizeof frame->data);
            note_traffic(link);
            return true;
        } else {
            /* not for us */
        }
    }
    if (size < 0 &&
        errno == ENODEV) { /* reported once, when the adapter is unplugged; it does not come back */
        link->state = HAL_CAN_BUS_OFF;
    }
    return false;
}

static bool socket_send(can_link_t *link, const hal_can_frame_t *frame)
{
    struct can_frame put = {.can_id = frame->id, .can_dlc = frame->length};
    memcpy(put.data, frame->data, sizeof put.data);
    return write(link->fd, &put, sizeof put) == (ssize_t)sizeof put;
}

const can_backend_t can_socket_backend = {socket_open, socket_receive, socket_send};
