#include "firmware/can/node.h"

#include <string.h>

#include "firmware/can/node_parts.h"

enum {
    NMT_START = 1,
    NMT_STOP = 2,
    NMT_PRE_OPERATIONAL = 128,
    NMT_RESET = 129,
    NMT_RESET_COMMUNICATION = 130
};

#define ID_NMT       0x000U
#define ID_SDO       0x600U
#define ID_SDO_REPLY 0x580U
#define ID_HEARTBEAT 0x700U
#define ID_LSS       0x7E5U

#define CODE_NMT       0x8100U
#define CODE_PASSIVE   0x8120U
#define CODE_BUS_OFF   0x8140U
#define CODE_COLLISION 0x8150U

static void drain(node_t *node)
{
    while (node->ring_count > 0U && node_host_send(node->context, &node->ring[node->ring_first])) {
        node->ring_first = (uint8_t)((node->ring_first + 1U) % (uint32_t)NODE_RING);
        node->ring_count--;
    }
}

uint32_t node_room(const node_t *node)
{
    return (uint32_t)NODE_RING - node->ring_count;
}

bool node_send(node_t *node, const node_frame_t *frame)
{
    drain(node);
    if (node->ring_count == 0U && node_host_send(node->context, frame)) {
        return true;
    }
    if (node_room(node) == 0U) {
        node->dropped++;
        return false;
    }
    node->ring[((uint32_t)node->ring_first + node->ring_count) % (uint32_t)NODE_RING] = *frame;
    node->ring_count++;
    return true;
}

void node_alarm(node_t *node, node_error_t source, uint16_t code)
{
    node_error(node, source, code, 0);
    node_host_alarm(node->context, code);
}

void node_lose_master(node_t *node)
{
    const uint32_t behaviour = object_word(node, OD_ERROR_BEHAVIOUR, 1);
    node_lock(node);
    if (behaviour == 2U) {
        node->nmt = NODE_STOPPED;
    } else if (behaviour == 0U && node->nmt == NODE_OPERATIONAL) {
        node->nmt = NODE_PRE_OPERATIONAL;
    } else {
        /* no change */
    }
}

void node_boot_up(node_t *node)
{
    for (uint32_t source = 0; source < (uint32_t)NODE_ERRORS; source++) {
        if (source != (uint32_t)NODE_ERROR_APPLICATION && source != (uint32_t)NODE_ERROR_BUS) {
            node_error(node, (node_error_t)source, 0, 0);
        }
    }
    emcy_forget(node);
    node->sdo = (node_sdo_t){.state = SDO_IDLE};
    node->nmt = NODE_INITIALISING;
    communication_reset(node);
    if (node->id != NODE_NO_ID) {
        const node_frame_t frame = {.id = (uint16_t)(ID_HEARTBEAT + node->id), .length = 1};
        (void)node_send(node, &frame);
        node->nmt = NODE_PRE_OPERATIONAL;
        node->heartbeat_last_us = node->now_us;
    }
}

void node_init(node_t *node, void *context, uint32_t serial, uint32_t now_us)
{
    (void)memset(node, 0, sizeof *node);
    node->context = context;
    node->now_us = now_us;
    node_boot_up(node);
    node->word[OD_NODE_IDENTITY_SERIAL_NUMBER] = serial;
}

/* Losing the master's control is an alarm while the application is on. */
static void leave(node_t *node, node_nmt_t next)
{
    const bool loses = next == NODE_STOPPED || node->nmt == NODE_OPERATIONAL;
    if (loses && node_host_on(node->context)) {
        node_alarm(node, NODE_ERROR_NMT, CODE_NMT);
        emcy_run(node); /* in STOPPED there is none */
    }
    if (next == NODE_STOPPED) {
        node_lock(node);
    }
    node->nmt = next;
}

/* Two nodes with one id would obey the same commands: neither may start until communication is reset. */
static void start(node_t *node)
{
    if (node->nmt != NODE_OPERATIONAL && node->error[NODE_ERROR_COLLISION] == 0U) {
        node->nmt = NODE_OPERATIONAL;
        node_error(node, NODE_ERROR_NMT, 0, 0);
        pdo_start(node);
    }
}

