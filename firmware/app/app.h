/* The application: connects drive, hardware and CANopen node; everything that is neither motor control nor
 * register access.
 *
 * The bridge is on only while the drive wants it, no fault is latched, the control interrupt runs, and the
 * machine's parameters are stored, each of them: otherwise the image reports it and stays off. It is armed
 * once, when the drive leaves OFF; if the hardware opens it after that, the fault is HARDWARE. A fault that shorts
 * the motor (firmware/drive/fault_short.h) leaves it armed until the short ends, and never arms it.
 *
 *   app_boot(a, hal)   parameters from the store, hardware, drive; then interrupts run
 *   app_turn(a)        one round of the main loop, cheap when nothing has changed and no timer of the bus can
 *                      have run out; never blocks, except for a store that was requested
 *   app_control(), app_slow(), app_monitor()   called by the port (hal.h)
 *
 * drive_slow() runs in app_slow() between two control interrupts and is never interrupted by one: if it is
 * still running when the next one comes, the fault is OVERRUN. A new parameter set is applied there too, as a
 * whole, in a period of its own before drive_slow(). Each takes less than a period of the highest carrier that the
 * port accepts (docs/performance.md).
 *
 * Parameters are written to a shadow set, which is also what is read back. A write that the drive's
 * configuration refuses is undone (0604 0043h). Parameters that decide the meaning of the drive's state
 * cannot change while it is on (0800 0022h). Those of the hardware set-up take effect after a restart.
 * Tests: tests/unit/app, tests/contract/hal. */
#ifndef APP_APP_H
#define APP_APP_H

#include "firmware/can/cia402.h"
#include "firmware/can/node_state.h"
#include "firmware/can/trace.h"
#include "firmware/drive/drive_state.h"
#include "firmware/math/image.h"
#include "firmware/params/parameters.h"
#include "hal/hal.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Length of the trace's ring: as the image's manifest says (firmware/images); elsewhere 8 kB */
#ifdef PM_IMAGE_TRACE_NUMBERS
#define APP_TRACE_NUMBERS PM_IMAGE_TRACE_NUMBERS
#else
#define APP_TRACE_NUMBERS 4000U
#endif

/* Whether the drive may be switched on: object parameters_ready */
typedef enum {
    APP_READY,
    APP_NOT_STORED,
    APP_REFUSED, /* by the drive, or the hardware */
    APP_RESTART, /* the hardware is set up with other values */
    APP_BATCH,   /* parameters are being written together */
    APP_MODE,    /* CIA402_MODE_DUTY, and the drive is one with field orientation */
} app_ready_t;

struct app {
    /* first what an observer of the memory wants to see, without anything whose size differs by machine */
    drive_t drive;
    drive_in_t in;
    drive_out_t out;
    hal_slow_t slow;
    bool swapping; /* app_slow() has taken a parameter set the last time, and nothing else */

    hal_t *hal;
    uint32_t slow_divider;   /* periods per app_slow() */
    uint32_t slow_at;        /* drive.period that pends the next, or that follows the one at work */
    volatile bool slow_busy; /* from its pending to its end */

    volatile bool stalled;         /* the monitor has found that control has ceased */
    volatile bool storing;         /* flash is written: neither control nor this is on time */
    uint32_t seen_periods;         /* by the monitor */
    volatile uint32_t turn_age_ms; /* since the main loop's last round */

    drive_fault_t shown_fault; /* on the console and the bus */
    drive_state_t seen_state;  /* by the last full round of the main loop, */
    uint32_t round_us;         /* which was then */
    bool hardware;             /* configured: control interrupts come */
    bool armed;                /* the bridge, for the state that the drive is in: not a second time */

    /* parameters */
    hal_config_t hal_config; /* that the hardware runs with */
    int32_t f_pwm;
    drive_params_t params;       /* the shadow set */
    drive_params_t before_batch; /* while one is open */
    drive_config_t next;         /* made from it, for app_slow() to take */
    bool next_lost;              /* a set that waited to be taken was overwritten by one that was refused */
    volatile bool next_ready;
    bool stored, refused, restart, batch;
    drive_param_id_t refused_param;               /* that the last check named */
    uint16_t dropped;                             /* stored pairs that this version does not know */
    uint8_t routines;                             /* what to identify: COMMISSIONING_... */
    PM_IN_IMAGE(saliency_map, uint8_t map_point;) /* shown of the saliency map */

    /* bus */
    node_t node;
    cia402_t cia402;
    cia402_out_t given; /* to the drive */
    uint16_t alarm;     /* code of the alarm that tripped the drive */
    uint32_t can_lost, can_lost_us;
    uint32_t saves, saved_us; /* that count against the next one, and since when */
    trace_t trace;
    int16_t trace_ring[APP_TRACE_NUMBERS];
};

/* Parameters of the newest valid page over the defaults; false: not all of the machine's are there. `unknown`
 * counts the stored values that this version does not have. */
bool app_load(const hal_t *hal, drive_params_t *params, uint32_t *unknown);

/* A page of all parameters, of at most STORE_WORDS; returns the words that are used. */
uint32_t app_page(const drive_params_t *params, uint32_t sequence, uint32_t words[]);

/* The same to the page that is not the newest. False: not done, the old ones remain. */
bool app_save(hal_t *hal, const drive_params_t *params);

/* Hardware and drive, bridge off. When the drive refuses a parameter it is in DRIVE_FAULT; when
 * the hardware does, or `stored` is false, nothing can be armed. */
drive_result_t app_configure(app_t *app, hal_t *hal, const drive_params_t *params, bool stored);

/* The one of an image (main.c): by this name a debugger, and the emulated board, find it. */
extern app_t app_instance;

/* What an image says of itself, found by the name app_image. */
typedef struct {
    char name[16];         /* of its manifest, without .yaml; zeros behind it */
    uint32_t drive_bytes;  /* sizeof(drive_t) */
    uint32_t config_bytes; /* sizeof(drive_config_t) */
} app_image_t;

extern const app_image_t app_image;

void app_boot(app_t *app, hal_t *hal);
void app_turn(app_t *app);

app_ready_t app_ready(const app_t *app);

#ifdef __cplusplus
}
#endif

#endif
