#include "firmware/app/app.h"
#include "firmware/params/store.h"

_Static_assert(STORE_WORDS * sizeof(uint32_t) <= HAL_STORE_PAGE_SIZE, "a page holds the store");
_Static_assert((uint32_t)DRIVE_PARAM_COUNT <= STORE_PAIRS_MAX, "the store holds all parameters");

static int32_t newest(const hal_t *hal)
{
    return store_newest(hal_store_page(hal, 0), hal_store_page(hal, 1));
}

static bool take(drive_params_t *params, store_pair_t pair)
{
    for (int32_t id = 0; id < (int32_t)DRIVE_PARAM_COUNT; id++) {
        if (store_id(drive_param_table[id].name) == pair.id) {
            drive_param_set(params, (drive_param_id_t)id, pair.value);
            return true;
        }
    }
    return false;
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
        if (!take(params, store_pair(words, (uint32_t)n))) {
            ++*unknown;
        }
    }
    return true;
}

uint32_t app_page(const drive_params_t *params, uint32_t sequence, uint32_t words[])
{
    store_pair_t pairs[DRIVE_PARAM_COUNT];
    for (int32_t id = 0; id < (int32_t)DRIVE_PARAM_COUNT; id++) {
        pairs[id] = (store_pair_t){.id = store_id(drive_param_table[id].name),
                                   .value = drive_param_get(params, (drive_param_id_t)id)};
    }
    return store_make(words, sequence, pairs, (uint32_t)DRIVE_PARAM_COUNT);
}

bool app_save(hal_t *hal, const drive_params_t *params)
{
    static uint32_t words[STORE_WORDS]; /* too large for the stack */
    const int32_t old = newest(hal);
    uint32_t page = 0;
    uint32_t sequence = 1;
    if (old >= 0) {
        page = 1U - (uint32_t)old;
        sequence += store_sequence(hal_store_page(hal, (uint32_t)old));
    }
    const uint32_t bytes = 4U * app_page(params, sequence, words);
    return bytes > 0U && hal_store_erase(hal, page) && hal_store_write(hal, page, 0, words, bytes) &&
           newest(hal) == (int32_t)page;
}