static void nmt_receive(node_t *node, const node_frame_t *frame)
{
    if (frame->length != 2U || (frame->data[1] != 0U && frame->data[1] != node->id)) {
        return;
    }
    node_hear(node);
    switch (frame->data[0]) {
    case NMT_START:
        start(node);
        break;
    case NMT_STOP:
        leave(node, NODE_STOPPED);
        break;
    case NMT_PRE_OPERATIONAL:
        leave(node, NODE_PRE_OPERATIONAL);
        break;
    case NMT_RESET:
        leave(node, NODE_STOPPED);
        node->nmt = NODE_INITIALISING; /* until node_init(), which boots up, if the host returns at all */
        node_host_reset(node->context);
        break;
    case NMT_RESET_COMMUNICATION:
        leave(node, NODE_STOPPED);
        node_boot_up(node);
        break;
    default:
        break;
    }
}

/* Frames that only a node with this id sends: boot-up and heartbeat, responses of its SDO server. */
static bool is_of_namesake(const node_t *node, const node_frame_t *frame)
{
    return (frame->id == ID_HEARTBEAT + node->id && frame->length == 1U) ||
           (frame->id == ID_SDO_REPLY + node->id && frame->length == 8U);
}

/* A running motor is not stopped by a node that somebody connects. */
static void collide(node_t *node)
{
    node_error(node, NODE_ERROR_COLLISION, CODE_COLLISION, 0);
    if (node->nmt == NODE_OPERATIONAL && !node_host_on(node->context)) {
        node->nmt = NODE_PRE_OPERATIONAL;
    }
}

static void process_data(node_t *node, const node_frame_t *frame)
{
    if (node->nmt != NODE_OPERATIONAL) {
        return;
    }
    if (frame->id == node->sync_id) {
        pdo_sync(node);
    } else {
        pdo_receive(node, frame);
    }
}

void node_receive(node_t *node, const node_frame_t *frame, uint32_t now_us)
{
    node->now_us = now_us;
    if (frame->length > 8U) {
        return;
    }
    if (frame->id == ID_LSS) {
        lss_receive(node, frame);
        return;
    }
    if (node->nmt == NODE_INITIALISING) {
        return; /* no node id, so nothing is for it */
    }
    if (frame->id == ID_NMT) {
        nmt_receive(node, frame);
    } else if (is_of_namesake(node, frame)) {
        collide(node);
    } else if (frame->id == ID_SDO + node->id) {
        if (frame->length == 8U && node->nmt != NODE_STOPPED) {
            node_hear(node);
            sdo_receive(node, frame->data);
        }
    } else if (frame->id > ID_HEARTBEAT && frame->id <= ID_HEARTBEAT + 127U) {
        heartbeat_receive(node, frame);
    } else {
        process_data(node, frame);
    }
}

void node_run(node_t *node, uint32_t now_us)
{
    node->now_us = now_us;
    drain(node);
    if (node->nmt == NODE_INITIALISING) {
        return;
    }
    heartbeat_run(node);
    emcy_run(node);
    sdo_run(node);
    if (node->nmt == NODE_OPERATIONAL) {
        pdo_run(node);
    }
}

node_silence_t node_silence(const node_t *node)
{
    const uint32_t time_ms = object_word(node, OD_COMMAND_WATCH, 1);
    if (time_ms == 0U || !node_elapsed(node, node->heard_us, time_ms * 1000U)) {
        return NODE_HEARD;
    }
    return object_word(node, OD_COMMAND_WATCH, 2) == 0U ? NODE_SILENT_OFF : NODE_SILENT_STOP;
}

bool node_busy(const node_t *node)
{
    return node->ring_count > 0U || node->sdo.state == SDO_BLOCK_UPLOAD;
}

void node_bus(node_t *node, node_bus_t state)
{
    if (state == node->bus) {
        return;
    }
    node->bus = state;
    if (state == NODE_BUS_OFF) {
        node_alarm(node, NODE_ERROR_BUS, CODE_BUS_OFF);
        node_lose_master(node);
    } else {
        node_error(node, NODE_ERROR_BUS, state == NODE_BUS_PASSIVE ? (uint16_t)CODE_PASSIVE : 0U, 0);
    }
}

node_nmt_t node_nmt(const node_t *node)
{
    return node->nmt;
}

uint8_t node_id(const node_t *node)
{
    return node->id;
}
