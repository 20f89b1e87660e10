#include "tools/pmsim/rig.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "hal/sim/sim_loop.h"
#include "tools/pmsim/rig_drive.h"
#include "tools/pmsim/rig_sample.h"

struct rig {
    sim_loop_t loop;
    rig_scale_t scale;
    drive_command_t command;   /* the last one */
    uint8_t given, given_last; /* RECORD_...: before the coming period, before the last one */
};

/* Bases may be others after a restart. */
static rig_scale_t scale_of(const app_t *app)
{
    return rig_scale(&app->drive.config.base, app->params.pole_pairs, app->slow_divider);
}

/* The firmware starts again from what is stored; the world goes on. */
static void restart(rig_t *rig)
{
    const double time_us = rig->loop.time_us;
    rig->loop.hal.reset = false;
    sim_loop_boot(&rig->loop);
    rig->loop.time_us = time_us;
    rig->scale = scale_of(&rig->loop.app);
}

rig_t *rig_create(const plant_config_t *plant, double theta_e_rad, const drive_params_t *params,
                  bool refusal_expected, char *error, size_t error_size)
{
    rig_t *rig = calloc(1, sizeof *rig);
    if (rig == NULL) {
        snprintf(error, error_size, "out of memory");
        return NULL;
    }
    const char *reason = NULL;
    plant_t *machine = plant_create(plant, theta_e_rad, &reason);
    if (machine == NULL) {
        snprintf(error, error_size, "plant: %s", reason);
        free(rig);
        return NULL;
    }
    const drive_result_t result = sim_loop_init(&rig->loop, machine, params);
    if (!result.ok && !refusal_expected) {
        snprintf(error, error_size, "drive refuses parameter %s: %s", drive_param_table[result.param].name,
                 result.reason);
        rig_destroy(rig);
        return NULL;
    }
    (void)app_save(&rig->loop.hal, params); /* for a restart */
    rig->scale = scale_of(&rig->loop.app);
    return rig;
}

void rig_destroy(rig_t *rig)
{
    if (rig != NULL) {
        plant_destroy(rig->loop.hal.plant);
        free(rig);
    }
}

const drive_t *rig_drive(const rig_t *rig)
{
    return &rig->loop.app.drive;
}

plant_t *rig_plant(rig_t *rig)
{
    return rig->loop.hal.plant;
}

void rig_command(rig_t *rig, const rig_command_t *command)
{
    rig->command = rig_drive_command(command);
    rig->given |= RECORD_COMMAND;
    drive_command(&rig->loop.app.drive, &rig->command);
}

bool rig_turn_estimate(rig_t *rig, double theta_e_rad)
{
    drive_t *drive = &rig->loop.app.drive;
    if (drive->stage < STAGE_OPEN_LOOP) {
        return false;
    }
    drive->position.pll.theta += (pm_angle_t)(int64_t)llround(theta_e_rad / 6.283185307179586 * 4294967296.0);
    return true;
}

bool rig_clear_fault(rig_t *rig)
{
    rig->given |= RECORD_CLEAR;
    return drive_clear_fault(&rig->loop.app.drive);
}

void rig_set_temperature(rig_t *rig, double temperature_degC)
{
    rig->loop.hal.temperature_dC = rig_whole(10.0 * temperature_degC);
}

void rig_set_hw_fault(rig_t *rig, bool held)
{
    rig->loop.hal.hw_fault = held;
}

void rig_set_break(rig_t *rig, double i_break_A)
{
    plant_break_t levels = {.delay_s = 0.0};
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        levels.above_A[leg] = i_break_A;
        levels.below_A[leg] = i_break_A;
    }
    plant_set_break(rig->loop.hal.plant, i_break_A > 0.0 ? &levels : NULL);
}

bool rig_send(rig_t *rig, const hal_can_frame_t *frame)
{
    return sim_queue_put(&rig->loop.hal.received, frame);
}

bool rig_receive(rig_t *rig, hal_can_frame_t *frame)
{
    return sim_queue_take(&rig->loop.hal.sent, frame);
}

void rig_set_can_state(rig_t *rig, hal_can_state_t state)
{
    rig->loop.hal.can_state = state;
}

void rig_step(rig_t *rig, rig_sample_t *sample)
{
    plant_truth_windings(rig->loop.hal.plant, &sample->truth);
    rig->given_last = rig->given;
    rig->given = 0;
    sim_loop_step(&rig->loop);
    if (rig->loop.hal.reset) {
        restart(rig);
    }
    rig_fill_sample(&rig->scale, &rig->loop.app.drive, &rig->loop.app.out, sample);
}

uint32_t rig_slow_divider(const rig_t *rig)
{
    return rig->loop.app.slow_divider;
}

void rig_record(const rig_t *rig, record_period_t *record)
{
    *record = (record_period_t){
        .given = rig->given_last,
        .enable = rig->command.enable,
        .mode = (uint8_t)rig->command.mode,
        .speed_mrad_s = rig->command.speed_mrad_s,
        .torque_uNm = rig->command.torque_uNm,
        .current_mA = rig->command.current_mA,
        .duty_ppm = rig->command.duty_ppm,
        .temperature_dC = rig->loop.hal.temperature_dC,
    };
    rig_record_legs(&rig->loop.app.in, &rig->loop.app.out, record);
}

void rig_step_plant(rig_t *rig, const record_period_t *record)
{
    plant_adc_t adc;
    plant_pwm_t pwm = {0};
    plant_sample(rig->loop.hal.plant, &adc);
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        pwm.compare[leg][0] = record->compare[leg][0];
        pwm.compare[leg][1] = record->compare[leg][1];
        pwm.driven[leg] = record->driven[leg] != 0U;
    }
    plant_set_pwm(rig->loop.hal.plant, &pwm);
    plant_run_period(rig->loop.hal.plant);
}

bool rig_step_drive(rig_t *rig, const record_period_t *record)
{
    app_t *app = &rig->loop.app;
    drive_in_t in = {.v_dc = record->v_dc, .hw_fault = record->hw_fault != 0U};
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        in.i_leg[leg] = record->i_leg[leg];
    }
    const bool slow_follows = app->drive.period % app->slow_divider == 0U;
    drive_step(&app->drive, &in, &app->out);
    if (slow_follows) {
        const drive_slow_in_t slow = {.temperature_dC = record->temperature_dC};
        drive_slow(&app->drive, &slow);
    }
    bool same = true;
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        same = same && app->out.compare[leg][0] == record->compare[leg][0] &&
               app->out.compare[leg][1] == record->compare[leg][1] &&
               (pm_leg(app->out.legs, (uint32_t)leg) != PM_LEG_OFF) == (record->driven[leg] != 0U);
    }
    return same;
}
