/* Communication objects: which values are valid, and the effects of a new one. */
#include "firmware/can/node_parts.h"

#include <string.h>

#define COB_OFF      0x80000000U
#define COB_BIT_30   0x40000000U /* SYNC: generate; TPDO: no remote requests */
#define COB_EXTENDED 0x20000000U
#define COB_ID       0x000007FFU

#define SIGNATURE_OPEN 0x6E65706FU

typedef struct {
    uint16_t first, last;
} id_range_t;

/* Identifiers that no PDO, SYNC or EMCY may have */
static const id_range_t restricted[] = {
    {0x000, 0x07F}, {0x101, 0x180}, {0x581, 0x5FF}, {0x601, 0x67F}, {0x6E0, 0x6FF}, {0x701, 0x7FF},
};

static bool is_free_id(uint32_t cob)
{
    const uint32_t id = cob & COB_ID;
    for (uint32_t n = 0; n < sizeof restricted / sizeof restricted[0]; n++) {
        if (id >= restricted[n].first && id <= restricted[n].last) {
            return false;
        }
    }
    return (cob & ~(COB_OFF | COB_BIT_30 | COB_ID)) == 0U;
}

/* While it is in use, an identifier can only be switched off. */
static uint32_t check_cob(uint32_t old, uint32_t value)
{
    if ((value & COB_OFF) != 0U) {
        return (value & COB_EXTENDED) != 0U ? SDO_INVALID : SDO_OK;
    }
    const bool in_use = (old & COB_OFF) == 0U;
    const bool same = (old & COB_ID) == (value & COB_ID);
    return (is_free_id(value) && (same || !in_use)) ? SDO_OK : SDO_INVALID;
}

static uint32_t check_consumer(const node_t *node, const od_entry_t *entry, uint32_t value)
{
    const uint32_t id = value >> 16;
    const bool watched = id != 0U && (value & 0xFFFFU) != 0U;
    if (id > 127U) {
        return SDO_INVALID;
    }
    for (uint8_t sub = 1; sub <= (uint8_t)NODE_CONSUMERS; sub++) {
        const uint32_t other = object_word(node, OD_CONSUMER, sub);
        if (watched && sub != entry->sub && (other & 0xFFFFU) != 0U && (other >> 16) == id) {
            return SDO_INCOMPATIBLE;
        }
    }
    return SDO_OK;
}

static uint32_t check_pdo(const node_t *node, const od_entry_t *entry, uint32_t value)
{
    const bool in_use = (object_word(node, entry->index, 1) & COB_OFF) == 0U;
    switch (entry->sub) {
    case 1:
        return check_cob(node->word[entry->slot], value);
    case 2:
        return (value <= 240U || value >= 254U) ? SDO_OK : SDO_INVALID;
    case 3:
        return in_use ? SDO_STATE : SDO_OK;
    default:
        return SDO_OK;
    }
}

static uint32_t check_map(const node_t *node, const od_entry_t *entry, uint32_t value, bool receive)
{
    const uint16_t map = entry->index;
    const uint16_t pdo = (uint16_t)(map - (uint16_t)OD_RPDO_MAP + (uint16_t)OD_RPDO);
    const bool in_use = (object_word(node, pdo, 1) & COB_OFF) == 0U;
    if (in_use || (entry->sub > 0U && object_word(node, map, 0) != 0U)) {
        return SDO_UNSUPPORTED;
    }
    if (entry->sub > 0U) {
        return value == 0U ? SDO_OK : pdo_mappable(value, receive);
    }
    uint32_t length;
    return value > (uint32_t)NODE_MAPPED ? SDO_PDO_LENGTH : pdo_length(node, map, value, &length);
}

/* Number of the PDO that an index belongs to, with its four ranges */
static bool is_pdo(uint16_t index, uint16_t first)
{
    return index >= first && index < first + (uint16_t)NODE_PDOS;
}

