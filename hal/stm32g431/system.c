#include "hal/stm32g431/internal.h"
#include "hal/stm32g431/processor.h"
#include "hal/stm32g431/registers/clock.h"
#include "hal/stm32g431/registers/core.h"

enum {
    WATCHDOG_MS = 20,
    LSI_PER_MS = 8,      /* 32 kHz, divided by 4 */
    WATCHDOG_US = 10000, /* for its registers to take a value: some cycles of the slow clock */
    GRAVE_MAGIC = 0x600DBEE5,
};

hal_t port_hal;

hal_t *hal_instance(void)
{
    return &port_hal;
}

/* Every internal reset also pulls the pin, so the pin flag means a pin reset only if it is alone. */
static hal_reset_t take_reset_cause(void)
{
    const uint32_t cause = RCC.CSR;
    RCC.CSR = cause | RCC_CSR_RMVF;
    if ((cause & RCC_CSR_IWDGRSTF) != 0U) {
        return HAL_RESET_WATCHDOG;
    }
    if ((cause & RCC_CSR_SFTRSTF) != 0U) {
        return HAL_RESET_SOFTWARE;
    }
    if ((cause & RCC_CSR_BORRSTF) != 0U) {
        return HAL_RESET_POWER;
    }
    return (cause & RCC_CSR_PINRSTF) != 0U ? HAL_RESET_PIN : HAL_RESET_OTHER;
}

void system_interrupt(uint32_t irq, uint8_t priority)
{
    NVIC.IPR[irq] = priority;
    NVIC.ISER[irq / 32U] = 1U << (irq % 32U);
}

/* The part that does not depend on the configuration, once: a refused one may be followed by another. */
static void start_once(hal_t *hal)
{
    if (!hal->up) {
        hal->up = true;
        const uint32_t clock_Hz = clock_start(&hal->crystal);
        hal->slow = clock_Hz != PORT_CLOCK_HZ;
        hal->sound = port_image_sound();
        hal->reset = take_reset_cause();
        pins_start();
        measure_start();
        console_start(clock_Hz);
    }
}

hal_status_t hal_init(hal_t *hal, const hal_config_t *config)
{
    start_once(hal);
    hal_status_t status = bridge_start(hal, config);
    if (!hal->slow) { /* else it would disturb the others */
        const hal_status_t can = can_start(config);
        status = status == HAL_OK ? can : status;
    }
    if (!hal->crystal || hal->slow) {
        status = HAL_CLOCK;
    }
    if (!hal->sound) {
        status = HAL_IMAGE;
    }
    hal->refused = status != HAL_OK;
    return status;
}

void system_watchdog_period(uint32_t time_ms)
{
    IWDG.KR = IWDG_KR_OPEN;
    IWDG.PR = 0U;
    IWDG.RLR = time_ms * LSI_PER_MS;
    (void)clock_await(&IWDG.SR, IWDG_SR_PVU | IWDG_SR_RVU, 0U, WATCHDOG_US);
    IWDG.KR = IWDG_KR_FEED;
}

static void start_milliseconds(void)
{
    SYSTICK.RVR = PORT_CLOCK_HZ / 1000U - 1U;
    SYSTICK.CVR = 0U;
    SYSTICK.CSR = SYSTICK_CSR_ENABLE | SYSTICK_CSR_TICKINT | SYSTICK_CSR_CLKSOURCE;
}

void hal_start(hal_t *hal, app_t *app)
{
    hal->app = app;
    DBGMCU.APB1FZR1 |= DBGMCU_APB1FZR1_IWDG; /* a breakpoint must not count as a hang */
    IWDG.KR = IWDG_KR_START;
    system_watchdog_period(WATCHDOG_MS);
    SCB.SHPR[SCB_SHPR_SYSTICK] = PORT_PRIO_MONITOR;
    SCB.SHPR[SCB_SHPR_PENDSV] = PORT_PRIO_SLOW;
    system_interrupt(IRQ_ADC1_2, PORT_PRIO_CONTROL);
    start_milliseconds();
    measure_run(hal);
    bridge_run();
}

const char *hal_board_name(const hal_t *hal)
{
    (void)hal;
    return "B-G431B-ESC1";
}

uint32_t hal_timer_Hz(const hal_t *hal)
{
    (void)hal;
    return PORT_CLOCK_HZ;
}

void hal_unique_id(const hal_t *hal, uint32_t id[3])
{
    (void)hal;
    for (uint32_t n = 0; n < 3U; ++n) {
        id[n] = UID.UID[n];
    }
}

hal_reset_t hal_reset_cause(const hal_t *hal)
{
    return hal->reset;
}

bool hal_take_last_words(hal_t *hal, hal_last_words_t *words)
{
    (void)hal;
    if (port_grave.magic != (uint32_t)GRAVE_MAGIC) {
        return false;
    }
    port_grave.magic = 0U;
    *words = port_grave.words;
    return true;
}

/* From a fault handler, bridge off, on a fresh stack. */
void port_bury(const hal_last_words_t *words)
{
    port_grave.words = *words;
    port_grave.magic = (uint32_t)GRAVE_MAGIC;
    hal_reset(&port_hal);
}

uint32_t hal_time_us(const hal_t *hal)
{
    (void)hal;
    return clock_us();
}

void hal_pend_slow(hal_t *hal)
{
    (void)hal;
    SCB.ICSR = SCB_ICSR_PENDSVSET;
}

void hal_lock(hal_t *hal)
{
    (void)hal;
    processor_lock();
}

void hal_unlock(hal_t *hal)
{
    (void)hal;
    processor_unlock();
}

void hal_idle(hal_t *hal)
{
    (void)hal;
    processor_wait();
}

void hal_watchdog(hal_t *hal)
{
    (void)hal;
    IWDG.KR = IWDG_KR_FEED;
}

void hal_reset(hal_t *hal)
{
    hal_bridge_off(hal);
    processor_barrier();
    SCB.AIRCR = reg_field(SCB_AIRCR_VECTKEY, SCB_AIRCR_KEY) | SCB_AIRCR_SYSRESETREQ;
    processor_barrier();
    for (;;) {
        processor_wait(); /* it takes a few cycles */
    }
}
