#include "hal/sim/port.h"

#include <string.h>

const uint32_t *hal_store_page(const hal_t *hal, uint32_t page)
{
    return hal->store[page];
}

/* Flash is programmed by double words. */
#define UNIT 8U

bool hal_store_erase(hal_t *hal, uint32_t page)
{
    if (hal->armed || page >= HAL_STORE_PAGES) {
        return false;
    }
    const bool lost = hal->store_bytes_left == 0U;
    memset(hal->store[page], 0xFF, lost ? HAL_STORE_PAGE_SIZE / 2U : HAL_STORE_PAGE_SIZE);
    return !lost;
}

/* The bytes that were written, and random data in the rest of their double word. */
static void tear(uint8_t *unit, const uint8_t *data, uint32_t written)
{
    for (uint32_t n = 0; n < UNIT; n++) {
        unit[n] = n < written ? data[n] : (uint8_t)(0x5AU + 37U * n + written);
    }
}

bool hal_store_write(hal_t *hal, uint32_t page, uint32_t offset, const uint32_t *data, uint32_t size)
{
    if (hal->armed || page >= HAL_STORE_PAGES || offset % UNIT != 0U || size % UNIT != 0U ||
        offset > HAL_STORE_PAGE_SIZE || size > HAL_STORE_PAGE_SIZE - offset) {
        return false;
    }
    uint8_t *to = (uint8_t *)hal->store[page] + offset;
    const uint8_t *from = (const uint8_t *)data;
    for (uint32_t at = 0; at < size; at += UNIT) {
        if (hal->store_bytes_left < UNIT) {
            if (hal->store_bytes_left > 0U) {
                tear(&to[at], &from[at], hal->store_bytes_left);
            }
            hal->store_bytes_left = 0;
            return false;
        }
        memcpy(&to[at], &from[at], UNIT);
        if (hal->while_storing != NULL) {
            hal->while_storing(hal->app);
        }
        hal->store_bytes_left -= hal->store_bytes_left != UINT32_MAX ? UNIT : 0U;
    }
    return true;
}
