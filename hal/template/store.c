/* Two erasable pages. Step 7 of docs/porting.md; without it nothing is stored and the bridge stays off. */
#include "hal/template/port.h"

/* In place of the pages. It begins as erased flash does, so that no parameters are found in it. */
static const uint32_t ERASED[HAL_STORE_PAGE_SIZE / sizeof(uint32_t)] = {UINT32_MAX, UINT32_MAX};

/* The address of the page in flash. */
const uint32_t *hal_store_page(const hal_t *hal, uint32_t page)
{
    (void)hal;
    (void)page;
    return ERASED;
}

/* Refuse while the bridge is armed and for a page that is not there. Erasing may take longer than the
 * watchdog's period: stretch it meanwhile. Flush what caches flash. */
bool hal_store_erase(hal_t *hal, uint32_t page)
{
    (void)hal;
    (void)page;
    return false;
}

/* As above; offset and size are multiples of 8, and end within the page. */
bool hal_store_write(hal_t *hal, uint32_t page, uint32_t offset, const uint32_t *data, uint32_t size)
{
    (void)hal;
    (void)page;
    (void)offset;
    (void)data;
    (void)size;
    return false;
}
