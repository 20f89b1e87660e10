/* The shadow set of parameters: checked as a whole, then handed over as a whole. */
#include <stddef.h>
#include <string.h>

#include "firmware/app/app_parts.h"

_Static_assert((uint32_t)DRIVE_PARAM_COUNT == (uint32_t)OD_PARAMETER_COUNT, "dictionary and drive agree");

/* The hardware was configured once, before its start. */
static bool needs_restart(const app_t *app)
{
    const hal_config_t now = app_hal_config(&app->params, app->hal_config.can_kbit_s);
    return app->params.f_pwm != app->f_pwm || now.timer_counts != app->hal_config.timer_counts ||
           now.dead_time_ns != app->hal_config.dead_time_ns || now.break_level != app->hal_config.break_level;
}

void app_judge_parameters(app_t *app)
{
    const app_ready_t ready = app_ready(app);
    if (ready != APP_READY && ready != APP_NOT_STORED) {
        drive_trip(&app->drive, DRIVE_FAULT_PARAMETERS);
    }
}

void app_take_parameters(app_t *app)
{
    drive_reconfigure(&app->drive, &app->next);
    app->next_ready = false;
    app->slow_divider = app->drive.config.slow_divider;
    app_judge_parameters(app);
}

/* The slow interrupt takes `next` only while it is marked ready, and is not interrupted by us. */
static drive_result_t make_next(app_t *app)
{
    app->next_ready = false;
    __atomic_signal_fence(__ATOMIC_SEQ_CST);
    (void)memset(&app->next, 0, sizeof app->next);
    return drive_configure(&app->next, &app->params, hal_channels(app->hal));
}

static void hand_over(app_t *app)
{
    __atomic_signal_fence(__ATOMIC_SEQ_CST);
    app->next_ready = true;
}

/* Abort code for the present shadow set. A set that was invalid before may stay invalid, otherwise it could
 * not be repaired one value at a time. */
static uint32_t check(app_t *app, bool was_bad)
{
    const bool waited = app->next_ready;
    const drive_result_t result = make_next(app);
    app->refused_param = result.param;
    app->next_lost = waited;
    if (!result.ok) {
        return was_bad ? 0U : SDO_INCOMPATIBLE;
    }
    if (app_is_on(app) && !drive_same_frame(&app->next, &app->drive.config)) {
        return SDO_STATE;
    }
    app->refused = false;
    app->restart = needs_restart(app);
    app->next_lost = false;
    if (!app->restart) { /* else the drive keeps the values that the hardware has */
        hand_over(app);
    }
    return 0;
}

/* After a refusal, with the previous set: the configuration that was waiting is made again. */
static void renew(app_t *app)
{
    if (app->next_lost && make_next(app).ok) {
        hand_over(app);
    }
}

uint32_t app_put_parameter(app_t *app, drive_param_id_t id, int32_t value)
{
    const int32_t old = drive_param_get(&app->params, id);
    drive_param_set(&app->params, id, value);
    if (app->batch || value == old) {
        return 0;
    }
    const uint32_t code = check(app, app->refused);
    if (code != 0U) {
        drive_param_set(&app->params, id, old);
        renew(app);
    }
    return code;
}

uint32_t app_put_batch(app_t *app, bool open)
{
    if (open == app->batch) {
        return 0;
    }
    app->batch = open;
    if (open) {
        app->before_batch = app->params;
        return 0;
    }
    const uint32_t code = check(app, false);
    if (code != 0U) {
        app->params = app->before_batch;
        renew(app);
    }
    return code;
}

uint32_t app_refused_object(const app_t *app)
{
    for (uint32_t row = 0; row < od_count; row++) {
        const od_entry_t *entry = &od_table[row];
        if (entry->kind == (uint8_t)OD_PARAMETER && entry->slot == (uint16_t)app->refused_param) {
            return (uint32_t)entry->index * 256U + entry->sub;
        }
    }
    return 0;
}
