/* Contents of flash: all objects that the dictionary marks as stored, by group. */
#include <stddef.h>

#include "firmware/app/app_parts.h"
#include "firmware/params/store.h"

_Static_assert(STORE_WORDS * sizeof(uint32_t) <= HAL_STORE_PAGE_SIZE, "a page holds the store");

static int32_t newest(const hal_t *hal)
{
    return store_newest(hal_store_page(hal, 0), hal_store_page(hal, 1));
}

static uint32_t id_of(const od_entry_t *entry)
{
    return (uint32_t)entry->index * 256U + entry->sub;
}

/* NULL: this version does not store it */
static const od_entry_t *entry_of(uint32_t id)
{
    bool has_index;
    const od_entry_t *entry = od_find((uint16_t)(id >> 8), (uint8_t)(id & 0xFFU), &has_index);
    const bool stored = id <= 0xFFFFFFU && entry != NULL && (entry->flags & (uint32_t)OD_STORED) != 0U;
    return stored ? entry : NULL;
}

bool app_stored_value(const hal_t *hal, uint16_t index, uint8_t sub, int32_t *value)
{
    const int32_t page = newest(hal);
    return page >= 0 && store_find(hal_store_page(hal, (uint32_t)page), (uint32_t)index * 256U + sub, value);
}

/* All that describes the machine: with a preset among it the drive would take it for another one. */
static bool has_machine(const uint32_t *words)
{
    int32_t value;
    for (uint32_t row = 0; row < od_count; row++) {
        const od_entry_t *entry = &od_table[row];
        const bool of_machine =
            entry->kind == (uint8_t)OD_PARAMETER && entry->group == (uint8_t)OD_GROUP_MACHINE;
        if (of_machine && !store_find(words, id_of(entry), &value)) {
            return false;
        }
    }
    return true;
}

bool app_load(const hal_t *hal, drive_params_t *params, uint32_t *unknown)
{
    drive_params_default(params);
    *unknown = 0;
    const int32_t page = newest(hal);
    if (page < 0) {
        return false;
    }
    const uint32_t *words = hal_store_page(hal, (uint32_t)page);
    const int32_t count = store_check(words);
    for (int32_t n = 0; n < count; n++) {
        const store_pair_t pair = store_pair(words, (uint32_t)n);
        const od_entry_t *entry = entry_of(pair.id);
        if (entry == NULL) {
            ++*unknown;
        } else if (entry->kind == (uint8_t)OD_PARAMETER) {
            drive_param_set(params, (drive_param_id_t)entry->slot, pair.value);
        } else {
            /* the node's, or the profile's: app_recall() */
        }
    }
    return has_machine(words);
}

void app_recall(app_t *app, od_kind_t kind)
{
    const int32_t page = newest(app->hal);
    if (page < 0) {
        return;
    }
    const uint32_t *words = hal_store_page(app->hal, (uint32_t)page);
    const int32_t count = store_check(words);
    for (int32_t n = 0; n < count; n++) {
        const store_pair_t pair = store_pair(words, (uint32_t)n);
        const od_entry_t *entry = entry_of(pair.id);
        uint32_t code;
        if (entry == NULL || entry->kind != (uint8_t)kind) {
            continue;
        }
        if (kind == OD_NODE) {
            node_recall(&app->node, entry, pair.value);
        } else {
            (void)cia402_put(&app->cia402, entry->slot, pair.value, &code);
        }
    }
}

/* --- writing ----------------------------------------------------------------------------------------- */

/* Destination of words: flash, or with hal NULL memory. */
typedef struct {
    hal_t *hal;
    uint32_t *memory;
    uint32_t page, at; /* words written */
    bool good;
} sink_t;

static void put_words(sink_t *sink, const uint32_t words[], uint32_t count)
{
    if (sink->hal != NULL) {
        sink->good = sink->good && hal_store_write(sink->hal, sink->page, 4U * sink->at, words, 4U * count);
    } else if (sink->memory != NULL) {
        for (uint32_t n = 0; n < count; n++) {
            sink->memory[sink->at + n] = words[n];
        }
    } else {
        sink->good = false;
    }
    sink->at += count;
}

/* Contents of the new page: the present values of the given groups, and those of the old page for the
 * others. */
