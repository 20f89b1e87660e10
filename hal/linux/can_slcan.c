/* The side of the adapter of the serial-line protocol: tIIILDD..., O opens, C closes, carriage returns. */
#define _GNU_SOURCE
#include "hal/linux/can_backend.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

static bool refuse(char *error, size_t error_size, const char *path, const char *what)
{
    snprintf(error, error_size, "slcan:%s: %s", path, what);
    return false;
}

static bool make_raw(int fd)
{
    struct termios mode;
    if (tcgetattr(fd, &mode) != 0) {
        return false;
    }
    cfmakeraw(&mode);
    return tcsetattr(fd, TCSANOW, &mode) == 0;
}

/* A pseudo-terminal of our own; its far side is kept open, so that peers may come and go. */
static bool make_terminal(can_link_t *link)
{
    link->fd = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (link->fd < 0 || grantpt(link->fd) != 0 || unlockpt(link->fd) != 0 ||
        ptsname_r(link->fd, link->where, sizeof link->where) != 0) {
        return false;
    }
    link->peer = open(link->where, O_RDWR | O_NOCTTY | O_CLOEXEC);
    return link->peer >= 0 && make_raw(link->peer);
}

static bool line_open(can_link_t *link, const char *path, char *error, size_t error_size)
{
    bool well;
    if (path[0] == '\0') {
        well = make_terminal(link);
    } else {
        link->fd = open(path, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
        well = link->fd >= 0 && make_raw(link->fd);
        snprintf(link->where, sizeof link->where, "%s", path);
    }
    return well || refuse(error, error_size, path, strerror(errno));
}

static bool take_frame(const can_link_t *link, hal_can_frame_t *frame)
{
    const char *at = link->text + 1;
    const char *end = link->text + link->length;
    uint32_t id, length;
    if (!can_take_hex(&at, end, 3, &id) || !can_take_hex(&at, end, 1, &length) || id > 0x7FFU ||
        length > 8U) {
        return false;
    }
    *frame = (hal_can_frame_t){.id = (uint16_t)id, .length = (uint8_t)length};
    for (unsigned n = 0; n < length; n++) {
        uint32_t byte;
        if (!can_take_hex(&at, end, 2, &byte)) {
            return false;
        }
        frame->data[n] = (uint8_t)byte;
    }
    return true;
}

static bool line_receive(can_link_t *link, hal_can_frame_t *frame)
{
    bool closed = false;
    while (can_gather(link, link->fd, '\r', &closed)) {
        const char command = link->text[0];
        const bool is_frame = command == 't' && link->started && take_frame(link, frame);
        if (command == 'O' || command == 'C') {
            link->started = command == 'O';
        }
        link->length = 0;
        if (is_frame) {
            return true;
        }
    }
    return false;
}

static bool line_send(can_link_t *link, const hal_can_frame_t *frame)
{
    if (!link->started) {
        return false;
    }
    char text[32] = {'t'};
    size_t used = 1;
    used += can_put_hex(&text[used], frame->id, 3);
    used += can_put_hex(&text[used], frame->length, 1);
    for (unsigned n = 0; n < frame->length; n++) {
        used += can_put_hex(&text[used], frame->data[n], 2);
    }
    text[used++] = '\r';
    return write(link->fd, text, used) == (ssize_t)used;
}

const can_backend_t can_slcan_backend = {line_open, line_receive, line_send};