static uint32_t check(const node_t *node, const od_entry_t *entry, uint32_t value)
{
    const uint16_t index = entry->index;
    if (index == (uint16_t)OD_ERROR_HISTORY) {
        return value == 0U ? SDO_OK : SDO_INVALID;
    }
    if (index == (uint16_t)OD_SYNC_ID) {
        return ((value & (COB_OFF | COB_BIT_30)) == 0U && is_free_id(value)) ? SDO_OK : SDO_INVALID;
    }
    if (index == (uint16_t)OD_EMCY_ID) {
        return (value & COB_BIT_30) != 0U ? SDO_INVALID : check_cob(node->word[entry->slot], value);
    }
    if (index == (uint16_t)OD_CONSUMER) {
        return check_consumer(node, entry, value);
    }
    if (is_pdo(index, OD_RPDO) || is_pdo(index, OD_TPDO)) {
        return check_pdo(node, entry, value);
    }
    if (is_pdo(index, OD_RPDO_MAP) || is_pdo(index, OD_TPDO_MAP)) {
        return check_map(node, entry, value, is_pdo(index, OD_RPDO_MAP));
    }
    if (entry->slot == (uint16_t)OD_NODE_PARAMETERS_OPEN) {
        return (value == 0U || value == SIGNATURE_OPEN) ? SDO_OK : SDO_SIGNATURE;
    }
    if (entry->slot == (uint16_t)OD_NODE_CAN_BIT_RATE) {
        const bool known = value == 125U || value == 250U || value == 500U || value == 1000U;
        return known ? SDO_OK : SDO_INVALID;
    }
    return SDO_OK;
}

static void follow(node_t *node, uint16_t index)
{
    if (index == (uint16_t)OD_SYNC_ID) {
        node->sync_id = (uint16_t)(object_word(node, OD_SYNC_ID, 0) & COB_ID);
    } else if (index == (uint16_t)OD_CONSUMER || index == (uint16_t)OD_HEARTBEAT) {
        heartbeat_setup(node);
    } else if (is_pdo(index, OD_RPDO) || is_pdo(index, OD_RPDO_MAP)) {
        pdo_setup(node, true, (uint32_t)index & 3U);
    } else if (is_pdo(index, OD_TPDO) || is_pdo(index, OD_TPDO_MAP)) {
        pdo_setup(node, false, (uint32_t)index & 3U);
    } else {
        /* asked for when it is needed */
    }
}

/* Remote frames do not reach the node, and a TPDO says so whatever is written or stored. */
static void set_word(node_t *node, const od_entry_t *entry, uint32_t value)
{
    const bool of_tpdo = is_pdo(entry->index, OD_TPDO) && entry->sub == 1U;
    const bool of_lock = entry->slot == (uint16_t)OD_NODE_PARAMETERS_OPEN && value != 0U;
    object_set_node_word(node, entry, of_tpdo ? value | COB_BIT_30 : (of_lock ? 1U : value));
}

uint32_t communication_put(node_t *node, const od_entry_t *entry, uint32_t value)
{
    const uint32_t code = check(node, entry, value);
    if (code == SDO_OK) {
        set_word(node, entry, value);
        follow(node, entry->index);
    }
    return code;
}

static bool outlives_reset(const od_entry_t *entry)
{
    return entry->slot == (uint16_t)OD_NODE_CAN_NODE_ID || entry->slot == (uint16_t)OD_NODE_CAN_BIT_RATE ||
           entry->index == (uint16_t)OD_IDENTITY || entry->index <= (uint16_t)OD_ERROR_HISTORY;
}

void node_recall(node_t *node, const od_entry_t *entry, int32_t value)
{
    if (entry->kind == (uint8_t)OD_NODE && !(node->recalled && outlives_reset(entry))) {
        const uint32_t relative = (entry->flags & (uint32_t)OD_NODE_ID) != 0U ? node->id : 0U;
        set_word(node, entry, (uint32_t)value + relative);
    }
}

int32_t node_stored(const node_t *node, const od_entry_t *entry)
{
    const uint32_t relative = (entry->flags & (uint32_t)OD_NODE_ID) != 0U ? node->id : 0U;
    return (int32_t)(object_node_word(node, entry) - relative);
}

static void preset_words(node_t *node)
{
    for (uint32_t row = 0; row < od_count; row++) {
        const od_entry_t *entry = &od_table[row];
        node_recall(node, entry, od_values_of(entry).preset);
    }
    node_host_recall(node->context);
}

void communication_reset(node_t *node)
{
    if (!node->recalled) {
        preset_words(node);
        node->recalled = true;
    }
    node->id = (uint8_t)(node->word[OD_NODE_CAN_NODE_ID] & 0xFFU);
    preset_words(node);
    follow(node, OD_SYNC_ID);
    follow(node, OD_HEARTBEAT);
    for (uint16_t n = 0; n < (uint16_t)NODE_PDOS; n++) {
        follow(node, (uint16_t)(OD_RPDO + n));
        follow(node, (uint16_t)(OD_TPDO + n));
    }
}
