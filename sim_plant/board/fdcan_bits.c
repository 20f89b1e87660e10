#include "sim_plant/board/fdcan.h"

#define CRC_BITS    15
#define POLYNOMIAL  0x4599u
#define STUFF_AFTER 5
#define REST        13u /* CRC delimiter, acknowledgement and its delimiter, end of frame, intermission */

typedef struct {
    unsigned bits, crc;
    int same; /* equal bits in a row */
    bool last;
} stream_t;

static void put(stream_t *stream, bool bit)
{
    stream->same = stream->bits > 0u && bit == stream->last ? stream->same + 1 : 1;
    stream->last = bit;
    stream->bits++;
    if (stream->same == STUFF_AFTER) {
        stream->bits++;
        stream->last = !bit;
        stream->same = 1;
    }
}

static void put_field(stream_t *stream, unsigned value, int width, bool into_crc)
{
    for (int n = width - 1; n >= 0; n--) {
        bool bit = value / (1u << n) % 2u == 1u;
        if (into_crc) {
            bool feedback = bit != (stream->crc / (1u << (CRC_BITS - 1)) % 2u == 1u);
            stream->crc = stream->crc * 2u % (1u << CRC_BITS);
            stream->crc ^= feedback ? POLYNOMIAL : 0u;
        }
        put(stream, bit);
    }
}

/* ISO 11898-1: start, identifier, RTR, IDE, r0, length, data, CRC with stuffing; the rest without. */
unsigned fdcan_frame_bits(const fdcan_frame_t *frame)
{
    stream_t stream = {0};
    put_field(&stream, 0u, 1, true);
    put_field(&stream, frame->id, 11, true);
    put_field(&stream, 0u, 3, true);
    put_field(&stream, frame->length, 4, true);
    for (unsigned n = 0; n < frame->length; n++) {
        put_field(&stream, frame->data[n], 8, true);
    }
    put_field(&stream, stream.crc, CRC_BITS, false);
    return stream.bits + REST;
}
