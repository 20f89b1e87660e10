#include "hal/stm32g431/internal.h"
#include "hal/stm32g431/processor.h"
#include "hal/stm32g431/registers/clock.h"

enum {
    FIRST_PAGE = 62, /* the last two of 64 */
    ERASE_US = 50000,
    WRITE_US = 1000,
    PATIENCE_MS = 100, /* of the watchdog: the processor stalls while a page is erased */
    WATCHDOG_MS = 20,
};

#define FLASH_ERRORS                                                                                         \
    (FLASH_SR_OPERR | FLASH_SR_PROGERR | FLASH_SR_WRPERR | FLASH_SR_PGAERR | FLASH_SR_SIZERR |               \
     FLASH_SR_PGSERR | FLASH_SR_MISERR | FLASH_SR_FASTERR)

const uint32_t *hal_store_page(const hal_t *hal, uint32_t page)
{
    (void)hal;
    return port_store[page];
}

static bool begin(const hal_t *hal, uint32_t page)
{
    if (hal_bridge_armed(hal) || page >= HAL_STORE_PAGES || (FLASH.SR & FLASH_SR_BSY) != 0U) {
        return false;
    }
    system_watchdog_period(PATIENCE_MS);
    FLASH.KEYR = FLASH_KEYR_KEY1;
    FLASH.KEYR = FLASH_KEYR_KEY2;
    FLASH.SR = FLASH_ERRORS | FLASH_SR_EOP;
    return true;
}

static bool done(uint32_t most_us)
{
    processor_barrier();
    const bool ready = clock_await(&FLASH.SR, FLASH_SR_BSY, 0U, most_us);
    return ready && (FLASH.SR & FLASH_ERRORS) == 0U;
}

/* The data cache does not see what the controller has done. */
static void end(void)
{
    FLASH.CR = FLASH_CR_LOCK;
    FLASH.ACR &= ~FLASH_ACR_DCEN;
    FLASH.ACR |= FLASH_ACR_DCRST;
    FLASH.ACR &= ~FLASH_ACR_DCRST;
    FLASH.ACR |= FLASH_ACR_DCEN;
    system_watchdog_period(WATCHDOG_MS);
}

bool hal_store_erase(hal_t *hal, uint32_t page)
{
    if (!begin(hal, page)) {
        return false;
    }
    FLASH.CR = FLASH_CR_PER | reg_field(FLASH_CR_PNB, FIRST_PAGE + page);
    FLASH.CR |= FLASH_CR_STRT;
    const bool well = done(ERASE_US);
    end();
    return well;
}

bool hal_store_write(hal_t *hal, uint32_t page, uint32_t offset, const uint32_t *data, uint32_t size)
{
    const bool inside = offset % 8U == 0U && size % 8U == 0U && offset <= HAL_STORE_PAGE_SIZE &&
                        size <= HAL_STORE_PAGE_SIZE - offset;
    if (!inside || !begin(hal, page)) {
        return false;
    }
    FLASH.CR = FLASH_CR_PG;
    bool well = true;
    reg_t *to = &port_store[page][offset / 4U];
    for (uint32_t n = 0; well && n < size / 4U; n += 2U) {
        to[n] = data[n]; /* the controller waits for the second half */
        to[n + 1U] = data[n + 1U];
        well = done(WRITE_US);
    }
    end();
    return well;
}
