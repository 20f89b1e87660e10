/* The application: brings drive and hardware together. Everything that is neither motor nor register.
 *
 * The bridge is on only while the drive wants it, no fault is latched, the control interrupt comes, and the
 * parameters are those that were stored: an image without stored parameters says so and stays off.
 *
 *   app_boot(a, hal)   parameters from the store, hardware, drive; then interrupts run
 *   app_turn(a)        one round of the main loop; never blocks
 *   app_control(), app_slow(), app_monitor(): called up by the port (hal.h)
 *
 * drive_slow() runs in app_slow() between two control interrupts and is never interrupted by one: were it
 * still running when the next comes, that is the fault OVERRUN. Tests: tests/unit/app, tests/contract/hal. */
#ifndef APP_APP_H
#define APP_APP_H

#include "firmware/app/remote.h"
#include "firmware/drive/drive_state.h"
#include "hal/hal.h"

struct app {
    /* first what an observer of the memory wants to see, without anything whose size differs by machine */
    drive_t drive;
    drive_in_t in;
    drive_out_t out;
    hal_slow_t slow;

    hal_t *hal;
    uint32_t slow_divider, slow_countdown; /* periods per app_slow(), and until the next */
    volatile uint32_t periods;             /* control interrupts since start */
    volatile bool slow_busy;               /* from its pending to its end */

    volatile bool stalled;         /* the monitor has found that control has ceased */
    uint32_t seen_periods;         /* by the monitor */
    volatile uint32_t turn_age_ms; /* since the main loop's last round */

    remote_t remote;
    drive_fault_t shown_fault; /* on the console */
    bool hardware;             /* configured: control interrupts come */
    bool ready;                /* and the parameters are the user's */
};

/* Parameters of the newest valid page over the defaults; false: no page is valid. `unknown` counts the stored
 * names that this version does not have. */
bool app_load(const hal_t *hal, drive_params_t *params, uint32_t *unknown);

/* The page of all parameters, STORE_WORDS; returns the words that are used. */
uint32_t app_page(const drive_params_t *params, uint32_t sequence, uint32_t words[]);

/* Writes all of them to the older page, with the bridge off; false: not done, the other page still holds. */
bool app_save(hal_t *hal, const drive_params_t *params);

/* Configures drive and hardware, bridge off. When the drive refuses a parameter it is in DRIVE_FAULT; when
 * the hardware does, or `stored` is false, nothing can be armed. */
drive_result_t app_configure(app_t *app, hal_t *hal, const drive_params_t *params, bool stored);

/* The one of an image (main.c): by this name a debugger, and the emulated board, find it. */
extern app_t app_instance;

void app_boot(app_t *app, hal_t *hal);
void app_turn(app_t *app);

#endif
