#define _GNU_SOURCE
#include "hal/linux/can_backend.h"

#include <errno.h>
#include <time.h>
#include <unistd.h>

int can_hex_digit(char c)
{
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    if (c >= 'A' && c <= 'F') {
        return c - 'A' + 10;
    }
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

bool can_take_hex(const char **at, const char *end, int digits, uint32_t *value)
{
    *value = 0;
    for (int n = 0; n < digits; n++) {
        const int digit = *at < end ? can_hex_digit(**at) : -1;
        if (digit < 0) {
            return false;
        }
        *value = *value * 16U + (uint32_t)digit;
        ++*at;
    }
    return true;
}

size_t can_put_hex(char *at, uint32_t value, int digits)
{
    for (int n = digits - 1; n >= 0; n--) {
        at[n] = "0123456789ABCDEF"[value % 16U];
        value /= 16U;
    }
    return (size_t)digits;
}

bool can_gather(can_link_t *link, int fd, char last, bool *closed)
{
    char c;
    *closed = false;
    for (;;) {
        const ssize_t got = read(fd, &c, 1);
        if (got <= 0) {
            *closed = got == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR);
            return false;
        }
        if (link->length < CAN_TEXT_MOST) {
            link->text[link->length] = c;
        }
        link->length++; /* beyond the end: too long */
        if (c == last) {
            const bool whole = link->length <= CAN_TEXT_MOST;
            if (whole) {
                return true;
            }
            link->length = 0;
        }
    }
}

double can_now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}
