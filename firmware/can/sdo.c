/* SDO server: expedited and segmented transfers, and functions shared with block transfers. */
#include "firmware/can/node_parts.h"

#include <string.h>

enum {
    CLIENT_DOWNLOAD_SEGMENT,
    CLIENT_DOWNLOAD,
    CLIENT_UPLOAD,
    CLIENT_UPLOAD_SEGMENT,
    CLIENT_ABORT,
    CLIENT_BLOCK_UPLOAD,
    CLIENT_BLOCK_DOWNLOAD,
};

#define ID_REPLY   0x580U
#define TIMEOUT_US 1000000U
#define TOGGLE     0x10U

#define SERVER_UPLOAD           0x40U
#define SERVER_EXPEDITED        0x43U /* upload, size indicated */
#define SERVER_DOWNLOAD         0x60U
#define SERVER_DOWNLOAD_SEGMENT 0x20U
#define SERVER_ABORT            0x80U
#define SIZED                   0x01U
#define EXPEDITED               0x02U

void sdo_reply(node_t *node, const uint8_t reply[8])
{
    node_frame_t frame = {.id = (uint16_t)(ID_REPLY + node->id), .length = 8};
    (void)memcpy(frame.data, reply, sizeof frame.data);
    (void)node_send(node, &frame);
}

static void reply_about(node_t *node, uint8_t command, uint32_t value)
{
    const node_sdo_t *sdo = &node->sdo;
    uint8_t reply[8] = {command, sdo->object[0], sdo->object[1], sdo->object[2]};
    le_put(&reply[4], 4, value);
    sdo_reply(node, reply);
}

void sdo_abort(node_t *node, uint32_t code)
{
    node->sdo.state = SDO_IDLE;
    reply_about(node, SERVER_ABORT, code);
}

static bool is_number(const od_entry_t *entry)
{
    return od_size(entry) > 0U;
}

static uint32_t begin(node_t *node, const uint8_t request[8])
{
    node_sdo_t *sdo = &node->sdo;
    *sdo = (node_sdo_t){.state = SDO_IDLE, .last_us = node->now_us};
    (void)memcpy(sdo->object, &request[1], sizeof sdo->object);
    return object_find((uint16_t)le_get(&request[1], 2), request[3], &sdo->entry);
}

uint32_t sdo_begin_upload(node_t *node, const uint8_t request[8])
{
    node_sdo_t *sdo = &node->sdo;
    const uint32_t code = begin(node, request);
    if (code != SDO_OK) {
        return code;
    }
    const od_entry_t *entry = sdo->entry;
    if ((entry->flags & (uint32_t)OD_READ) == 0U) {
        return SDO_WRITE_ONLY;
    }
    if (is_number(entry)) {
        sdo->size = od_size(entry);
        le_put(sdo->number, 4, (uint32_t)object_get(node, entry));
    } else if (entry->kind == (uint8_t)OD_CONSTANT) {
        sdo->size = od_bytes[entry->slot].size;
    } else {
        sdo->size = node_host_size(node->context, entry);
    }
    return sdo->size == 0U ? SDO_NO_DATA : SDO_OK;
}

void sdo_fetch(const node_t *node, uint32_t position, uint8_t bytes[], uint32_t count)
{
    const node_sdo_t *sdo = &node->sdo;
    if (is_number(sdo->entry)) {
        (void)memcpy(bytes, &sdo->number[position], count);
    } else if (sdo->entry->kind == (uint8_t)OD_CONSTANT) {
        (void)memcpy(bytes, &od_bytes[sdo->entry->slot].bytes[position], count);
    } else {
        node_host_read(node->context, sdo->entry, position, bytes, count);
    }
}

static void upload(node_t *node, const uint8_t request[8])
{
    node_sdo_t *sdo = &node->sdo;
    const uint32_t code = sdo_begin_upload(node, request);
    if (code != SDO_OK) {
        sdo_abort(node, code);
    } else if (sdo->size <= 4U) {
        uint8_t bytes[4] = {0};
        sdo_fetch(node, 0, bytes, sdo->size);
        const uint32_t unused = 4U - sdo->size;
        const uint32_t command = SERVER_EXPEDITED | (unused << 2);
        reply_about(node, (uint8_t)command, le_get(bytes, 4));
    } else {
        sdo->state = SDO_UPLOAD;
        reply_about(node, SERVER_UPLOAD | SIZED, sdo->size);
    }
}

static void upload_segment(node_t *node, const uint8_t request[8])
{
    node_sdo_t *sdo = &node->sdo;
    if (sdo->state != SDO_UPLOAD) {
        sdo_abort(node, SDO_COMMAND);
        return;
    }
    if ((request[0] & TOGGLE) != sdo->toggle) {
        sdo_abort(node, SDO_TOGGLE);
        return;
    }
    const uint32_t left = sdo->size - sdo->position;
    const uint32_t count = left < 7U ? left : 7U;
    const bool last = left <= 7U;
    const uint32_t unused = 7U - count;
    uint8_t reply[8] = {(uint8_t)(sdo->toggle | (unused << 1) | (last ? 1U : 0U))};
    sdo_fetch(node, sdo->position, &reply[1], count);
    sdo->position += count;
    sdo->toggle ^= TOGGLE;
    if (last) {
        sdo->state = SDO_IDLE;
    }
    sdo_reply(node, reply);
}

