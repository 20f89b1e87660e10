/* Clocks, start, interrupts, time, watchdog. First to be written: steps 1, 2 and 5 of docs/porting.md. */
#include "hal/template/port.h"

static hal_t the_hal = {.refused = true};

hal_t *hal_instance(void)
{
    return &the_hal;
}

/* Once per PWM period, from "injected conversions done" or the like. Highest priority that is not a fault.
 * 1. switch the legs that hal_bridge_write() has driven or floated last, if your timer has no preload for it
 * 2. clear the request
 * 3. call the application */
void port_control(void)
{
    app_control(the_hal.app);
}

/* Every millisecond, from a timer that runs without the converters. Priority below control. */
void port_monitor(void)
{
    app_monitor(the_hal.app);
}

/* From hal_pend_slow(). The lowest priority of all. */
void port_slow(void)
{
    app_slow(the_hal.app);
}

/* 0. whether flash holds what was built (HAL_IMAGE; hal/stm32g431/startup.c, tools/seal_image.py)
 * 1. clocks: the crystal, with a time limit and an internal oscillator instead (HAL_CLOCK); its failure later
 * has to switch the bridge off
 * 2. pins: gate pins first, pulled to "off"
 * 3. each peripheral, stopped; check the configuration against what the timer has
 * May be called again with another configuration after a refusal. */
hal_status_t hal_init(hal_t *hal, const hal_config_t *config)
{
    (void)config;
    hal->refused = true;
    return HAL_CLOCK;
}

/* Store app; priorities; watchdog of 20 ms; converters wait for the timer; then the timer. */
void hal_start(hal_t *hal, app_t *app)
{
    hal->app = app;
}

const char *hal_board_name(const hal_t *hal)
{
    (void)hal;
    return "template";
}

/* By your schematic. What the bridge bears for an instant and for good, the least dead time of its drivers, the
 * carriers that leave the control interrupt its time: the drive refuses what is beyond. */
const hal_board_t *hal_board(const hal_t *hal)
{
    static const hal_board_t board = {.i_full_scale_mA = 10000, .v_full_scale_mV = 450000};
    (void)hal;
    return &board;
}

/* What the PWM counter counts by. */
uint32_t hal_timer_Hz(const hal_t *hal)
{
    (void)hal;
    return 1000000U;
}

/* From the processor; zeros if it has none. */
void hal_unique_id(const hal_t *hal, uint32_t id[3])
{
    (void)hal;
    id[0] = 0;
    id[1] = 0;
    id[2] = 0;
}

/* Read the reset flags once in hal_init(), clear them, keep the answer. */
hal_reset_t hal_reset_cause(const hal_t *hal)
{
    (void)hal;
    return HAL_RESET_OTHER;
}

/* Fault handlers: bridge off by one store, write cause and stacked pc and lr into memory that the start-up
 * does not clear, reset. Here: hand them out once. */
bool hal_take_last_words(hal_t *hal, hal_last_words_t *words)
{
    (void)hal;
    *words = (hal_last_words_t){0};
    return false;
}

/* A free-running timer at 1 MHz, 32 bits. */
uint32_t hal_time_us(const hal_t *hal)
{
    (void)hal;
    return 0;
}

/* Makes port_slow() pending. */
void hal_pend_slow(hal_t *hal)
{
    (void)hal;
}

/* All interrupts but faults off, and on. */
void hal_lock(hal_t *hal)
{
    (void)hal;
}

void hal_unlock(hal_t *hal)
{
    (void)hal;
}

/* The instruction that waits for an interrupt. */
void hal_idle(hal_t *hal)
{
    (void)hal;
}

/* Feeds the watchdog that hal_start() has started. */
void hal_watchdog(hal_t *hal)
{
    (void)hal;
}

/* Bridge off, then the processor's own reset. */
void hal_reset(hal_t *hal)
{
    hal_bridge_off(hal);
}
