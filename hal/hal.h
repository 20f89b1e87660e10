/* Interface of a port: functions that it provides to the application, and functions of the application that
 * it calls. One folder of hal/ per port, each with the same files: bridge.c, measure.c, can.c, store.c,
 * system.c, console.c and port.h with struct hal.
 *
 * A port is thin: it moves numbers between registers and the structs of drive.h and contains no motor
 * control. Only the application calls it; the control code does not depend on it. tests/contract/hal runs the
 * same checks on any port.
 *
 * Contexts, by falling priority:
 *   control   the interrupt at the end of the current measurement, once per PWM period: app_control()
 *   monitor   an interrupt of a timer of its own, every millisecond, below control: app_monitor()
 *   slow      the lowest interrupt, at 1 kHz, pended by control: app_slow()
 *   thread    the main loop; may be interrupted by all
 *   any       all of these and the fault handlers
 * Functions do not block unless stated.
 *
 * Order: hal_init(), hal_start(), then the rest. From reset until hal_bridge_arm() the bridge is off. */
#ifndef HAL_HAL_H
#define HAL_HAL_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/drive/drive.h"
#include "hal/can_frame.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct hal hal_t; /* defined by the port in its port.h */
typedef struct app app_t; /* defined by the application */

typedef enum {
    HAL_RESET_POWER,
    HAL_RESET_PIN,
    HAL_RESET_SOFTWARE,
    HAL_RESET_WATCHDOG,
    HAL_RESET_OTHER,
} hal_reset_t;

/* Configuration of the hardware, from the application's parameters. */
typedef struct {
    uint16_t timer_counts; /* of half a PWM period */
    uint16_t dead_time_ns; /* rounded up to the resolution of the timer */
    uint16_t break_level;  /* over-current comparators: code of a leg current above mid-scale; 0: most */
    uint16_t can_kbit_s;   /* 125, 250, 500 or 1000 */
} hal_config_t;

typedef enum {
    HAL_OK,
    HAL_TIMER_COUNTS, /* outside the timer's range */
    HAL_DEAD_TIME,
    HAL_BREAK_LEVEL,
    HAL_CAN_BIT_RATE,
    HAL_CLOCK, /* oscillator or PLL has not started: the port runs on, but the bridge cannot be armed */
    HAL_IMAGE, /* flash does not hold what was built: likewise */
} hal_status_t;

/* Why the last run ended, preserved over the reset by the fault handlers. */
typedef struct {
    uint32_t cause; /* exception number; 0: none recorded */
    uint32_t pc, lr;
    uint32_t status;  /* fault status register of the processor */
    uint32_t address; /* of the faulty access */
} hal_last_words_t;

/* What the board is and bears, by its schematic: objects 2001h and 2700h:1 and 2, and nobody else's to change. 0: not
 * known, or without such a limit. */
typedef struct {
    int32_t i_full_scale_mA, v_full_scale_mV;          /* of the converters; always known */
    int32_t shunt_uohm, current_gain, voltage_divider; /* shunt to converter, converter to link; in 0.001 */
    int32_t i_limit_mA, v_limit_mV;                    /* phase current, peak, and DC link */
    int32_t i_bridge_mA, t_bridge_ms; /* phase current that is borne for good, thermal time constant */
    int32_t dead_time_least_ns, f_pwm_least_Hz, f_pwm_most_Hz;
} hal_board_t;

/* --- system.c ------------------------------------------------------------------------------------------ */

/* The port's single instance. Ports with several instances, such as sim, do not define it. */
hal_t *hal_instance(void);

/* thread, once, first: clocks, pins, peripherals; nothing runs yet. Blocks up to 20 ms. The configuration
 * is checked here; a port that refuses it can still do CAN, console and store. */
hal_status_t hal_init(hal_t *hal, const hal_config_t *config);

/* thread, once: timer, converters and interrupts run; app_control() is called from now on. */
void hal_start(hal_t *hal, app_t *app);

const char *hal_board_name(const hal_t *hal);
const hal_board_t *hal_board(const hal_t *hal); /* any; the same from reset on */
uint32_t hal_timer_Hz(const hal_t *hal); /* clock of the carrier: timer_counts = timer_Hz / (2 f_pwm) */
void hal_unique_id(const hal_t *hal, uint32_t id[3]);
hal_reset_t hal_reset_cause(const hal_t *hal);
bool hal_take_last_words(hal_t *hal, hal_last_words_t *words); /* thread; false: none. Clears them. */

