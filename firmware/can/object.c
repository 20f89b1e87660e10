/* Numbers of the dictionary, with every check that does not depend on their meaning. */
#include "firmware/can/node_parts.h"

#include <stddef.h>

#define SIGNATURE_SAVE 0x65766173U
#define SIGNATURE_LOAD 0x64616F6CU

uint32_t le_get(const uint8_t bytes[], uint32_t count)
{
    uint32_t value = 0;
    for (uint32_t n = count; n > 0U; n--) {
        value = (value << 8) | bytes[n - 1U];
    }
    return value;
}

void le_put(uint8_t bytes[], uint32_t count, uint32_t value)
{
    uint32_t rest = value;
    for (uint32_t n = 0; n < count; n++) {
        bytes[n] = (uint8_t)(rest & 0xFFU);
        rest >>= 8;
    }
}

uint32_t object_find(uint16_t index, uint8_t sub, const od_entry_t **entry)
{
    bool has_index;
    *entry = od_find(index, sub, &has_index);
    if (*entry != NULL) {
        return SDO_OK;
    }
    return has_index ? SDO_NO_SUB : SDO_NO_OBJECT;
}

int32_t object_preset(const node_t *node, const od_entry_t *entry)
{
    const uint32_t relative = (entry->flags & (uint32_t)OD_NODE_ID) != 0U ? node->id : 0U;
    return (int32_t)((uint32_t)od_values_of(entry).preset + relative);
}

/* A mapping of a PDO is reported as index, sub-index and bits of its object. */
uint32_t object_node_word(const node_t *node, const od_entry_t *entry)
{
    if (entry->slot < (uint32_t)OD_NODE_WORDS) {
        return node->word[entry->slot];
    }
    const od_entry_t *mapped = &od_table[node->mapped[entry->slot - (uint32_t)OD_NODE_WORDS]];
    const uint32_t shown =
        ((uint32_t)mapped->index << 16) | ((uint32_t)mapped->sub << 8) | (8U * od_size(mapped));
    return mapped == od_table ? 0U : shown;
}

void object_set_node_word(node_t *node, const od_entry_t *entry, uint32_t value)
{
    if (entry->slot < (uint32_t)OD_NODE_WORDS) {
        node->word[entry->slot] = value;
    } else {
        const od_entry_t *mapped;
        const bool found =
            object_find((uint16_t)(value >> 16), (uint8_t)((value >> 8) & 0xFFU), &mapped) == SDO_OK;
        node->mapped[entry->slot - (uint32_t)OD_NODE_WORDS] = found ? (uint16_t)(mapped - od_table) : 0U;
    }
}

uint32_t object_word(const node_t *node, uint16_t index, uint8_t sub)
{
    bool has_index;
    const od_entry_t *entry = od_find(index, sub, &has_index);
    if (entry == NULL) {
        return 0;
    }
    return entry->kind == (uint8_t)OD_NODE ? object_node_word(node, entry)
                                           : (uint32_t)object_preset(node, entry);
}

int32_t object_get(const node_t *node, const od_entry_t *entry)
{
    switch ((od_kind_t)entry->kind) {
    case OD_NODE:
        return (int32_t)object_node_word(node, entry);
    case OD_PARAMETER:
    case OD_LIVE:
        return node_host_get(node->context, entry);
    case OD_CONSTANT:
    default:
        return object_preset(node, entry);
    }
}

static bool is_signed(const od_entry_t *entry)
{
    return entry->type <= (uint8_t)OD_I32;
}

int32_t object_from_bytes(const od_entry_t *entry, const uint8_t bytes[])
{
    const uint32_t size = od_size(entry);
    const uint32_t value = le_get(bytes, size);
    uint32_t sign = 0;
    if (entry->type == (uint8_t)OD_I8) {
        sign = 0x80;
    } else if (entry->type == (uint8_t)OD_I16) {
        sign = 0x8000;
    } else {
        /* 32 bits, or no sign */
    }
    return (int32_t)((value ^ sign) - sign);
}

static uint32_t check_range(const od_entry_t *entry, int32_t value)
{
    if ((entry->flags & (uint32_t)OD_RANGE) == 0U) {
        return SDO_OK;
    }
    const od_values_t range = od_values_of(entry);
    const bool low = is_signed(entry) ? value < range.least : (uint32_t)value < (uint32_t)range.least;
    const bool high = is_signed(entry) ? value > range.most : (uint32_t)value > (uint32_t)range.most;
    if (low) {
        return SDO_TOO_LOW;
    }
    return high ? SDO_TOO_HIGH : SDO_OK;
}

/* 1010h and 1011h: sub-index and group agree */
static uint32_t put_signature(const node_t *node, const od_entry_t *entry, uint32_t value)
{
    const bool store = entry->index == (uint16_t)OD_STORE;
    const uint32_t group = (entry->sub == 1U) ? NODE_GROUP_ALL : (uint32_t)entry->sub - 1U;
    if (value != (store ? SIGNATURE_SAVE : SIGNATURE_LOAD)) {
        return SDO_SIGNATURE;
    }
    return store ? node_host_store(node->context, group) : node_host_restore(node->context, group);
}

uint32_t object_check_write(const node_t *node, const od_entry_t *entry)
{
    if ((entry->flags & (uint32_t)OD_WRITE) == 0U) {
        return SDO_READ_ONLY;
    }
    const bool only_off = (entry->flags & (uint32_t)OD_ONLY_OFF) != 0U;
    if (only_off && node_host_on(node->context)) {
        return SDO_STATE;
    }
    return (entry->locked != 0U && node->word[OD_NODE_PARAMETERS_OPEN] == 0U) ? SDO_LOCKED : SDO_OK;
}

uint32_t object_put(node_t *node, const od_entry_t *entry, int32_t value)
{
    uint32_t code = object_check_write(node, entry);
    if (code == SDO_OK) {
        code = check_range(entry, value);
    }
    if (code != SDO_OK) {
        return code;
    }
    switch ((od_kind_t)entry->kind) {
    case OD_NODE:
        return communication_put(node, entry, (uint32_t)value);
    case OD_PARAMETER:
    case OD_LIVE:
        return node_host_put(node->context, entry, value);
    case OD_CONSTANT:
    default:
        return put_signature(node, entry, (uint32_t)value);
    }
}
