/* Classic CAN frames with 11-bit identifiers. Step 6 of docs/porting.md; without it the rest runs. */
#include "hal/template/port.h"

/* The receive interrupt fills a ring of at least 16 frames; here one is taken out. Remote frames and 29-bit
 * identifiers are left out before. */
bool hal_can_receive(hal_t *hal, hal_can_frame_t *frame)
{
    (void)hal;
    *frame = (hal_can_frame_t){0};
    return false;
}

/* Into a queue that keeps the order; false when it is full. */
bool hal_can_send(hal_t *hal, const hal_can_frame_t *frame)
{
    (void)hal;
    (void)frame;
    return false;
}

/* From the controller's error state; when it is off the bus, also ask it to come back. */
hal_can_state_t hal_can_state(const hal_t *hal)
{
    (void)hal;
    return HAL_CAN_BUS_OFF;
}

uint32_t hal_can_lost(const hal_t *hal)
{
    (void)hal;
    return 0;
}
