/* SDO block transfers. Upload: segments are sent as the ring has room, and repeated from the last confirmed
 * one if the client missed some. Download: each segment is held back until the next, because only the end
 * says how many bytes of the last one count. */
#include "firmware/can/node_parts.h"

#include <string.h>

#define SEGMENT     7U
#define LAST        0x80U
#define ABORT       0x80U
#define BLOCK_MOST  127U
#define ROOM_KEPT   4U /* in the ring, for frames that are more urgent */
#define UPLOAD      5U
#define WITH_CRC    0x04U
#define WITH_SIZE   0x02U
#define BEGIN_REPLY 0xC0U

/* CRC of XMODEM, four bits at a time. */
static uint16_t crc_of(uint16_t crc, const uint8_t bytes[], uint32_t count)
{
    static const uint16_t table[16] = {
        0x0000, 0x1021, 0x2042, 0x3063, 0x4084, 0x50A5, 0x60C6, 0x70E7,
        0x8108, 0x9129, 0xA14A, 0xB16B, 0xC18C, 0xD1AD, 0xE1CE, 0xF1EF,
    };
    uint32_t rest = crc;
    for (uint32_t n = 0; n < count; n++) {
        const uint32_t byte = bytes[n];
        rest = ((rest << 4) ^ table[((rest >> 12) ^ (byte >> 4)) & 15U]) & 0xFFFFU;
        rest = ((rest << 4) ^ table[((rest >> 12) ^ byte) & 15U]) & 0xFFFFU;
    }
    return (uint16_t)rest;
}

static uint32_t segment_at(const node_sdo_t *sdo, uint32_t position)
{
    const uint32_t left = sdo->size - position;
    return left < SEGMENT ? left : SEGMENT;
}

static bool is_block(uint8_t block)
{
    return block >= 1U && block <= BLOCK_MOST;
}

static uint32_t begin_upload(node_t *node, const uint8_t request[8])
{
    node_sdo_t *sdo = &node->sdo;
    const uint32_t code = sdo_begin_upload(node, request);
    if (code != SDO_OK) {
        return code;
    }
    if (!is_block(request[4])) {
        return SDO_BLOCK_SIZE;
    }
    sdo->block = request[4];
    sdo->with_crc = (request[0] & WITH_CRC) != 0U;
    sdo->state = SDO_BLOCK_UPLOAD_BEGIN;
    uint8_t reply[8] = {BEGIN_REPLY | WITH_CRC | WITH_SIZE};
    (void)memcpy(&reply[1], sdo->object, sizeof sdo->object);
    le_put(&reply[4], 4, sdo->size);
    sdo_reply(node, reply);
    return SDO_OK;
}

static void send_block(node_t *node)
{
    node->sdo.state = SDO_BLOCK_UPLOAD;
    node->sdo.sequence = 0;
    node->sdo.position = node->sdo.confirmed;
}

void sdo_block_run(node_t *node)
{
    node_sdo_t *sdo = &node->sdo;
    while (sdo->state == SDO_BLOCK_UPLOAD && node_room(node) > ROOM_KEPT) {
        const uint32_t count = segment_at(sdo, sdo->position);
        const bool last = sdo->position + count == sdo->size;
        sdo->sequence++;
        uint8_t segment[8] = {(uint8_t)(sdo->sequence | (last ? LAST : 0U))};
        sdo_fetch(node, sdo->position, &segment[1], count);
        sdo->position += count;
        if (last || sdo->sequence == sdo->block) {
            sdo->state = SDO_BLOCK_UPLOAD_WAIT;
            sdo->last_us = node->now_us;
        }
        sdo_reply(node, segment);
    }
}

static void end_upload(node_t *node)
{
    node_sdo_t *sdo = &node->sdo;
    const uint32_t rest = sdo->size % SEGMENT;
    const uint32_t unused = rest == 0U ? 0U : SEGMENT - rest;
    uint8_t reply[8] = {(uint8_t)(0xC1U | (unused << 2))};
    le_put(&reply[1], 2, sdo->with_crc ? sdo->crc : 0U);
    sdo->state = SDO_BLOCK_UPLOAD_END;
    sdo_reply(node, reply);
}

/* The client has so many segments of the block. */
static uint32_t confirm(node_t *node, uint8_t sequence, uint8_t block)
{
    node_sdo_t *sdo = &node->sdo;
    if (sdo->state != SDO_BLOCK_UPLOAD && sdo->state != SDO_BLOCK_UPLOAD_WAIT) {
        return SDO_COMMAND;
    }
    if (sequence > sdo->sequence) {
        return SDO_SEQUENCE;
    }
    if (!is_block(block)) {
        return SDO_BLOCK_SIZE;
    }
    for (uint32_t n = 0; n < sequence; n++) {
        uint8_t bytes[SEGMENT];
        const uint32_t count = segment_at(sdo, sdo->confirmed);
        sdo_fetch(node, sdo->confirmed, bytes, count);
        sdo->crc = crc_of(sdo->crc, bytes, count);
        sdo->confirmed += count;
    }
    sdo->block = block;
    if (sdo->confirmed == sdo->size) {
        end_upload(node);
    } else {
        send_block(node);
    }
    return SDO_OK;
}

