/* Process data: mapping, and what is received. */
#include "firmware/can/node_parts.h"

#include <string.h>

#define COB_OFF       0x80000000U
#define COB_ID        0x000007FFU
#define TYPE_EVENT    254U /* and above: no SYNC */
#define CODE_SHORT    0x8210U
#define CODE_LONG     0x8220U
#define CODE_TIME_OUT 0x8250U

_Static_assert((int)OD_NODE_MAPPINGS == 2 * (int)NODE_PDOS * (int)NODE_MAPPED, "each PDO has its places");

/* A mapping is index, sub-index and bits. */
uint32_t pdo_mappable(uint32_t mapping, bool receive)
{
    const od_entry_t *entry;
    const uint32_t code = object_find((uint16_t)(mapping >> 16), (uint8_t)((mapping >> 8) & 0xFFU), &entry);
    if (code != SDO_OK) {
        return code;
    }
    const uint32_t flag = receive ? OD_MAP_RX : OD_MAP_TX;
    const bool fits = 8U * od_size(entry) == (mapping & 0xFFU);
    return (fits && (entry->flags & flag) != 0U) ? SDO_OK : SDO_NOT_MAPPABLE;
}

uint32_t pdo_length(const node_t *node, uint16_t map_index, uint32_t count, uint32_t *length)
{
    const bool receive = map_index < (uint16_t)OD_TPDO;
    *length = 0;
    for (uint32_t n = 0; n < count; n++) {
        const uint32_t mapping = object_word(node, map_index, (uint8_t)(n + 1U));
        const uint32_t code = pdo_mappable(mapping, receive);
        if (code != SDO_OK) {
            return code;
        }
        *length += (mapping & 0xFFU) / 8U;
        if (*length > 8U) {
            return SDO_PDO_LENGTH;
        }
    }
    return SDO_OK;
}

const od_entry_t *pdo_object(const node_t *node, const node_pdo_t *pdo, uint32_t n)
{
    const uint32_t number = (uint32_t)(pdo - node->pdo);
    return &od_table[node->mapped[(uint32_t)NODE_MAPPED * number + n]];
}

void pdo_setup(node_t *node, bool receive, uint32_t number)
{
    const uint16_t index = (uint16_t)((receive ? (uint32_t)OD_RPDO : (uint32_t)OD_TPDO) + number);
    const uint16_t map = (uint16_t)((receive ? (uint32_t)OD_RPDO_MAP : (uint32_t)OD_TPDO_MAP) + number);
    node_pdo_t *pdo = &node->pdo[receive ? number : (uint32_t)NODE_PDOS + number];
    const uint32_t cob = object_word(node, index, 1);
    const uint32_t count = object_word(node, map, 0);
    *pdo = (node_pdo_t){
        .type = (uint8_t)object_word(node, index, 2),
        .inhibit_us = receive ? 0U : object_word(node, index, 3) * 100U,
        .event_us = object_word(node, index, 5) * 1000U,
        .last_us = node->now_us,
    };
    uint32_t length;
    const bool maps = count <= (uint32_t)NODE_MAPPED && pdo_length(node, map, count, &length) == SDO_OK;
    pdo->count = maps ? (uint8_t)count : 0U;
    pdo->length = maps ? (uint8_t)length : 0U;
    pdo->id = (pdo->count > 0U && (cob & COB_OFF) == 0U) ? (uint16_t)(cob & COB_ID) : 0U;
}

void pdo_start(node_t *node)
{
    for (uint32_t n = 0; n < (uint32_t)NODE_PDOS; n++) {
        node_pdo_t *sent = &node->pdo[(uint32_t)NODE_PDOS + n];
        node->pdo[n].timed = false;
        node->pdo[n].waiting = false;
        sent->timed = false;
        sent->waiting = true;
        sent->syncs = 0;
    }
}

/* A refused value leaves the old one; the others are applied all the same. */
static void apply(node_t *node, const node_pdo_t *pdo)
{
    uint32_t at = 0;
    for (uint32_t n = 0; n < pdo->count; n++) {
        const od_entry_t *entry = pdo_object(node, pdo, n);
        (void)object_put(node, entry, object_from_bytes(entry, &pdo->data[at]));
        at += od_size(entry);
    }
}

static void receive_one(node_t *node, node_pdo_t *pdo, uint32_t number, const node_frame_t *frame)
{
    if (frame->length < pdo->length) {
        node_error(node, NODE_ERROR_LENGTH, CODE_SHORT, number);
        return;
    }
    node_error(node, NODE_ERROR_LENGTH, frame->length > pdo->length ? (uint16_t)CODE_LONG : 0U, number);
    node_error(node, NODE_ERROR_RPDO, 0, number);
    node_hear(node);
    (void)memcpy(pdo->data, frame->data, sizeof pdo->data);
    pdo->last_us = node->now_us;
    pdo->timed = true;
    if (pdo->type < TYPE_EVENT) {
        pdo->waiting = true;
    } else {
        apply(node, pdo);
    }
}

void pdo_receive(node_t *node, const node_frame_t *frame)
{
    for (uint32_t n = 0; n < (uint32_t)NODE_PDOS; n++) {
        if (node->pdo[n].id == frame->id && frame->id != 0U) {
            receive_one(node, &node->pdo[n], n + 1U, frame);
        }
    }
}

void pdo_sync(node_t *node)
{
    for (uint32_t n = 0; n < (uint32_t)NODE_PDOS; n++) {
        if (node->pdo[n].waiting && node->pdo[n].id != 0U) {
            node->pdo[n].waiting = false;
            apply(node, &node->pdo[n]);
        }
    }
    pdo_transmit_sync(node);
}

void pdo_run(node_t *node)
{
    for (uint32_t n = 0; n < (uint32_t)NODE_PDOS; n++) {
        node_pdo_t *pdo = &node->pdo[n];
        if (pdo->timed && pdo->event_us > 0U && node_elapsed(node, pdo->last_us, pdo->event_us)) {
            pdo->timed = false;
            if (node_host_on(node->context)) {
                node_alarm(node, NODE_ERROR_RPDO, CODE_TIME_OUT);
            }
        }
    }
    pdo_transmit_run(node);
}
