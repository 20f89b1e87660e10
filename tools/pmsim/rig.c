#include "tools/pmsim/rig.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "hal/sim/sim_loop.h"
#include "tools/pmsim/record_layout.h"

_Static_assert((int)RIG_OFF == (int)DRIVE_OFF && (int)RIG_CALIBRATING == (int)DRIVE_CALIBRATING &&
                   (int)RIG_FINDING == (int)DRIVE_FINDING && (int)RIG_RUNNING == (int)DRIVE_RUNNING &&
                   (int)RIG_STOPPING == (int)DRIVE_STOPPING && (int)RIG_FAULT == (int)DRIVE_FAULT,
               "states");
_Static_assert((int)RIG_SPEED == (int)DRIVE_MODE_SPEED && (int)RIG_TORQUE == (int)DRIVE_MODE_TORQUE &&
                   (int)RIG_CURRENT == (int)DRIVE_MODE_CURRENT,
               "modes");

static const double two_pi = 6.283185307179586;

struct rig {
    sim_loop_t loop;
    double v_V, i_A, omega_mech; /* SI value of one step of a signal */
    drive_command_t command;     /* the last one */
    uint8_t given, given_last;   /* RECORD_...: before the coming period, before the last one */
    uint32_t fault_seen;         /* period of the last fault that the status has shown */
};

static double step_of(pm_num_t base)
{
    return ldexp((double)base.m, base.e - PM_Q_BITS);
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
    const drive_base_t *base = &rig->loop.drive.config.base;
    rig->fault_seen = UINT32_MAX;
    rig->v_V = step_of(base->v);
    rig->i_A = step_of(base->i);
    rig->omega_mech = step_of(base->omega) / params->pole_pairs;
    return rig;
}

void rig_destroy(rig_t *rig)
{
    if (rig != NULL) {
        plant_destroy(rig->loop.plant);
        free(rig);
    }
}

plant_t *rig_plant(rig_t *rig)
{
    return rig->loop.plant;
}

/* Round half away from zero, saturate: a command never wraps. */
static int32_t whole(double value)
{
    const double rounded = round(value);
    return rounded >= 2147483647.0 ? INT32_MAX : (rounded <= -2147483648.0 ? INT32_MIN : (int32_t)rounded);
}

void rig_command(rig_t *rig, const rig_command_t *command)
{
    rig->command = (drive_command_t){
        .enable = command->enable,
        .mode = (drive_mode_t)command->mode,
        .speed_mrad_s = whole(1e3 * command->speed_rad_s),
        .torque_uNm = whole(1e6 * command->torque_Nm),
        .current_mA = whole(1e3 * command->current_A),
    };
    rig->given |= RECORD_COMMAND;
    drive_command(&rig->loop.drive, &rig->command);
}

bool rig_clear_fault(rig_t *rig)
{
    rig->given |= RECORD_CLEAR;
    return drive_clear_fault(&rig->loop.drive);
}

void rig_set_temperature(rig_t *rig, double temperature_degC)
{
    rig->loop.temperature_dC = whole(10.0 * temperature_degC);
}

void rig_set_hw_fault(rig_t *rig, bool held)
{
    rig->loop.hw_fault = held;
}

void rig_set_break(rig_t *rig, double i_break_A)
{
    rig->loop.i_break_A = i_break_A;
}

/* The status is renewed at 1 kHz; the record says at once. */
static drive_fault_t fault_now(rig_t *rig)
{
    const drive_fault_t shown = drive_status(&rig->loop.drive)->fault;
    const drive_fault_record_t *record = drive_fault_record(&rig->loop.drive);
    if (shown != DRIVE_FAULT_NONE) {
        rig->fault_seen = record->period;
        return shown;
    }
    return record->period != rig->fault_seen ? record->fault : DRIVE_FAULT_NONE;
}

