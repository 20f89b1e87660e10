#include "firmware/app/app.h"

#include <stddef.h>

/* The main loop is dead when a round takes longer. */
#define TURN_MS 100U

/* Of i_trip, where the comparators act: the software's limit comes first unless the current is steep. */
#define BREAK_PERCENT 110

static uint16_t break_level(const drive_params_t *params)
{
    const pm_num_t share = pm_num_div(pm_num_mul(pm_num(params->i_trip), pm_num_ratio(BREAK_PERCENT, 100)),
                                      pm_num(params->i_full_scale));
    int32_t level = 0;
    (void)pm_num_to_fixed(share, 15, &level);
    return (level > 0 && level < 32768) ? (uint16_t)level : 0U;
}

static hal_config_t hal_config_of(const drive_params_t *params)
{
    return (hal_config_t){
        .timer_counts = (uint16_t)params->timer_counts,
        .dead_time_ns = (uint16_t)params->dead_time,
        .break_level = break_level(params),
        .can_kbit_s = 500,
    };
}

/* The carrier's frequency is what the timer makes of its counts. */
static bool carrier_agrees(const hal_t *hal, const drive_params_t *params)
{
    const int64_t counts = (int64_t)2 * params->timer_counts * params->f_pwm;
    const int64_t off = counts - (int64_t)hal_timer_Hz(hal);
    return (off < 0 ? -off : off) <= (int64_t)2 * params->f_pwm;
}

drive_result_t app_configure(app_t *app, hal_t *hal, const drive_params_t *params, bool stored)
{
    *app = (app_t){.hal = hal, .slow_divider = 1, .slow_countdown = 1};
    const drive_result_t result = drive_init(&app->drive, params);
    const hal_config_t config = hal_config_of(params);
    app->hardware = hal_init(hal, &config) == HAL_OK;
    app->ready = stored && app->hardware;
    if (result.ok) {
        app->slow_divider = app->drive.config.slow_divider;
        if (!app->ready || !carrier_agrees(hal, params)) {
            app->ready = false;
            drive_trip(&app->drive, DRIVE_FAULT_PARAMETERS);
        }
    }
    return result;
}

void app_control(app_t *app)
{
    hal_measure(app->hal, &app->in);
    if (app->slow_busy) {
        drive_trip(&app->drive, DRIVE_FAULT_OVERRUN);
    }
    drive_step(&app->drive, &app->in, &app->out);
    hal_bridge_write(app->hal, &app->out);
    app->periods++;
    app->slow_countdown--;
    if (app->slow_countdown == 0U) {
        app->slow_countdown = app->slow_divider;
        app->slow_busy = true;
        hal_pend_slow(app->hal);
    }
}

void app_slow(app_t *app)
{
    hal_measure_slow(app->hal, &app->slow);
    if (app->slow.temperature_missing) {
        drive_trip(&app->drive, DRIVE_FAULT_TEMPERATURE_SENSOR);
    }
    const drive_slow_in_t in = {.temperature_dC = app->slow.temperature_dC};
    drive_slow(&app->drive, &in);
    app->slow_busy = false;
}

void app_monitor(app_t *app)
{
    const uint32_t periods = app->periods;
    const bool alive = periods != app->seen_periods || !app->hardware;
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

static void take_frames(app_t *app)
{
    hal_can_frame_t frame;
    while (hal_can_receive(app->hal, &frame)) {
        const remote_event_t event = remote_take(&app->remote, &frame, hal_time_us(app->hal));
        if (event == REMOTE_NOTHING) {
            continue;
        }
        hal_lock(app->hal);
        drive_command(&app->drive, &app->remote.command);
        if (event == REMOTE_CLEAR) {
            (void)drive_clear_fault(&app->drive);
        }
        hal_unlock(app->hal);
    }
}

static void trip(app_t *app, drive_fault_t fault)
{
    hal_lock(app->hal);
    drive_trip(&app->drive, fault);
    hal_unlock(app->hal);
}

static void watch(app_t *app)
{
    const uint32_t now_us = hal_time_us(app->hal);
    if (remote_lost(&app->remote, now_us) || hal_can_state(app->hal) == HAL_CAN_BUS_OFF) {
        if (app->remote.command.enable) {
            app->remote.command.enable = false;
            trip(app, DRIVE_FAULT_REMOTE_LOST);
        }
    }
    if (app->stalled) {
        trip(app, DRIVE_FAULT_OVERRUN);
    }
}

/* The bridge follows the state; a fault leaves it off. */
static void follow_state(app_t *app)
{
    const drive_state_t state = app->drive.state;
    const bool wanted = state != DRIVE_OFF && state != DRIVE_FAULT && app->drive.fault == DRIVE_FAULT_NONE;
    if (!wanted || !app->ready) {
        hal_bridge_off(app->hal);
    } else if (!hal_bridge_armed(app->hal) && !hal_bridge_arm(app->hal)) {
        trip(app, DRIVE_FAULT_HARDWARE);
    } else {
        /* on, as wanted */
    }
}

static void tell(app_t *app)
{
    const drive_status_t *status = drive_status(&app->drive);
    hal_can_frame_t frame;
    if (remote_status(&app->remote, status, hal_time_us(app->hal), &frame)) {
        (void)hal_can_send(app->hal, &frame); /* the next says the same, later */
    }
    if (status->fault != app->shown_fault) {
        app->shown_fault = status->fault;
        (void)hal_console(app->hal, "fault: ");
        (void)hal_console(app->hal, drive_fault_text(status->fault));
        (void)hal_console(app->hal, "\r\n");
    }
    hal_led(app->hal, hal_bridge_armed(app->hal));
}

void app_turn(app_t *app)
{
    app->turn_age_ms = 0;
    take_frames(app);
    watch(app);
    follow_state(app);
    tell(app);
}
