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
    app_preset(hal, params);
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
 * others. What this version does not know is another's, and stays until all is forgotten. Of the node's objects, over a hundred,
 * those at their presets are left out but for the address: the page would not hold them beside all methods' parameters. */
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
    if (!selection->keep) {
        return false;
    }
    *value = present(selection, entry);
    return entry->kind != (uint8_t)OD_NODE || *value != od_values_of(entry).preset ||
           in_group(entry, NODE_GROUP_LSS);
}

/* Pairs that may be in the new page: a row of the dictionary each, then the old page's */
static uint32_t candidates(const selection_t *selection)
{
    return od_count + (selection->old == NULL ? 0U : (uint32_t)store_check(selection->old));
}

static bool pick(const selection_t *selection, uint32_t candidate, store_pair_t *pair)
{
    if (candidate < od_count) {
        pair->id = id_of(&od_table[candidate]);
        return select_value(selection, &od_table[candidate], &pair->value);
    }
    *pair = store_pair(selection->old, candidate - od_count);
    return (selection->keep || selection->group != NODE_GROUP_ALL) && entry_of(pair->id) == NULL;
}

/* How many there will be, and whether they are those of the old page */
static uint32_t count_pairs(const selection_t *selection, bool *same)
{
    const uint32_t most = candidates(selection);
    const uint32_t before = most - od_count;
    store_pair_t pair;
    uint32_t count = 0;
    *same = selection->old != NULL && store_seals(selection->old) > 0U;
    for (uint32_t n = 0; n < most; n++) {
        if (pick(selection, n, &pair)) {
            const store_pair_t old = *same ? store_pair(selection->old, count) : pair;
            *same = *same && count < before && pair.id == old.id && pair.value == old.value;
            count++;
        }
    }
    *same = *same && count == before;
    return count;
}

/* All but the seal */
static void make_page(const selection_t *selection, uint32_t sequence, sink_t *sink)
{
    const uint32_t most = candidates(selection);
    store_writer_t writer;
    uint32_t words[STORE_HEADER];
    bool same;
    store_begin(&writer, sequence, od_schema, count_pairs(selection, &same), words);
    put_words(sink, words, STORE_HEADER);
    for (uint32_t n = 0; n < most && sink->good; n++) {
        store_pair_t pair;
        if (pick(selection, n, &pair)) {
            store_put(&writer, pair, words);
            put_words(sink, words, 2);
        }
    }
    store_end(&writer, words);
    put_words(sink, words, 2);
}

/* Behind the pairs, the CRC and the seals that are there already */
static bool seal(hal_t *hal, uint32_t page)
{
    const uint32_t *words = hal_store_page(hal, page);
    const uint32_t seals = store_seals(words);
    const uint32_t at = STORE_HEADER + 2U * ((uint32_t)store_check(words) + 1U + seals);
    uint32_t two[2];
    store_seal(two);
    return seals >= STORE_SEALS || hal_store_write(hal, page, 4U * at, two, sizeof two);
}

/* Into the page that is not the newest */
static bool write_page(hal_t *hal, const selection_t *selection, uint32_t page)
{
    sink_t sink = {.hal = hal, .page = page, .good = true};
    if ((selection->old != NULL && !seal(hal, 1U - page)) || !hal_store_erase(hal, page)) {
        return false;
    }
    make_page(selection, selection->old == NULL ? 1U : store_sequence(selection->old) + 1U, &sink);
    const bool whole = sink.good && store_check(hal_store_page(hal, page)) >= 0;
    return whole && seal(hal, page) && newest(hal) == (int32_t)page;
}

/* The page to write, and what the selection adds to */
static uint32_t page_to_write(const hal_t *hal, selection_t *selection)
{
    const int32_t old = newest(hal);
    selection->old = old < 0 ? NULL : hal_store_page(hal, (uint32_t)old);
    return old < 0 ? 0U : 1U - (uint32_t)old;
}

uint32_t app_page(const drive_params_t *params, uint32_t sequence, uint32_t words[])
{
    const selection_t selection = {.params = params, .group = NODE_GROUP_ALL, .keep = true};
    sink_t sink = {.good = true};
    sink.memory = words;
    make_page(&selection, sequence, &sink);
    store_seal(&words[sink.at]);
    return sink.at + 2U;
}

bool app_save(hal_t *hal, const drive_params_t *params)
{
    selection_t selection = {.params = params, .group = NODE_GROUP_ALL, .keep = true};
    const uint32_t page = page_to_write(hal, &selection);
    return write_page(hal, &selection, page);
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

/* Flash wears out: a few saves at once, then one in this time. */
#define SAVES_AT_ONCE 4U
#define SAVE_US       30000000U

static bool may_save(app_t *app)
{
    const uint32_t due = (hal_time_us(app->hal) - app->saved_us) / SAVE_US;
    app->saved_us += due * SAVE_US;
    app->saves = due < app->saves ? app->saves - due : 0U;
    if (app->saves >= SAVES_AT_ONCE) {
        return false;
    }
    app->saves++;
    return true;
}

uint32_t app_store_group(app_t *app, uint32_t group, bool keep)
{
    selection_t selection = {.app = app, .params = &app->params, .group = group, .keep = keep};
    const uint32_t page = page_to_write(app->hal, &selection);
    bool same;
    const uint32_t count = count_pairs(&selection, &same);
    if (same) {
        return 0;
    }
    if (count > STORE_PAIRS_MAX) {
        return SDO_MEMORY;
    }
    if (!may_save(app)) {
        return SDO_STATE;
    }
    set_storing(app, true);
    const bool done = write_page(app->hal, &selection, page);
    set_storing(app, false);
    return done ? 0U : SDO_HARDWARE;
}
