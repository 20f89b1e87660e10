/* What the port's interrupts call. */
#include "firmware/app/app_parts.h"
#include "firmware/math/compiler.h"

/* The main loop counts as stalled when a round takes longer. */
#define TURN_MS 100U

/* app_slow() follows when this period's control has returned, and must have ended when the next begins. */
static inline void pend_slow(app_t *app)
{
    if (app->slow_busy) {
        drive_trip(&app->drive, DRIVE_FAULT_OVERRUN);
    }
    app->slow_busy = true;
    app->slow_at++;
    hal_pend_slow(app->hal);
}

void app_control(app_t *app)
{
    hal_measure(app->hal, &app->in);
    if (pm_rarely(app->drive.period == app->slow_at)) {
        pend_slow(app);
    }
    drive_step(&app->drive, &app->in, &app->out);
    hal_bridge_write(app->hal, &app->out);
    trace_sample(&app->trace);
}

/* A new parameter set has a period of its own: with it and drive_slow() in one, the carrier would be limited to
 * 30 kHz. The next control interrupt pends this again, which then is drive_slow(), whatever is written meanwhile. */
void app_slow(app_t *app)
{
    app->swapping = app->next_ready && !app->swapping;
    if (app->swapping) {
        app_take_parameters(app);
        app->slow_busy = false;
        return;
    }
    hal_measure_slow(app->hal, &app->slow);
    if (app->slow.temperature_missing) {
        drive_trip(&app->drive, DRIVE_FAULT_TEMPERATURE_SENSOR);
    }
    if (app->slow.reference_off) {
        drive_trip(&app->drive, DRIVE_FAULT_SENSOR_REFERENCE);
    }
    const drive_slow_in_t in = {.temperature_dC = app->slow.temperature_dC};
    drive_slow(&app->drive, &in);
    app->slow_at += app->slow_divider - 1U;
    app->slow_busy = false;
}

void app_monitor(app_t *app)
{
    const uint32_t periods = app->drive.period;
    const bool alive = periods != app->seen_periods || !app->hardware || app->storing;
    app->seen_periods = periods;
    if (!alive && !app->stalled) {
        hal_bridge_off(app->hal);
        app->stalled = true;
    }
    if (app->turn_age_ms < TURN_MS) {
        app->turn_age_ms++;
    }
    if (alive && app->turn_age_ms < TURN_MS) {
        hal_watchdog(app->hal);
    }
}