uint32_t hal_time_us(const hal_t *hal); /* any; wraps */
void hal_pend_slow(hal_t *hal);         /* control; app_slow() follows when control has returned */
void hal_lock(hal_t *hal);              /* thread: holds all interrupts off, for at most 1 us; no nesting */
void hal_unlock(hal_t *hal);
void hal_idle(hal_t *hal); /* thread: returns after the next interrupt, or at once */
void hal_watchdog(
    hal_t *hal);            /* monitor: without a call for 20 ms the processor is reset and the bridge off */
void hal_reset(hal_t *hal); /* thread: bridge off, then restart; does not return on a processor */

/* --- bridge.c ------------------------------------------------------------------------------------------ */

/* control, budget 60 instructions: compare values take effect at the next update event, a change of the
 * legs' states there or within 2.5 us after it; out->trip switches all off at once.
 * A commutation within the period is at its instant, but not before 3 us from the update event on. A further sample is at its
 * instant, or not taken within 5 us of the period's ends, which pm_measure_t.sampled tells.
 * Without NEEDS_HALVES compare[leg][0] serves both halves. */
void hal_bridge_write(hal_t *hal, const drive_out_t *out);

/* A break, by a comparator or the break input, opens all switches at once and without software. They stay open
 * until armed again, also when the cause ends with that, and hal_measure() reports it once, however short it
 * was. Nothing but this report forgets it. */

/* thread, once for each time that outputs are wanted: lets them follow hal_bridge_write(). False, and still
 * off, while the break input is active, a break has not been reported yet, or the port has refused its
 * configuration. Outputs that are lost later are a fault: they must not simply be armed again. */
bool hal_bridge_arm(hal_t *hal);
void hal_bridge_off(hal_t *hal);         /* any, 0.2 us: all switches open until armed again */
bool hal_bridge_armed(const hal_t *hal); /* any: as the hardware has it, so false from the break on */

/* --- measure.c ----------------------------------------------------------------------------------------- */

/* any: what it measures and does beside the common, NEEDS_... of measure.h, and PM_BOOTSTRAP where the upper
 * switches must be charged before the first pulse; the same from reset on. A member
 * of drive_in_t.more that belongs to no declared channel is zero, one of drive_out_t.instants is ignored. */
uint32_t hal_channels(const hal_t *hal);

/* control, budget 40 instructions: the samples at the centre of this period's zero vector, and in hw_fault
 * whether there was a break since the last call, or still is. */
void hal_measure(hal_t *hal, drive_in_t *in);

/* Slow measurements; the last conversion of each. */
typedef struct {
    int32_t temperature_dC;   /* 0.1 degC, hottest sensor */
    uint16_t dial;            /* potentiometer, left-aligned; 0 where there is none */
    bool button;              /* pressed */
    bool temperature_missing; /* the sensor is broken off or shorted */
    bool reference_off; /* the converters' reference is off by 5 % or more: so is all that is measured */
} hal_slow_t;

void hal_measure_slow(hal_t *hal, hal_slow_t *slow); /* slow */

/* --- can.c: classic frames, 11-bit identifiers --------------------------------------------------------- */

bool hal_can_receive(hal_t *hal, hal_can_frame_t *frame);    /* thread; false: none waits */
bool hal_can_send(hal_t *hal, const hal_can_frame_t *frame); /* thread; false: no room, try again */
hal_can_state_t hal_can_state(const hal_t *hal);
uint32_t hal_can_lost(const hal_t *hal); /* frames that found the receive ring full, since start */

/* --- store.c: two pages of flash ----------------------------------------------------------------------- */

#define HAL_STORE_PAGES     2
#define HAL_STORE_PAGE_SIZE STORE_PAGE

/* any, also before hal_init(): the page in place. After an interrupted write its contents are undefined, but
 * reading it is harmless. */
const uint32_t *hal_store_page(const hal_t *hal, uint32_t page);

/* thread, bridge off; these block, up to 30 ms, and stall the processor where code runs from the same flash.
 * False: refused (bridge armed, outside) or failed; the page is then neither old nor new. Offset and size are
 * multiples of 8. */
bool hal_store_erase(hal_t *hal, uint32_t page);
bool hal_store_write(hal_t *hal, uint32_t page, uint32_t offset, const uint32_t *data, uint32_t size);

/* --- console.c ----------------------------------------------------------------------------------------- */

uint32_t hal_console(hal_t *hal,
                     const char *text); /* thread; characters taken: fewer when the ring is full */
void hal_led(hal_t *hal, bool on);

/* --- called by the port, defined by the application (firmware/app) ------------------------------------- */

void app_control(app_t *app); /* control, after every current measurement */
void app_monitor(app_t *app); /* monitor, every millisecond after hal_start() */
void app_slow(app_t *app);    /* slow, after hal_pend_slow() */

#ifdef __cplusplus
}
#endif

#endif
