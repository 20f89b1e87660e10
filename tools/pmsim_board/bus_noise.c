#include "tools/pmsim_board/bus_noise.h"

#include <stddef.h>

#define LAST_ID 0x7FFU
#define SDO_ID  0x601U

/* Numerical Recipes' generator; its upper bits are the good ones. */
static uint32_t number(bus_noise_t *noise, uint32_t count)
{
    noise->state = noise->state * 1664525U + 1013904223U;
    return (noise->state >> 8) % count;
}

/* Downloads, whole, by segments or by block */
static bool writes(uint32_t sdo_command)
{
    const uint32_t kind = sdo_command >> 5;
    return kind == 0U || kind == 1U || kind == 6U;
}

/* NMT, controlword and targets, SDO downloads, LSS, and the heartbeat of the master that is watched */
static bool commands(const hal_can_frame_t *frame)
{
    return (frame->id == 0x000U && frame->length == 2U) || (frame->id == 0x201U && frame->length >= 7U) ||
           (frame->id == 0x301U && frame->length == 8U) ||
           (frame->id == SDO_ID && frame->length == 8U && writes(frame->data[0])) || frame->id == 0x7E5U ||
           frame->id == 0x77FU;
}

static hal_can_frame_t garbage(bus_noise_t *noise)
{
    static const uint16_t ours[] = {0x000, 0x080, 0x081, 0x181, 0x201, 0x301, SDO_ID, 0x581};
    const uint32_t count = sizeof ours / sizeof ours[0];
    hal_can_frame_t frame = {0};
    do {
        frame.id =
            number(noise, 2) == 0U ? ours[number(noise, count)] : (uint16_t)number(noise, LAST_ID + 1U);
        frame.length = (uint8_t)number(noise, 9);
        for (size_t n = 0; n < sizeof frame.data; n++) {
            frame.data[n] = (uint8_t)number(noise, 256);
        }
    } while (commands(&frame));
    return frame;
}

hal_can_frame_t bus_noise_next(bus_noise_t *noise)
{
    return noise->kind == BUS_GARBAGE ? garbage(noise) : (hal_can_frame_t){.id = LAST_ID};
}