static void convert(rig_t *rig, rig_sample_t *sample)
{
    const drive_status_t *status = drive_status(&rig->loop.drive);
    sample->state = (int)status->state;
    sample->fault = (int)fault_now(rig);
    sample->limits = status->limits;
    sample->theta_hat_e_rad = ldexp((double)status->theta, -32) * two_pi;
    const double error = sample->truth.theta_e_rad - sample->theta_hat_e_rad;
    sample->angle_error_rad = error - two_pi * floor(error / two_pi + 0.5);
    sample->omega_hat_mech_rad_s = rig->omega_mech * status->omega;
    sample->omega_ref_mech_rad_s = rig->omega_mech * status->omega_ref;
    sample->i_d_hat_A = rig->i_A * status->i.d;
    sample->i_q_hat_A = rig->i_A * status->i.q;
    sample->i_d_ref_A = rig->i_A * status->i_ref.d;
    sample->i_q_ref_A = rig->i_A * status->i_ref.q;
    sample->v_alpha_V = rig->v_V * status->v.alpha;
    sample->v_beta_V = rig->v_V * status->v.beta;
    sample->v_dc_hat_V = rig->v_V * status->v_dc;
    sample->weight = (double)status->weight / PM_ONE;
    sample->quality = (double)status->quality / PM_ONE;
    const drive_out_t *out = &rig->loop.out;
    sample->driven = out->driven[0] || out->driven[1] || out->driven[2];
}

void rig_step(rig_t *rig, rig_sample_t *sample)
{
    plant_truth(rig->loop.plant, &sample->truth);
    rig->given_last = rig->given;
    rig->given = 0;
    sim_loop_step(&rig->loop);
    convert(rig, sample);
}

uint32_t rig_slow_divider(const rig_t *rig)
{
    return rig->loop.slow_divider;
}

void rig_layout(uint32_t layout[RECORD_LAYOUT])
{
    record_layout(layout);
}

void rig_record(const rig_t *rig, record_period_t *record)
{
    *record = (record_period_t){
        .v_dc = rig->loop.in.v_dc,
        .hw_fault = rig->loop.in.hw_fault,
        .given = rig->given_last,
        .enable = rig->command.enable,
        .mode = (uint8_t)rig->command.mode,
        .speed_mrad_s = rig->command.speed_mrad_s,
        .torque_uNm = rig->command.torque_uNm,
        .current_mA = rig->command.current_mA,
        .temperature_dC = rig->loop.temperature_dC,
    };
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        record->i_leg[leg] = rig->loop.in.i_leg[leg];
        record->compare[leg][0] = rig->loop.out.compare[leg][0];
        record->compare[leg][1] = rig->loop.out.compare[leg][1];
        record->driven[leg] = rig->loop.out.driven[leg];
    }
}

void rig_step_plant(rig_t *rig, const record_period_t *record)
{
    plant_adc_t adc;
    plant_pwm_t pwm = {0};
    plant_sample(rig->loop.plant, &adc);
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        pwm.compare[leg][0] = record->compare[leg][0];
        pwm.compare[leg][1] = record->compare[leg][1];
        pwm.driven[leg] = record->driven[leg] != 0U;
    }
    plant_set_pwm(rig->loop.plant, &pwm);
    plant_run_period(rig->loop.plant);
}

bool rig_step_drive(rig_t *rig, const record_period_t *record)
{
    sim_loop_t *loop = &rig->loop;
    drive_in_t in = {.v_dc = record->v_dc, .hw_fault = record->hw_fault != 0U};
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        in.i_leg[leg] = record->i_leg[leg];
    }
    drive_step(&loop->drive, &in, &loop->out);
    if (loop->periods % loop->slow_divider == 0U) {
        const drive_slow_in_t slow = {.temperature_dC = record->temperature_dC};
        drive_slow(&loop->drive, &slow);
    }
    loop->periods++;
    bool same = true;
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        same = same && loop->out.compare[leg][0] == record->compare[leg][0] &&
               loop->out.compare[leg][1] == record->compare[leg][1] &&
               loop->out.driven[leg] == (record->driven[leg] != 0U);
    }
    return same;
}
