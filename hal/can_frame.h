/* A classic CAN frame with an 11-bit identifier, and the state of a controller on its bus. */
#ifndef HAL_CAN_FRAME_H
#define HAL_CAN_FRAME_H

#include <stdint.h>

typedef struct {
    uint16_t id;
    uint8_t length; /* 0 ... 8 */
    uint8_t data[8];
} hal_can_frame_t;

typedef enum { HAL_CAN_ACTIVE, HAL_CAN_PASSIVE, HAL_CAN_BUS_OFF } hal_can_state_t;

#endif
