/* Layer setting services, slave (CiA 305): node id and bit rate before anything else works.
 * A new node id is in use after a reset of communication, or at once where there was none; a new bit rate
 * after a restart. */
#include "firmware/can/node_parts.h"

enum {
    LSS_SWITCH_GLOBAL = 0x04,
    LSS_CONFIGURE_ID = 0x11,
    LSS_CONFIGURE_RATE = 0x13,
    LSS_STORE = 0x17,
    LSS_SELECT_FIRST = 0x40, /* ... 0x43: vendor, product, revision, serial */
    LSS_SELECT_LAST = 0x43,
    LSS_SELECTED = 0x44,
    LSS_IDENTIFY_UNCONFIGURED = 0x4C,
    LSS_IDENTIFIED = 0x4F,
    LSS_IS_UNCONFIGURED = 0x50,
    LSS_FAST_SCAN = 0x51,
    LSS_INQUIRE_FIRST = 0x5A, /* ... 0x5D: as above */
    LSS_INQUIRE_LAST = 0x5D,
    LSS_INQUIRE_ID = 0x5E,
};

#define LSS_ID          0x7E4U
#define LSS_IDENTITIES  4U
#define SCAN_ALL        0x80U
#define ERROR_RANGE     1U
#define ERROR_STORE     2U
#define ERROR_OPERATION 255U /* manufacturer's: the drive is on */

static void reply(node_t *node, uint8_t command, uint32_t value)
{
    node_frame_t frame = {.id = LSS_ID, .length = 8, .data = {command}};
    le_put(&frame.data[1], 4, value);
    (void)node_send(node, &frame);
}

static uint32_t identity(const node_t *node, uint32_t number)
{
    return object_word(node, OD_IDENTITY, (uint8_t)(number + 1U));
}

static void switch_global(node_t *node, uint8_t mode)
{
    node->lss = (node_lss_t){.configuring = mode == 1U};
    if (mode == 0U && node->id == NODE_NO_ID && node->word[OD_NODE_CAN_NODE_ID] != NODE_NO_ID) {
        node_boot_up(node);
    }
}

static void select_one(node_t *node, uint32_t number, uint32_t value)
{
    node_lss_t *lss = &node->lss;
    if (number == 0U) {
        lss->matched = 0;
    }
    const bool matches = number == lss->matched && value == identity(node, number);
    lss->matched = matches ? (uint8_t)(lss->matched + 1U) : 0U;
    if (lss->matched == LSS_IDENTITIES) {
        *lss = (node_lss_t){.configuring = true};
        reply(node, LSS_SELECTED, 0);
    }
}

/* Bit by bit the master finds the identity of one node that has no id. */
static void scan(node_t *node, const uint8_t data[8])
{
    node_lss_t *lss = &node->lss;
    const uint8_t bit = data[5];
    const uint8_t number = data[6];
    if (node->id != NODE_NO_ID || lss->configuring) {
        return;
    }
    if (bit == SCAN_ALL) {
        lss->position = 0;
        reply(node, LSS_IDENTIFIED, 0);
        return;
    }
    if (bit > 31U || number >= LSS_IDENTITIES || number != lss->position) {
        return;
    }
    const uint32_t difference = identity(node, number) ^ le_get(&data[1], 4);
    if ((difference >> bit) != 0U) {
        return;
    }
    if (bit == 0U) {
        lss->position = data[7];
        lss->configuring = number == LSS_IDENTITIES - 1U && data[7] == 0U;
    }
    reply(node, LSS_IDENTIFIED, 0);
}

static uint32_t configure_id(node_t *node, uint8_t id)
{
    if ((id < 1U || id > 127U) && id != NODE_NO_ID) {
        return ERROR_RANGE;
    }
    node->word[OD_NODE_CAN_NODE_ID] = id;
    return 0;
}

static uint32_t configure_rate(node_t *node, uint8_t table, uint8_t row)
{
    static const uint16_t kbit_s[] = {1000, 0, 500, 250, 125};
    if (table != 0U || row >= sizeof kbit_s / sizeof kbit_s[0] || kbit_s[row] == 0U) {
        return ERROR_RANGE;
    }
    node->word[OD_NODE_CAN_BIT_RATE] = kbit_s[row];
    return 0;
}

static void configure(node_t *node, const uint8_t data[8])
{
    const uint8_t command = data[0];
    uint32_t result = ERROR_OPERATION;
    if (!node_host_on(node->context)) {
        if (command == (uint8_t)LSS_CONFIGURE_ID) {
            result = configure_id(node, data[1]);
        } else if (command == (uint8_t)LSS_CONFIGURE_RATE) {
            result = configure_rate(node, data[1], data[2]);
        } else {
            result = node_host_store(node->context, NODE_GROUP_LSS) == SDO_OK ? 0U : ERROR_STORE;
        }
    }
    reply(node, command, result);
}

/* For the one that is being configured */
static void receive_configuring(node_t *node, const uint8_t data[8])
{
    const uint8_t command = data[0];
    if (command >= (uint8_t)LSS_INQUIRE_FIRST && command <= (uint8_t)LSS_INQUIRE_LAST) {
        reply(node, command, identity(node, (uint32_t)command - (uint32_t)LSS_INQUIRE_FIRST));
    } else if (command == (uint8_t)LSS_INQUIRE_ID) {
        reply(node, command, node->id);
    } else if (command == (uint8_t)LSS_CONFIGURE_ID || command == (uint8_t)LSS_CONFIGURE_RATE ||
               command == (uint8_t)LSS_STORE) {
        configure(node, data);
    } else {
        /* not supported */
    }
}

void lss_receive(node_t *node, const node_frame_t *frame)
{
    const uint8_t command = frame->data[0];
    if (frame->length != 8U) {
        return;
    }
    if (command == (uint8_t)LSS_SWITCH_GLOBAL) {
        switch_global(node, frame->data[1]);
    } else if (command >= (uint8_t)LSS_SELECT_FIRST && command <= (uint8_t)LSS_SELECT_LAST) {
        select_one(node, (uint32_t)command - (uint32_t)LSS_SELECT_FIRST, le_get(&frame->data[1], 4));
    } else if (command == (uint8_t)LSS_FAST_SCAN) {
        scan(node, frame->data);
    } else if (command == (uint8_t)LSS_IDENTIFY_UNCONFIGURED) {
        if (node->id == NODE_NO_ID) {
            reply(node, LSS_IS_UNCONFIGURED, 0);
        }
    } else if (node->lss.configuring) {
        receive_configuring(node, frame->data);
    } else {
        /* for another */
    }
}
