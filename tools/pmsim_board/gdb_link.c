#include "tools/pmsim_board/gdb_link.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { INTERRUPT = 3 };

static int listen_on(uint16_t port)
{
    const int on = 1;
    const int listener = socket(AF_INET, SOCK_STREAM, 0);
    const struct sockaddr_in here = {
        .sin_family = AF_INET, .sin_port = htons(port), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    if (listener < 0) {
        return -1;
    }
    (void)setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (bind(listener, (const struct sockaddr *)&here, sizeof here) != 0 || listen(listener, 1) != 0) {
        (void)close(listener);
        return -1;
    }
    return listener;
}

bool gdb_link_open(gdb_link_t *link, uint16_t port, void (*waits)(uint16_t port))
{
    const int on = 1;
    struct sockaddr_in bound;
    socklen_t size = sizeof bound;
    *link = (gdb_link_t){.connection = -1};
    const int listener = listen_on(port);
    if (listener < 0 || getsockname(listener, (struct sockaddr *)&bound, &size) != 0) {
        return false;
    }
    waits(ntohs(bound.sin_port));
    link->connection = accept(listener, NULL, NULL);
    (void)close(listener);
    if (link->connection < 0) {
        return false;
    }
    (void)setsockopt(link->connection, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    return true;
}

void gdb_link_close(gdb_link_t *link)
{
    if (link->connection >= 0) {
        (void)close(link->connection);
        link->connection = -1;
    }
}

static void put(gdb_link_t *link, const char *bytes, size_t count)
{
    while (count > 0 && link->connection >= 0) {
        const ssize_t done = send(link->connection, bytes, count, MSG_NOSIGNAL);
        if (done <= 0) {
            gdb_link_close(link);
            return;
        }
        bytes += done;
        count -= (size_t)done;
    }
}

/* The next byte, or -1 when the client is gone. */
static int get(gdb_link_t *link)
{
    unsigned char byte;
    if (link->connection < 0 || recv(link->connection, &byte, 1, 0) != 1) {
        gdb_link_close(link);
        return -1;
    }
    return byte;
}

static int digit(int character)
{
    static const char digits[] = "0123456789abcdef";
    const char *at = character > 0 ? strchr(digits, character) : NULL;
    return at != NULL ? (int)(at - digits) : -1;
}

/* The rest of a packet behind its '$'. False: damaged, too long or gone. */
static bool get_packet(gdb_link_t *link, char text[GDB_PACKET])
{
    size_t length = 0;
    unsigned sum = 0;
    int byte = get(link);
    while (byte >= 0 && byte != '#') {
        if (length < GDB_PACKET - 1) {
            text[length] = (char)byte;
        }
        length++;
        sum += (unsigned)byte;
        byte = get(link);
    }
    const int high = digit(get(link));
    const int low = digit(get(link));
    if (length >= GDB_PACKET || high < 0 || low < 0 || (sum & 0xFFU) != (unsigned)(16 * high + low)) {
        return false;
    }
    text[length] = '\0';
    return true;
}

bool gdb_link_receive(gdb_link_t *link, char text[GDB_PACKET])
{
    for (;;) {
        switch (get(link)) {
        case -1:
            return false;
        case INTERRUPT:
            strcpy(text, "\x03");
            return true;
        case '-':
            put(link, link->sent, strlen(link->sent));
            break;
        case '$':
            if (get_packet(link, text)) {
                put(link, "+", 1);
                return true;
            }
            put(link, "-", 1);
            break;
        default: /* '+' */
            break;
        }
    }
}

void gdb_link_send(gdb_link_t *link, const char *text)
{
    unsigned sum = 0;
    for (const char *at = text; *at != '\0'; at++) {
        sum += (unsigned char)*at;
    }
    (void)snprintf(link->sent, sizeof link->sent, "$%s#%02x", text, sum & 0xFFU);
    put(link, link->sent, strlen(link->sent));
}

bool gdb_link_interrupted(gdb_link_t *link)
{
    unsigned char byte = '+';
    while (link->connection >= 0 && byte == '+') {
        const ssize_t count = recv(link->connection, &byte, 1, MSG_DONTWAIT | MSG_PEEK);
        if (count == 0) {
            gdb_link_close(link);
        } else if (count < 0) {
            return false;
        } else if (byte == '+') {
            (void)get(link);
        } else {
            /* it is for gdb_link_receive() */
        }
    }
    return true;
}
