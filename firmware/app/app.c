#include "firmware/app/app.h"

#include <stddef.h>
#include <string.h>

#include "firmware/app/app_parts.h"

/* Period of a round without any event: timers of the bus count in ms. */
#define ROUND_US 250U

/* Threshold of the comparators relative to i_trip: the software limit acts first unless the current is steep.
 * */
#define BREAK_PERCENT 110

static uint16_t break_level(const drive_params_t *params)
{
    const pm_num_t share = pm_num_div(pm_num_mul(pm_num(params->i_trip), pm_num_ratio(BREAK_PERCENT, 100)),
                                      pm_num(params->i_full_scale));
    int32_t level = 0;
    (void)pm_num_to_fixed(share, 15, &level);
    return (level > 0 && level < 32768) ? (uint16_t)level : 0U;
}

hal_config_t app_hal_config(const drive_params_t *params, uint16_t can_kbit_s)
{
    return (hal_config_t){
        .timer_counts = (uint16_t)params->timer_counts,
        .dead_time_ns = (uint16_t)params->dead_time,
        .break_level = break_level(params),
        .can_kbit_s = can_kbit_s,
    };
}

static uint16_t bit_rate(const hal_t *hal)
{
    bool has_index;
    const od_entry_t *entry = od_find(0x2080, 2, &has_index);
    int32_t kbit_s = od_values_of(entry).preset;
    (void)app_stored_value(hal, entry->index, entry->sub, &kbit_s);
    return (uint16_t)kbit_s;
}

/* The carrier's frequency follows from the timer counts. */
static bool carrier_agrees(const hal_t *hal, const drive_params_t *params)
{
    const int64_t counts = (int64_t)2 * params->timer_counts * params->f_pwm;
    const int64_t off = counts - (int64_t)hal_timer_Hz(hal);
    return (off < 0 ? -off : off) <= (int64_t)2 * params->f_pwm;
}

static int16_t mode_of(const app_t *app)
{
    const cia402_t *profile = &app->cia402;
    return cia402_on(profile) ? profile->active_mode : profile->mode;
}

app_ready_t app_ready(const app_t *app)
{
    if (app->batch) {
        return APP_BATCH;
    }
    if (app->refused || !app->hardware) {
        return APP_REFUSED;
    }
    if (app->restart) {
        return APP_RESTART;
    }
#if PM_HAS(six_step)
    if (mode_of(app) == CIA402_MODE_DUTY && app->params.commutation == 0) {
        return APP_MODE;
    }
#endif
    return app->stored ? APP_READY : APP_NOT_STORED;
}

bool app_may_run(const app_t *app)
{
    const app_ready_t ready = app_ready(app);
    return ready == APP_READY || (ready == APP_NOT_STORED && mode_of(app) == CIA402_MODE_IDENTIFY);
}

drive_result_t app_configure(app_t *app, hal_t *hal, const drive_params_t *params, bool stored)
{
    (void)memset(app, 0, sizeof *app);
    app->hal = hal;
    app->slow_divider = 1;
    app->params = *params;
    app_take_board(hal, &app->params);
    app->f_pwm = params->f_pwm;
    app->stored = stored;
    const drive_result_t result = drive_init(&app->drive, &app->params, hal_channels(hal));
    app->refused_param = result.param;
    app->hal_config = app_hal_config(&app->params, bit_rate(hal));
    app->hardware = hal_init(hal, &app->hal_config) == HAL_OK;
    app->refused = !result.ok || (app->hardware && !carrier_agrees(hal, params));
    if (result.ok) {
        app->slow_divider = app->drive.config.slow_divider;
        app_judge_parameters(app);
    }
    app_bus_init(app);
    app->round_us = hal_time_us(hal) - ROUND_US;
    return result;
}

void app_trip(app_t *app, drive_fault_t fault)
{
    hal_lock(app->hal);
    drive_trip(&app->drive, fault);
    hal_unlock(app->hal);
}

/* Fault and stage are of the same instant: one that begins a short is not seen without it. */
static bool is_open_fault(app_t *app)
{
    hal_lock(app->hal);
    const bool shorted = app->armed && app->drive.stage == STAGE_SHORT;
    const bool open = app->drive.fault != DRIVE_FAULT_NONE && !shorted;
    hal_unlock(app->hal);
    return open;
}

/* The bridge follows the state and is armed once, on the way out of OFF. Outputs that are lost while they are
 * wanted are a fault, which leaves them off. A fault opens it, or holds it shorted with what is armed already. */
static void follow_state(app_t *app)
{
    const drive_state_t state = app->drive.state;
    const bool off = state == DRIVE_OFF || is_open_fault(app);
    if (off || !app_may_run(app)) {
        hal_bridge_off(app->hal);
        app->armed = false;
    } else if (app->armed ? !hal_bridge_armed(app->hal) : !hal_bridge_arm(app->hal)) {
        app_trip(app, app->stalled ? DRIVE_FAULT_OVERRUN : DRIVE_FAULT_HARDWARE);
    } else {
        app->armed = true;
    }
}

static void tell(app_t *app)
{
    const drive_fault_t fault = app->drive.fault;
    if (fault != app->shown_fault) {
        app->shown_fault = fault;
        (void)hal_console(app->hal, "fault: ");
        (void)hal_console(app->hal, drive_fault_text(fault));
        (void)hal_console(app->hal, "\r\n");
    }
    hal_led(app->hal, hal_bridge_armed(app->hal));
}

/* The main loop runs after every interrupt, mostly with nothing to do. */
static bool is_due(app_t *app)
{
    const bool frames = app_bus_take(app);
    const drive_state_t state = app->drive.state;
    const uint32_t now_us = hal_time_us(app->hal);
    const bool changed = state != app->seen_state || app->drive.fault != app->shown_fault || app->stalled;
    if (!frames && !changed && !node_busy(&app->node) && now_us - app->round_us < ROUND_US) {
        return false;
    }
    app->seen_state = state;
    app->round_us = now_us;
    return true;
}

void app_turn(app_t *app)
{
    app->turn_age_ms = 0;
    if (!is_due(app)) {
        return;
    }
    app_bus_run(app);
    if (app->stalled) {
        app_trip(app, DRIVE_FAULT_OVERRUN);
    }
    follow_state(app);
    tell(app);
}
