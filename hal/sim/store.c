#include "hal/sim/port.h"

#include <string.h>

const uint32_t *hal_store_page(const hal_t *hal, uint32_t page)
{
    return hal->store[page];
}

bool hal_store_erase(hal_t *hal, uint32_t page)
{
    if (hal->armed || page >= HAL_STORE_PAGES || hal->store_words_left == 0U) {
        return false;
    }
    memset(hal->store[page], 0xFF, HAL_STORE_PAGE_SIZE);
    return true;
}

bool hal_store_write(hal_t *hal, uint32_t page, uint32_t offset, const uint32_t *data, uint32_t size)
{
    if (hal->armed || page >= HAL_STORE_PAGES || offset % 8U != 0U || size % 8U != 0U ||
        offset > HAL_STORE_PAGE_SIZE || size > HAL_STORE_PAGE_SIZE - offset) {
        return false;
    }
    for (uint32_t n = 0; n < size / 4U; n++) {
        if (hal->store_words_left == 0U) {
            return false;
        }
        if (hal->store_words_left != UINT32_MAX) {
            hal->store_words_left--;
        }
        hal->store[page][offset / 4U + n] = data[n];
    }
    return true;
}
