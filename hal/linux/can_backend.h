/* Interface of one kind of CAN link; can_link.c selects by name. */
#ifndef HAL_LINUX_CAN_BACKEND_H
#define HAL_LINUX_CAN_BACKEND_H

#include "hal/linux/can_link.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CAN_TEXT_MOST 128 /* of one message of a text protocol */

typedef struct {
    bool (*open)(can_link_t *link, const char *address, char *error, size_t error_size);
    bool (*receive)(can_link_t *link, hal_can_frame_t *frame);
    bool (*send)(can_link_t *link, const hal_can_frame_t *frame);
} can_backend_t;

struct can_link {
    const can_backend_t *backend;
    int fd;       /* of the bus, the terminal or the listener; -1: none */
    int peer;     /* socketcand: the client, or the far side of our pseudo-terminal; -1: none */
    bool started; /* text protocols: the peer wants frames */
    double quiet_until_s;
    hal_can_state_t state;
    char where[100];
    char text[CAN_TEXT_MOST]; /* the message that is arriving */
    size_t length;
};

extern const can_backend_t can_socket_backend, can_socketcand_backend, can_slcan_backend;

/* Text protocols, can_text.c: bytes of a frame in hexadecimal. */
int can_hex_digit(char c); /* -1: none */
bool can_take_hex(const char **at, const char *end, int digits, uint32_t *value);
size_t can_put_hex(char *at, uint32_t value, int digits);

/* Gathers bytes from fd up to and with `last`; true: link->text[0 ... length) is a whole message. A message
 * that is too long is dropped. *closed: the peer has gone. */
bool can_gather(can_link_t *link, int fd, char last, bool *closed);

double can_now_s(void);

#ifdef __cplusplus
}
#endif

#endif