uint32_t sdo_begin_download(node_t *node, const uint8_t request[8], bool sized)
{
    node_sdo_t *sdo = &node->sdo;
    uint32_t code = begin(node, request);
    if (code == SDO_OK) {
        code = object_check_write(node, sdo->entry);
    }
    if (code != SDO_OK) {
        return code;
    }
    if (sized) {
        sdo->size = le_get(&request[4], 4);
    }
    if (!is_number(sdo->entry)) {
        return SDO_OK;
    }
    const uint32_t wanted = od_size(sdo->entry);
    if (sized && sdo->size != wanted) {
        return sdo->size > wanted ? SDO_TOO_LONG : SDO_TOO_SHORT;
    }
    sdo->size = wanted;
    return SDO_OK;
}

uint32_t sdo_deliver(node_t *node, const uint8_t bytes[], uint32_t count, bool last)
{
    node_sdo_t *sdo = &node->sdo;
    const uint32_t at = sdo->position;
    sdo->position += count;
    if (sdo->size > 0U && sdo->position > sdo->size) {
        return SDO_TOO_LONG;
    }
    if (last && sdo->position < sdo->size) {
        return SDO_TOO_SHORT;
    }
    if (!is_number(sdo->entry)) {
        return node_host_write(node->context, sdo->entry, at, bytes, count, last);
    }
    (void)memcpy(&sdo->number[at], bytes, count);
    return last ? object_put(node, sdo->entry, object_from_bytes(sdo->entry, sdo->number)) : SDO_OK;
}

static uint32_t download_expedited(node_t *node, const uint8_t request[8])
{
    const bool sized = (request[0] & SIZED) != 0U;
    const uint32_t code = sdo_begin_download(node, request, false);
    if (code != SDO_OK) {
        return code;
    }
    uint32_t count = 4U - (((uint32_t)request[0] >> 2) & 3U);
    if (!sized) {
        count = is_number(node->sdo.entry) ? node->sdo.size : 4U;
    }
    return sdo_deliver(node, &request[4], count, true);
}

static void download(node_t *node, const uint8_t request[8])
{
    const bool expedited = (request[0] & EXPEDITED) != 0U;
    const uint32_t code = expedited ? download_expedited(node, request)
                                    : sdo_begin_download(node, request, (request[0] & SIZED) != 0U);
    if (code != SDO_OK) {
        sdo_abort(node, code);
        return;
    }
    node->sdo.state = expedited ? SDO_IDLE : SDO_DOWNLOAD;
    reply_about(node, SERVER_DOWNLOAD, 0);
}

static void download_segment(node_t *node, const uint8_t request[8])
{
    node_sdo_t *sdo = &node->sdo;
    if (sdo->state != SDO_DOWNLOAD) {
        sdo_abort(node, SDO_COMMAND);
        return;
    }
    if ((request[0] & TOGGLE) != sdo->toggle) {
        sdo_abort(node, SDO_TOGGLE);
        return;
    }
    const bool last = (request[0] & 1U) != 0U;
    const uint32_t count = 7U - (((uint32_t)request[0] >> 1) & 7U);
    const uint32_t code = sdo_deliver(node, &request[1], count, last);
    if (code != SDO_OK) {
        sdo_abort(node, code);
        return;
    }
    const uint8_t reply[8] = {(uint8_t)(SERVER_DOWNLOAD_SEGMENT | sdo->toggle)};
    sdo->toggle ^= TOGGLE;
    if (last) {
        sdo->state = SDO_IDLE;
    }
    sdo_reply(node, reply);
}

void sdo_receive(node_t *node, const uint8_t request[8])
{
    const uint32_t command = (uint32_t)request[0] >> 5;
    node->sdo.last_us = node->now_us;
    if (node->sdo.state == SDO_BLOCK_DOWNLOAD || command == (uint32_t)CLIENT_BLOCK_UPLOAD ||
        command == (uint32_t)CLIENT_BLOCK_DOWNLOAD) {
        sdo_block_receive(node, request);
        return;
    }
    switch (command) {
    case CLIENT_DOWNLOAD_SEGMENT:
        download_segment(node, request);
        break;
    case CLIENT_DOWNLOAD:
        download(node, request);
        break;
    case CLIENT_UPLOAD:
        upload(node, request);
        break;
    case CLIENT_UPLOAD_SEGMENT:
        upload_segment(node, request);
        break;
    case CLIENT_ABORT:
        node->sdo.state = SDO_IDLE;
        break;
    default:
        sdo_abort(node, SDO_COMMAND);
        break;
    }
}

void sdo_run(node_t *node)
{
    const node_sdo_t *sdo = &node->sdo;
    if (sdo->state == SDO_BLOCK_UPLOAD) {
        sdo_block_run(node);
    } else if (sdo->state != SDO_IDLE && node_elapsed(node, sdo->last_us, TIMEOUT_US)) {
        sdo_abort(node, SDO_TIMEOUT);
    } else {
        /* the client's turn */
    }
}
