/* Process data that is sent: on SYNC, on a change, by the event timer. */
#include "firmware/can/node_parts.h"

#include <string.h>

#define TYPE_EVENT 254U  /* and above: no SYNC */
#define SCAN_US    1000U /* between checks of the values for a change */

static void collect(node_t *node, const node_pdo_t *pdo, uint8_t data[8])
{
    uint32_t at = 0;
    (void)memset(data, 0, 8);
    for (uint32_t n = 0; n < pdo->count; n++) {
        const od_entry_t *entry = pdo_object(node, pdo, n);
        const uint32_t size = od_size(entry);
        le_put(&data[at], size, (uint32_t)object_get(node, entry));
        at += size;
    }
}

static void transmit(node_t *node, node_pdo_t *pdo)
{
    node_frame_t frame = {.id = pdo->id, .length = pdo->length};
    collect(node, pdo, frame.data);
    (void)memcpy(pdo->data, frame.data, sizeof pdo->data);
    pdo->last_us = node->now_us;
    pdo->timed = true;
    pdo->waiting = false;
    pdo->syncs = 0;
    (void)node_send(node, &frame);
}

static bool changed(node_t *node, const node_pdo_t *pdo)
{
    uint8_t data[8];
    collect(node, pdo, data);
    return memcmp(data, pdo->data, sizeof data) != 0;
}

void pdo_transmit_sync(node_t *node)
{
    for (uint32_t n = 0; n < (uint32_t)NODE_PDOS; n++) {
        node_pdo_t *pdo = &node->pdo[(uint32_t)NODE_PDOS + n];
        if (pdo->id == 0U || pdo->type >= TYPE_EVENT) {
            continue;
        }
        pdo->syncs = (uint8_t)(pdo->syncs + 1U);
        if (pdo->type == 0U ? pdo->waiting : pdo->syncs >= pdo->type) {
            transmit(node, pdo);
        }
    }
}

void pdo_transmit_run(node_t *node)
{
    const bool scan = node_elapsed(node, node->scan_us, SCAN_US);
    if (scan) {
        node->scan_us = node->now_us;
    }
    for (uint32_t n = 0; n < (uint32_t)NODE_PDOS; n++) {
        node_pdo_t *pdo = &node->pdo[(uint32_t)NODE_PDOS + n];
        if (pdo->id == 0U || (pdo->type > 0U && pdo->type < TYPE_EVENT)) {
            continue;
        }
        if (pdo->event_us > 0U && node_elapsed(node, pdo->last_us, pdo->event_us)) {
            pdo->waiting = true;
        }
        const bool held = pdo->timed && !node_elapsed(node, pdo->last_us, pdo->inhibit_us);
        if (scan && !held && !pdo->waiting) {
            pdo->waiting = changed(node, pdo);
        }
        if (pdo->type >= TYPE_EVENT && pdo->waiting && !held) {
            transmit(node, pdo);
        }
    }
}
