#include "hal/sim/port.h"

#include <string.h>

const uint32_t *hal_store_page(const hal_t *hal, uint32_t page)
{
    return hal->store[page];
}

/* Flash is programmed by double words. */
#define UNIT 8U

/* One bit of `wanted` or `was` after the other, by the seed */
static uint8_t mix(uint8_t was, uint8_t wanted, uint32_t *seed)
{
    *seed = *seed * 1664525U + 1013904223U;
    const uint32_t mask = *seed >> 24;
    return (uint8_t)((was & ~mask) | (wanted & mask));
}

void sim_store_settle(hal_t *hal, uint32_t seed)
{
    hal->store_bytes_left = UINT32_MAX;
    for (uint32_t page = 0; page < HAL_STORE_PAGES; page++) {
        const sim_cut_t *cut = &hal->store_cut[page];
        uint8_t *cells = (uint8_t *)hal->store[page] + cut->from;
        uint32_t draw = seed * 2654435761U + page;
        (void)mix(0, 0, &draw);
        const uint32_t way = (draw >> 28) & 3U;
        for (uint32_t n = 0; n < cut->bytes; n++) {
            const uint8_t mixed = mix(cut->was[n], cut->wanted[n], &draw);
            const uint8_t whole = way == 0U ? cut->was[n] : cut->wanted[n];
            cells[n] = way <= 1U ? whole : mixed;
        }
    }
}

static void be_cut(hal_t *hal, uint32_t page, uint32_t from, const uint8_t *wanted, uint32_t bytes)
{
    sim_cut_t *cut = &hal->store_cut[page];
    cut->from = from;
    cut->bytes = bytes;
    memcpy(cut->was, (const uint8_t *)hal->store[page] + from, bytes);
    for (uint32_t n = 0; n < bytes; n++) {
        cut->wanted[n] = wanted == NULL ? 0xFFU : wanted[n];
    }
}

bool hal_store_erase(hal_t *hal, uint32_t page)
{
    if (hal->armed || page >= HAL_STORE_PAGES) {
        return false;
    }
    const bool lost = hal->store_bytes_left == 0U;
    if (lost) {
        be_cut(hal, page, 0, NULL, HAL_STORE_PAGE_SIZE);
    } else {
        hal->store_cut[page].bytes = 0;
    }
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
                be_cut(hal, page, offset + at, &from[at], UNIT);
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
