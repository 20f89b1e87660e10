#include "firmware/can/dictionary.h"

#include <stddef.h>

#include "firmware/params/parameters.h"

od_values_t od_values_of(const od_entry_t *entry)
{
    if (entry->kind == (uint8_t)OD_PARAMETER) {
        const drive_param_info_t *info = &drive_param_table[entry->slot];
        return (od_values_t){.least = info->min, .preset = info->def, .most = info->max};
    }
    if ((entry->flags & (uint32_t)OD_RANGE) == 0U) {
        return (od_values_t){.preset = od_presets[entry->values]};
    }
    return od_values[entry->values];
}

const od_entry_t *od_find(uint16_t index, uint8_t sub, bool *has_index)
{
    const uint32_t wanted = (uint32_t)index * 256U + sub;
    uint32_t first = 0;
    uint32_t end = od_count;
    while (first < end) {
        const uint32_t middle = (first + end) / 2U;
        const od_entry_t *entry = &od_table[middle];
        if ((uint32_t)entry->index * 256U + entry->sub < wanted) {
            first = middle + 1U;
        } else {
            end = middle;
        }
    }
    /* rows of one index stand together: at `first` or before it */
    const bool here = first < od_count && od_table[first].index == index;
    *has_index = here || (first > 0U && od_table[first - 1U].index == index);
    return (here && od_table[first].sub == sub) ? &od_table[first] : NULL;
}

uint8_t od_size(const od_entry_t *entry)
{
    switch ((od_type_t)entry->type) {
    case OD_I8:
    case OD_U8:
        return 1;
    case OD_I16:
    case OD_U16:
        return 2;
    case OD_I32:
    case OD_U32:
        return 4;
    case OD_STRING:
    case OD_DOMAIN:
    default:
        return 0;
    }
}
