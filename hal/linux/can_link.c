#define _GNU_SOURCE /* the names of the system */
#include "hal/linux/can_backend.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *after(const char *name, const char *prefix)
{
    const size_t length = strlen(prefix);
    return strncmp(name, prefix, length) == 0 ? name + length : NULL;
}

can_link_t *can_link_open(const char *name, char *error, size_t error_size)
{
    can_link_t *link = calloc(1, sizeof *link);
    if (link == NULL) {
        abort();
    }
    link->fd = -1;
    link->peer = -1;
    const char *address = name;
    link->backend = &can_socket_backend;
    if (after(name, "socketcand:") != NULL) {
        link->backend = &can_socketcand_backend;
        address = after(name, "socketcand:");
    } else if (after(name, "slcan:") != NULL) {
        link->backend = &can_slcan_backend;
        address = after(name, "slcan:");
    } else {
        /* the name of an interface */
    }
    if (!link->backend->open(link, address, error, error_size)) {
        can_link_close(link);
        return NULL;
    }
    return link;
}

void can_link_close(can_link_t *link)
{
    if (link == NULL) {
        return;
    }
    if (link->peer >= 0) {
        close(link->peer);
    }
    if (link->fd >= 0) {
        close(link->fd);
    }
    free(link);
}

bool can_link_receive(can_link_t *link, hal_can_frame_t *frame)
{
    return link->backend->receive(link, frame);
}

bool can_link_send(can_link_t *link, const hal_can_frame_t *frame)
{
    return link->backend->send(link, frame);
}

hal_can_state_t can_link_state(const can_link_t *link)
{
    return link->state;
}

const char *can_link_where(const can_link_t *link)
{
    return link->where;
}
