/* Heartbeat, produced and consumed. */
#include "firmware/can/node_parts.h"

#define ID_HEARTBEAT 0x700U
#define CODE_LOST    0x8130U
#define MS           1000U

void heartbeat_setup(node_t *node)
{
    node->heartbeat_us = object_word(node, OD_HEARTBEAT, 0) * MS;
    for (uint32_t n = 0; n < (uint32_t)NODE_CONSUMERS; n++) {
        const uint32_t word = object_word(node, OD_CONSUMER, (uint8_t)(n + 1U));
        const uint32_t time_us = (word & 0xFFFFU) * MS;
        node->consumer[n] = (node_consumer_t){
            .id = time_us == 0U ? 0U : (uint8_t)((word >> 16) & 0x7FU),
            .time_us = time_us,
        };
    }
}

void heartbeat_receive(node_t *node, const node_frame_t *frame)
{
    const uint32_t id = (uint32_t)frame->id - ID_HEARTBEAT;
    bool all = true;
    for (uint32_t n = 0; n < (uint32_t)NODE_CONSUMERS; n++) {
        node_consumer_t *consumer = &node->consumer[n];
        if (consumer->id == id && frame->length == 1U) {
            node_hear(node);
            consumer->seen = true;
            consumer->last_us = node->now_us;
        }
        all = all && (consumer->id == 0U || consumer->seen);
    }
    if (all) {
        node_error(node, NODE_ERROR_HEARTBEAT, 0, 0);
    }
}

void heartbeat_run(node_t *node)
{
    for (uint32_t n = 0; n < (uint32_t)NODE_CONSUMERS; n++) {
        node_consumer_t *consumer = &node->consumer[n];
        if (consumer->seen && node_elapsed(node, consumer->last_us, consumer->time_us)) {
            consumer->seen = false;
            node_alarm(node, NODE_ERROR_HEARTBEAT, CODE_LOST);
            node_lose_master(node);
        }
    }
    if (node->heartbeat_us > 0U && node_elapsed(node, node->heartbeat_last_us, node->heartbeat_us)) {
        const node_frame_t frame = {
            .id = (uint16_t)(ID_HEARTBEAT + node->id), .length = 1, .data = {(uint8_t)node->nmt}};
        (void)node_send(node, &frame);
        node->heartbeat_last_us = node->now_us;
    }
}
