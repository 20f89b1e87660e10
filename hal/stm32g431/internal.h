/* Interface between the files of this port. */
#ifndef STM32G431_INTERNAL_H
#define STM32G431_INTERNAL_H

#include "hal/stm32g431/port.h"
#include "hal/stm32g431/registers/fdcan.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PORT_CLOCK_HZ 170000000U
/* Of the upper four bits. Faults are at 0. */
#define PORT_PRIO_CONTROL 0x10U
#define PORT_PRIO_MONITOR 0x20U
#define PORT_PRIO_IO      0x30U
#define PORT_PRIO_SLOW    0x40U

extern hal_t port_hal;                                                 /* the only instance */
extern uint32_t port_store[HAL_STORE_PAGES][HAL_STORE_PAGE_SIZE / 4U]; /* from the link script */

/* --- clock.c */
/* The processor's clock in Hz: PORT_CLOCK_HZ, or that after reset, because the PLL does not lock or does not take
 * over. Starts the microsecond counter. */
uint32_t clock_start(bool *from_crystal);
uint32_t clock_us(void);
void clock_delay(uint32_t time_us);
/* Waits until the bits have that value; false on time-out. */
bool clock_await(const reg_t *word, uint32_t mask, uint32_t value, uint32_t most_us);

/* --- pins.c */
void pins_start(void);
bool pins_button(void);
void pins_led(bool on);

/* --- system.c */
void system_interrupt(uint32_t irq, uint8_t priority);
void system_watchdog_period(uint32_t time_ms);

/* --- by peripheral: configured, not running */
hal_status_t bridge_start(hal_t *hal, const hal_config_t *config);
void bridge_run(void);
void bridge_begin_period(void); /* in programs with PORT_BY_COM */
void measure_start(void);
void measure_run(hal_t *hal);
/* The sequence that has ended was started within the period, not at its start. */
bool measure_is_within(void);
void measure_take_sample(void);
hal_status_t can_start(const hal_config_t *config);
void can_take_element(port_can_t *can, const fdcan_element_t *element); /* into the ring */
void console_start(uint32_t clock_Hz);

/* --- exceptions: the vector table is in startup.c */
void port_control(void);
void port_monitor(void);
void port_slow(void);
void port_can_received(void);
void port_console_sent(void);

/* --- startup.c: whether flash holds what was built; about 10 ms */
bool port_image_sound(void);

/* --- startup.c: faults, with the frame that the exception has stacked */
typedef struct {
    uint32_t magic;
    hal_last_words_t words;
} port_grave_t;
extern port_grave_t port_grave; /* in memory that the start-up does not clear */
void port_reset(void) __attribute__((noreturn));
void port_fault(const uint32_t *frame, uint32_t exception);
void port_nmi(void);
void port_bury(const hal_last_words_t *words); /* does not return on a processor */

#ifdef __cplusplus
}
#endif

#endif