static uint32_t receive_upload(node_t *node, const uint8_t request[8])
{
    const node_sdo_state_t state = node->sdo.state;
    switch (request[0] & 3U) {
    case 0:
        return begin_upload(node, request);
    case 1:
        if (state != SDO_BLOCK_UPLOAD_END) {
            return SDO_COMMAND;
        }
        node->sdo.state = SDO_IDLE;
        return SDO_OK;
    case 2:
        return confirm(node, request[1], request[2]);
    default:
        if (state != SDO_BLOCK_UPLOAD_BEGIN) {
            return SDO_COMMAND;
        }
        send_block(node);
        return SDO_OK;
    }
}

static uint32_t begin_download(node_t *node, const uint8_t request[8])
{
    node_sdo_t *sdo = &node->sdo;
    const uint32_t code = sdo_begin_download(node, request, (request[0] & WITH_SIZE) != 0U);
    if (code != SDO_OK) {
        return code;
    }
    sdo->with_crc = (request[0] & WITH_CRC) != 0U;
    sdo->block = BLOCK_MOST;
    sdo->state = SDO_BLOCK_DOWNLOAD;
    uint8_t reply[8] = {0xA0U | WITH_CRC};
    (void)memcpy(&reply[1], sdo->object, sizeof sdo->object);
    reply[4] = BLOCK_MOST;
    sdo_reply(node, reply);
    return SDO_OK;
}

static uint32_t deliver_held(node_t *node, uint32_t count, bool last)
{
    node_sdo_t *sdo = &node->sdo;
    sdo->crc = crc_of(sdo->crc, sdo->held, count);
    return sdo_deliver(node, sdo->held, count, last);
}

static uint32_t receive_segment(node_t *node, const uint8_t segment[8])
{
    node_sdo_t *sdo = &node->sdo;
    const uint32_t sequence = segment[0] & 0x7FU;
    const bool last = (segment[0] & LAST) != 0U;
    uint32_t code = SDO_OK;
    if (sequence == 0U || sequence > sdo->block) {
        return SDO_SEQUENCE;
    }
    if (sequence ==
        (uint32_t)sdo->sequence + 1U) { /* else an earlier one was lost: the client sends it again */
        if (sdo->held_count > 0U) {
            code = deliver_held(node, sdo->held_count, false);
        }
        (void)memcpy(sdo->held, &segment[1], SEGMENT);
        sdo->held_count = SEGMENT;
        sdo->sequence = (uint8_t)sequence;
        sdo->complete = last;
    }
    if (code == SDO_OK && (last || sequence == sdo->block)) {
        const uint8_t reply[8] = {0xA2, sdo->sequence, BLOCK_MOST};
        sdo->sequence = 0;
        sdo->state = sdo->complete ? SDO_BLOCK_DOWNLOAD_END : SDO_BLOCK_DOWNLOAD;
        sdo_reply(node, reply);
    }
    return code;
}

static uint32_t end_download(node_t *node, const uint8_t request[8])
{
    node_sdo_t *sdo = &node->sdo;
    if (sdo->state != SDO_BLOCK_DOWNLOAD_END) {
        return SDO_COMMAND;
    }
    const uint32_t count = SEGMENT - (((uint32_t)request[0] >> 2) & 7U);
    const uint16_t crc = crc_of(sdo->crc, sdo->held, count);
    if (sdo->with_crc && crc != le_get(&request[1], 2)) {
        return SDO_CRC;
    }
    const uint32_t code = deliver_held(node, count, true);
    if (code == SDO_OK) {
        const uint8_t reply[8] = {0xA1};
        sdo->state = SDO_IDLE;
        sdo_reply(node, reply);
    }
    return code;
}

void sdo_block_receive(node_t *node, const uint8_t request[8])
{
    uint32_t code;
    if (node->sdo.state == SDO_BLOCK_DOWNLOAD) {
        if (request[0] == ABORT) {
            node->sdo.state = SDO_IDLE;
            return;
        }
        code = receive_segment(node, request);
    } else if (((uint32_t)request[0] >> 5) == UPLOAD) {
        code = receive_upload(node, request);
    } else if ((request[0] & 1U) == 0U) {
        code = begin_download(node, request);
    } else {
        code = end_download(node, request);
    }
    if (code != SDO_OK) {
        sdo_abort(node, code);
    }
}