typedef struct {
    const app_t *app; /* NULL: parameters alone */
    const drive_params_t *params;
    const uint32_t *old; /* NULL: none */
    uint32_t group;
    bool keep;
} selection_t;

static bool in_group(const od_entry_t *entry, uint32_t group)
{
    const bool lss = entry->kind == (uint8_t)OD_NODE && (entry->slot == (uint16_t)OD_NODE_CAN_NODE_ID ||
                                                         entry->slot == (uint16_t)OD_NODE_CAN_BIT_RATE);
    if (group == NODE_GROUP_LSS) {
        return lss;
    }
    return group == NODE_GROUP_ALL || (uint32_t)entry->group == group;
}

static int32_t present(const selection_t *selection, const od_entry_t *entry)
{
    int32_t value = 0;
    switch ((od_kind_t)entry->kind) {
    case OD_PARAMETER:
        return drive_param_get(selection->params, (drive_param_id_t)entry->slot);
    case OD_NODE:
        return node_stored(&selection->app->node, entry);
    case OD_LIVE:
    case OD_CONSTANT:
    default:
        (void)cia402_get(&selection->app->cia402, entry->slot, &value);
        return value;
    }
}

static bool select_value(const selection_t *selection, const od_entry_t *entry, int32_t *value)
{
    const bool known = selection->app != NULL || entry->kind == (uint8_t)OD_PARAMETER;
    if ((entry->flags & (uint32_t)OD_STORED) == 0U) {
        return false;
    }
    if (!known || !in_group(entry, selection->group)) {
        return selection->old != NULL && store_find(selection->old, id_of(entry), value);
    }
    if (selection->keep) {
        *value = present(selection, entry);
    }
    return selection->keep;
}

static void make_page(const selection_t *selection, uint32_t sequence, sink_t *sink)
{
    store_writer_t writer;
    uint32_t words[STORE_HEADER];
    int32_t value;
    uint32_t count = 0;
    for (uint32_t row = 0; row < od_count; row++) {
        count += select_value(selection, &od_table[row], &value) ? 1U : 0U;
    }
    store_begin(&writer, sequence, od_schema, count, words);
    put_words(sink, words, STORE_HEADER);
    for (uint32_t row = 0; row < od_count && sink->good; row++) {
        if (select_value(selection, &od_table[row], &value)) {
            store_put(&writer, (store_pair_t){.id = id_of(&od_table[row]), .value = value}, words);
            put_words(sink, words, 2);
        }
    }
    store_end(&writer, words);
    put_words(sink, words, 2);
}

static bool write_page(hal_t *hal, selection_t *selection)
{
    const int32_t old = newest(hal);
    uint32_t sequence = 1;
    sink_t sink = {.hal = hal, .good = true};
    if (old >= 0) {
        sink.page = 1U - (uint32_t)old;
        selection->old = hal_store_page(hal, (uint32_t)old);
        sequence += store_sequence(selection->old);
    }
    if (!hal_store_erase(hal, sink.page)) {
        return false;
    }
    make_page(selection, sequence, &sink);
    return sink.good && newest(hal) == (int32_t)sink.page;
}

uint32_t app_page(const drive_params_t *params, uint32_t sequence, uint32_t words[])
{
    const selection_t selection = {.params = params, .group = NODE_GROUP_ALL, .keep = true};
    sink_t sink = {.good = true};
    sink.memory = words;
    make_page(&selection, sequence, &sink);
    return sink.at;
}

bool app_save(hal_t *hal, const drive_params_t *params)
{
    selection_t selection = {.params = params, .group = NODE_GROUP_ALL, .keep = true};
    return write_page(hal, &selection);
}

/* While flash is written it cannot be read: control comes late, even later than the monitor, and what is left
 * of its period is too short for the slow interrupt. The bridge is off meanwhile. */
static void set_storing(app_t *app, bool storing)
{
    hal_lock(app->hal);
    app->storing = storing;
    /* a period that has passed comes again in days */
    app->slow_at = storing ? app->drive.period - 1U : app->drive.period + app->slow_divider;
    hal_unlock(app->hal);
}

bool app_store_group(app_t *app, uint32_t group, bool keep)
{
    selection_t selection = {.app = app, .params = &app->params, .group = group, .keep = keep};
    set_storing(app, true);
    const bool done = write_page(app->hal, &selection);
    set_storing(app, false);
    return done;
}
