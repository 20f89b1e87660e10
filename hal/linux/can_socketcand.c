/* The side of the server of socketcand's raw mode: < hi >, < open BUS >, < rawmode >, then frames both ways.
 * https://github.com/linux-can/socketcand/blob/master/doc/protocol.md */
#define _GNU_SOURCE
#include "hal/linux/can_backend.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

/* Clients read the response to < rawmode > with one call and discard whatever else is in it. */
#define QUIET_S 0.02

static bool refuse(char *error, size_t error_size, const char *address, const char *what)
{
    snprintf(error, error_size, "socketcand:%s: %s", address, what);
    return false;
}

static bool tcp_open(can_link_t *link, const char *address, char *error, size_t error_size)
{
    char host[64];
    const char *colon = strrchr(address, ':');
    if (colon == NULL || (size_t)(colon - address) >= sizeof host) {
        return refuse(error, error_size, address, "HOST:PORT is wanted, e.g. socketcand:localhost:29536");
    }
    memcpy(host, address, (size_t)(colon - address));
    host[colon - address] = '\0';
    char *end;
    const unsigned long port = strtoul(colon + 1, &end, 10);
    if (end == colon + 1 || *end != '\0' || port > 65535UL) {
        return refuse(error, error_size, address, "a port is a number up to 65535");
    }
    const struct addrinfo hints = {.ai_family = AF_INET, .ai_socktype = SOCK_STREAM};
    struct addrinfo *found = NULL;
    const int problem = getaddrinfo(host, colon + 1, &hints, &found);
    if (problem != 0) {
        return refuse(error, error_size, address, gai_strerror(problem));
    }
    const int on = 1;
    link->fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    bool well = link->fd >= 0 && setsockopt(link->fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
                bind(link->fd, found->ai_addr, found->ai_addrlen) == 0 && listen(link->fd, 1) == 0;
    const int reason = errno;
    freeaddrinfo(found);
    struct sockaddr_in bound = {0};
    socklen_t size = sizeof bound;
    if (!well || getsockname(link->fd, (struct sockaddr *)&bound, &size) != 0) {
        return refuse(error, error_size, address, strerror(reason));
    }
    snprintf(link->where, sizeof link->where, "socketcand:%s:%u", host, (unsigned)ntohs(bound.sin_port));
    return true;
}

static void drop_client(can_link_t *link)
{
    close(link->peer);
    link->peer = -1;
    link->started = false;
    link->length = 0;
}

static void say(can_link_t *link, const char *text)
{
    if (send(link->peer, text, strlen(text), MSG_NOSIGNAL) < 0 && errno != EAGAIN) {
        drop_client(link);
    }
}

static void accept_client(can_link_t *link)
{
    link->peer = accept4(link->fd, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (link->peer >= 0) {
        const int on = 1;
        (void)setsockopt(link->peer, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
        say(link, "< hi >");
    }
}

static bool begins(const can_link_t *link, const char *word)
{
    const size_t length = strlen(word);
    return link->length >= length && memcmp(link->text, word, length) == 0;
}

/* < send ID LENGTH B0 B1 ... >, all in hexadecimal */
static bool take_frame(const can_link_t *link, hal_can_frame_t *frame)
{
    char text[CAN_TEXT_MOST + 1];
    memcpy(text, link->text, link->length);
    text[link->length] = '\0';
    char *at = text + strlen("< send ");
    char *end = NULL;
    const unsigned long id = strtoul(at, &end, 16);
    const bool extended = end - at > 3; /* its identifiers have eight digits */
    at = end;
    const unsigned long length = strtoul(at, &end, 10);
    if (end == at || extended || id > 0x7FFU || length > 8U) {
        return false;
    }
    *frame = (hal_can_frame_t){.id = (uint16_t)id, .length = (uint8_t)length};
    for (unsigned n = 0; n < length; n++) {
        at = end;
        const unsigned long byte = strtoul(at, &end, 16);
        if (end == at || byte > 0xFFU) {
            return false;
        }
        frame->data[n] = (uint8_t)byte;
    }
    return true;
}

/* True: it was a frame. */
static bool take_message(can_link_t *link, hal_can_frame_t *frame)
{
    while (link->length > 0 && link->text[0] != '<') { /* line ends between messages */
        memmove(link->text, link->text + 1, --link->length);
    }
    if (begins(link, "< open ")) {
        say(link, "< ok >");
    } else if (begins(link, "< rawmode ")) {
        say(link, "< ok >");
        link->quiet_until_s = can_now_s() + QUIET_S;
        link->started = link->peer >= 0;
    } else if (begins(link, "< send ")) {
        link->quiet_until_s = 0.0; /* it has read our answer */
        return take_frame(link, frame);
    } else {
        /* filters and statistics are not served */
    }
    return false;
}

static bool tcp_receive(can_link_t *link, hal_can_frame_t *frame)
{
    if (link->peer < 0) {
        accept_client(link);
    }
    bool closed = false;
    while (link->peer >= 0 && can_gather(link, link->peer, '>', &closed)) {
        const bool is_frame = take_message(link, frame);
        link->length = 0;
        if (is_frame) {
            return true;
        }
    }
    if (closed && link->peer >= 0) {
        drop_client(link);
    }
    return false;
}

static bool tcp_send(can_link_t *link, const hal_can_frame_t *frame)
{
    if (link->peer < 0 || !link->started || can_now_s() < link->quiet_until_s) {
        return false;
    }
    struct timespec now;
    char text[CAN_TEXT_MOST];
    clock_gettime(CLOCK_REALTIME, &now);
    int used = snprintf(text, sizeof text, "< frame %03X %lld.%06ld ", frame->id, (long long)now.tv_sec,
                        now.tv_nsec / 1000);
    for (unsigned n = 0; n < frame->length; n++) {
        used += (int)can_put_hex(&text[used], frame->data[n], 2);
    }
    snprintf(&text[used], sizeof text - (size_t)used, " >");
    say(link, text);
    return link->peer >= 0;
}

const can_backend_t can_socketcand_backend = {tcp_open, tcp_receive, tcp_send};
