#include "hal/sim/sim_loop.h"

#include <math.h>
#include <string.h>

/* The comparators of a board look at the currents themselves, not at the converter's codes. */
static bool comparators_trip(const sim_loop_t *loop)
{
    if (loop->i_break_A <= 0.0) {
        return false;
    }
    plant_truth_t truth;
    plant_truth(loop->plant, &truth);
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        if (fabs(truth.i_A[leg]) > loop->i_break_A) {
            return true;
        }
    }
    return false;
}

drive_result_t sim_loop_init(sim_loop_t *loop, plant_t *plant, const drive_params_t *params)
{
    memset(loop, 0, sizeof *loop);
    loop->plant = plant;
    loop->temperature_dC = 250;
    const drive_result_t result = drive_init(&loop->drive, params);
    loop->slow_divider = result.ok ? loop->drive.config.slow_divider : 1U;
    return result;
}

void sim_loop_step(sim_loop_t *loop)
{
    plant_adc_t adc;
    plant_sample(loop->plant, &adc);
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        loop->in.i_leg[leg] = adc.i_leg[leg];
    }
    loop->in.v_dc = adc.v_dc;
    loop->in.hw_fault = loop->hw_fault || comparators_trip(loop);

    drive_step(&loop->drive, &loop->in, &loop->out);
    if (loop->periods % loop->slow_divider == 0U) {
        const drive_slow_in_t slow = {.temperature_dC = loop->temperature_dC};
        drive_slow(&loop->drive, &slow);
    }

    plant_pwm_t pwm = {0};
    for (int leg = 0; leg < DRIVE_LEGS; ++leg) {
        pwm.compare[leg][0] = loop->out.compare[leg][0];
        pwm.compare[leg][1] = loop->out.compare[leg][1];
        pwm.driven[leg] = loop->out.driven[leg];
    }
    plant_set_pwm(loop->plant, &pwm);
    if (loop->in.hw_fault || loop->out.trip) {
        plant_trip(loop->plant); /* hardware does not wait for the update event */
    }
    plant_run_period(loop->plant);
    loop->periods++;
}
