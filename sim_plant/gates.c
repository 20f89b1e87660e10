#include "sim_plant/gates.h"

void gates_init(gates_t *gates, const plant_inverter_t *inverter)
{
    *gates = (gates_t){
        .period_s = 1.0 / inverter->f_pwm_Hz,
        .dead_time_s = inverter->dead_time_s,
        .coincident_s = 1e-9 / inverter->f_pwm_Hz,
        .timer_counts = inverter->timer_counts,
    };
}

static double duty(const gates_t *gates, uint32_t compare)
{
    return compare >= gates->timer_counts ? 1.0 : (double)compare / gates->timer_counts;
}

void gates_load(gates_t *gates, const plant_pwm_t *pwm)
{
    double half_s = 0.5 * gates->period_s;
    for (int k = 0; k < PLANT_LEGS; k++) {
        gates->leg[k].driven = pwm->driven[k];
        gates->leg[k].rise_s = (1.0 - duty(gates, pwm->compare[k][0])) * half_s;
        gates->leg[k].fall_s = (1.0 + duty(gates, pwm->compare[k][1])) * half_s;
        gates->leg[k].ready_s -= gates->period_s;
    }
}

void gates_off(gates_t *gates)
{
    for (int k = 0; k < PLANT_LEGS; k++) {
        gates->leg[k].driven = false;
        gates->leg[k].command = GATE_OFF;
        gates->leg[k].gate = GATE_OFF;
    }
}

bool gates_update(gates_t *gates, double t_s)
{
    bool changed = false;
    double late_s = t_s + gates->coincident_s;
    for (int k = 0; k < PLANT_LEGS; k++) {
        gate_t command = GATE_OFF;
        if (gates->leg[k].driven) {
            command = late_s >= gates->leg[k].rise_s && late_s < gates->leg[k].fall_s ? GATE_HIGH : GATE_LOW;
        }
        if (command != gates->leg[k].command) {
            changed |= gates->leg[k].gate != GATE_OFF;
            gates->leg[k].command = command;
            gates->leg[k].gate = GATE_OFF;
            gates->leg[k].ready_s = t_s + gates->dead_time_s;
        }
        if (gates->leg[k].gate != command && late_s >= gates->leg[k].ready_s) {
            gates->leg[k].gate = command;
            changed = true;
        }
    }
    return changed;
}

double gates_next_s(const gates_t *gates, double t_s)
{
    double next_s = gates->period_s;
    double after_s = t_s + gates->coincident_s;
    for (int k = 0; k < PLANT_LEGS; k++) {
        if (!gates->leg[k].driven) {
            continue;
        }
        double rise_s = gates->leg[k].rise_s;
        double fall_s = gates->leg[k].fall_s;
        if (rise_s > after_s && rise_s < next_s) {
            next_s = rise_s;
        }
        if (fall_s > after_s && fall_s < next_s) {
            next_s = fall_s;
        }
        if (gates->leg[k].gate != gates->leg[k].command && gates->leg[k].ready_s < next_s) {
            next_s = gates->leg[k].ready_s;
        }
    }
    return next_s;
}
