/* Errors: register, history and messages. */
#include "firmware/can/node_parts.h"

#define COB_OFF 0x80000000U
#define COB_ID  0x000007FFU

/* Error register of an error code; generic is always set. */
static uint32_t bits_of(uint32_t code)
{
    if (code >= 0x8100U && code < 0x8300U) {
        return 0x11U; /* communication */
    }
    switch (code >> 12) {
    case 1:
        return 0x01U;
    case 2:
        return 0x03U; /* current */
    case 3:
        return 0x05U; /* voltage */
    case 4:
        return 0x09U; /* temperature */
    default:
        return 0x81U; /* manufacturer's */
    }
}

static uint8_t update_register(node_t *node)
{
    uint32_t bits = 0;
    for (uint32_t source = 0; source < (uint32_t)NODE_ERRORS; source++) {
        bits |= node->error[source] != 0U ? bits_of(node->error[source]) : 0U;
    }
    node->word[OD_NODE_ERROR_REGISTER] = bits;
    return (uint8_t)bits;
}

/* The newest first; sub 0 counts. */
static void remember(node_t *node, uint32_t code, uint32_t info)
{
    uint32_t *count = &node->word[OD_NODE_ERROR_HISTORY_COUNT];
    uint32_t *newest = &node->word[OD_NODE_ERROR_HISTORY_1];
    for (uint32_t n = (uint32_t)NODE_HISTORY - 1U; n > 0U; n--) {
        newest[n] = newest[n - 1U];
    }
    newest[0] = code | ((info & 0xFFFFU) << 16);
    *count += *count < (uint32_t)NODE_HISTORY ? 1U : 0U;
}

static void queue(node_t *node, node_error_t source, uint32_t info)
{
    if (node->emcy_count < (uint8_t)NODE_EMCY) {
        node->emcy[node->emcy_count] =
            (node_emcy_t){.code = node->error[source], .error_register = update_register(node), .info = info};
        node->emcy_count++;
        node->reported[source] = node->error[source];
    }
}

/* Errors that found no room: in the end the master has the present errors, if not every one in between. */
static void catch_up(node_t *node)
{
    for (uint32_t source = 0; source < (uint32_t)NODE_ERRORS; source++) {
        if (node->reported[source] != node->error[source]) {
            queue(node, (node_error_t)source, 0);
        }
    }
}

void emcy_forget(node_t *node)
{
    node->emcy_count = 0;
    for (uint32_t source = 0; source < (uint32_t)NODE_ERRORS; source++) {
        node->reported[source] = node->error[source];
    }
}

void node_error(node_t *node, node_error_t source, uint16_t code, uint32_t info)
{
    if (node->error[source] == code) {
        return;
    }
    node->error[source] = code;
    (void)update_register(node);
    if (code != 0U) {
        remember(node, code, info);
    }
    queue(node, source, info);
}

void emcy_run(node_t *node)
{
    if (node->emcy_count == 0U) {
        catch_up(node);
    }
    const bool allowed = node->nmt == NODE_OPERATIONAL || node->nmt == NODE_PRE_OPERATIONAL;
    if (node->emcy_count == 0U || !allowed) {
        return;
    }
    const uint32_t cob = object_word(node, OD_EMCY_ID, 0);
    const uint32_t inhibit_us = object_word(node, OD_EMCY_INHIBIT, 0) * 100U;
    if ((cob & COB_OFF) != 0U) {
        node->emcy_count = 0;
    } else if (node_elapsed(node, node->emcy_last_us, inhibit_us)) {
        const node_emcy_t *first = &node->emcy[0];
        node_frame_t frame = {.id = (uint16_t)(cob & COB_ID), .length = 8};
        le_put(&frame.data[0], 2, first->code);
        frame.data[2] = first->error_register;
        le_put(&frame.data[3], 4, first->info);
        (void)node_send(node, &frame);
        node->emcy_last_us = node->now_us;
        node->emcy_count--;
        for (uint32_t n = 0; n < node->emcy_count; n++) {
            node->emcy[n] = node->emcy[n + 1U];
        }
    } else {
        /* later */
    }
}
