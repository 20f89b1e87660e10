#include "sim_plant/gates.h"

#include <math.h>

void gates_init(gates_t *gates, const plant_inverter_t *inverter, int legs)
{
    *gates = (gates_t){
        .period_s = 1.0 / inverter->f_pwm_Hz,
        .closing_s = inverter->dead_time_s + inverter->turn_on_s,
        .turn_on_s = inverter->turn_on_s,
        .turn_off_s = inverter->turn_off_s,
        .coincident_s = 1e-9 / inverter->f_pwm_Hz,
        .charge_s = inverter->bootstrap_charge_s,
        .lockout = inverter->bootstrap_lockout,
        .timer_counts = inverter->timer_counts,
        .legs = legs,
    };
    if (gates->charge_s > 0.0) {
        gates->fall_1_s = (1.0 - inverter->bootstrap_lockout) / inverter->bootstrap_hold_s;
    }
}

static double duty(const gates_t *gates, uint32_t compare)
{
    return compare >= gates->timer_counts ? 1.0 : (double)compare / gates->timer_counts;
}

void gates_load(gates_t *gates, const plant_pwm_t *pwm)
{
    double half_s = 0.5 * gates->period_s;
    gates->edge_s -= gates->period_s;
    for (int k = 0; k < gates->legs; k++) {
        gates->leg[k].rise_s = (1.0 - duty(gates, pwm->compare[k][0])) * half_s;
        gates->leg[k].fall_s = (1.0 + duty(gates, pwm->compare[k][1])) * half_s;
        gates->leg[k].on_s -= gates->period_s;
        gates->leg[k].off_s -= gates->period_s;
        gates->leg[k].clear_s -= gates->period_s;
        gates->leg[k].charge_at_s -= gates->period_s;
    }
    gates_drive(gates, pwm->driven, pwm->state, pwm->driven_after_s);
}

void gates_drive(gates_t *gates, const bool driven[], const plant_leg_state_t state[], double t_s)
{
    gates->drive_s = t_s;
    gates->next_s = -1.0;
    for (int k = 0; k < gates->legs; k++) {
        gates->leg[k].to_drive = driven[k];
        gates->leg[k].to_state = state ? state[k] : gates->leg[k].to_state;
        gates->leg[k].next_s = -1.0;
    }
}

void gates_off(gates_t *gates)
{
    gates->next_s = -1.0;
    gates->commanded = false;
    for (int k = 0; k < gates->legs; k++) {
        gates->commanded = gates->commanded || gates->leg[k].command != GATE_OFF;
        gates->leg[k].driven = false;
        gates->leg[k].to_drive = false;
        gates->leg[k].command = GATE_OFF;
        gates->leg[k].gate = GATE_OFF;
        gates->leg[k].opening = false;
        gates->leg[k].next_s = -1.0;
    }
}

static gate_t command_at(const gates_t *gates, int k, double late_s)
{
    if (!gates->leg[k].driven) {
        return GATE_OFF;
    }
    bool high = late_s >= gates->leg[k].rise_s && late_s < gates->leg[k].fall_s;
    switch (gates->leg[k].state) {
    case PLANT_LEG_HIGH:
        return GATE_HIGH;
    case PLANT_LEG_LOW:
        return GATE_LOW;
    case PLANT_LEG_UPPER:
        return high ? GATE_HIGH : GATE_OFF;
    case PLANT_LEG_LOWER:
        return high ? GATE_OFF : GATE_LOW;
    case PLANT_LEG_INVERTED:
        return high ? GATE_LOW : GATE_HIGH;
    case PLANT_LEG_LOWER_INVERTED:
        return high ? GATE_LOW : GATE_OFF;
    default:
        return high ? GATE_HIGH : GATE_LOW;
    }
}

/* When a switch that is commanded at time t closes. */
static double closing_at_s(gates_t *gates, int k, gate_t command, double t_s)
{
    plant_leg_state_t state = gates->leg[k].state;
    bool alone = state == PLANT_LEG_UPPER || state == PLANT_LEG_LOWER || state == PLANT_LEG_LOWER_INVERTED;
    if (command == GATE_OFF) {
        return t_s + gates->closing_s;
    }
    if (!alone || command != gates->leg[k].last) {
        gates->leg[k].last = command;
        gates->leg[k].clear_s = t_s + gates->closing_s;
    }
    if (!alone) {
        return gates->leg[k].clear_s;
    }
    double on_s = fmax(t_s + gates->turn_on_s, gates->leg[k].clear_s);
    return gates->leg[k].opening ? fmax(on_s, gates->leg[k].off_s) : on_s;
}

/* Of the bootstrap capacitor at time t; the gate has not changed since charge_at_s. */
static double charge_at(const gates_t *gates, int k, double t_s)
{
    double passed_s = t_s - gates->leg[k].charge_at_s;
    double charge = gates->leg[k].charge;
    if (gates->leg[k].gate == GATE_LOW) {
        return 1.0 - (1.0 - charge) * exp(-passed_s / gates->charge_s);
    }
    return fmax(charge - gates->fall_1_s * passed_s, 0.0);
}

/* When the driver opens the upper switch that conducts. */
static double lockout_s(const gates_t *gates, int k)
{
    if (gates->charge_s <= 0.0 || gates->leg[k].gate != GATE_HIGH) {
        return HUGE_VAL;
    }
    return gates->leg[k].charge_at_s + (gates->leg[k].charge - gates->lockout) / gates->fall_1_s;
}

/* The commanded switch closes, if its driver lets it. */
static void close_switch(gates_t *gates, int k)
{
    bool locked = gates->charge_s > 0.0 && gates->leg[k].charge <= gates->lockout;
    if (gates->leg[k].command == GATE_HIGH && locked) {
        gates->leg[k].on_s = HUGE_VAL;
    } else {
        gates->leg[k].gate = gates->leg[k].command;
    }
}

/* The next instant after that one at which something happens to a leg. */
static double leg_next_s(const gates_t *gates, int k, double after_s)
{
    double next_s = HUGE_VAL;
    double rise_s = gates->leg[k].rise_s;
    double fall_s = gates->leg[k].fall_s;
    if (gates->leg[k].driven && rise_s > after_s) {
        next_s = rise_s;
    }
    if (gates->leg[k].driven && fall_s > after_s && fall_s < next_s) {
        next_s = fall_s;
    }
    bool changes =
        gates->leg[k].driven != gates->leg[k].to_drive || gates->leg[k].state != gates->leg[k].to_state;
    if (changes && gates->drive_s < next_s) {
        next_s = gates->drive_s;
    }
    if (gates->leg[k].opening && gates->leg[k].off_s < next_s) {
        next_s = gates->leg[k].off_s;
    }
    if (gates->leg[k].gate != gates->leg[k].command && gates->leg[k].on_s < next_s) {
        next_s = gates->leg[k].on_s;
    }
    return fmin(lockout_s(gates, k), next_s);
}

static bool update_leg(gates_t *gates, int k, double t_s)
{
    double late_s = t_s + gates->coincident_s;
    gate_t before = gates->leg[k].gate;
    bool locked = late_s >= lockout_s(gates, k);
    if (gates->charge_s > 0.0) {
        gates->leg[k].charge = charge_at(gates, k, t_s);
        gates->leg[k].charge_at_s = t_s;
    }
    if (locked) {
        gates->leg[k].gate = GATE_OFF;
        gates->leg[k].on_s = HUGE_VAL;
    }
    if (late_s >= gates->drive_s) {
        gates->leg[k].driven = gates->leg[k].to_drive;
        gates->leg[k].state = gates->leg[k].to_state;
    }
    gate_t command = command_at(gates, k, late_s);
    if (command != gates->leg[k].command) {
        gates->commanded = true;
        gates->leg[k].command = command;
        gates->leg[k].on_s = closing_at_s(gates, k, command, t_s);
        if (before != GATE_OFF && !gates->leg[k].opening) {
            gates->leg[k].opening = true;
            gates->leg[k].off_s = t_s + gates->turn_off_s;
        }
    }
    if (gates->leg[k].opening && late_s >= gates->leg[k].off_s) {
        gates->leg[k].opening = false;
        gates->leg[k].gate = GATE_OFF;
    }
    if (!gates->leg[k].opening && gates->leg[k].gate != command && late_s >= gates->leg[k].on_s) {
        close_switch(gates, k);
    }
    gates->leg[k].next_s = leg_next_s(gates, k, late_s);
    return gates->leg[k].gate != before;
}

unsigned gates_update(gates_t *gates, double t_s)
{
    unsigned changed = 0u;
    double late_s = t_s + gates->coincident_s;
    double next_s = gates->period_s;
    gates->commanded = false;
    for (int k = 0; k < gates->legs; k++) {
        if (gates->leg[k].next_s <= late_s) {
            changed |= update_leg(gates, k, t_s) ? 1u << k : 0u;
        }
        next_s = gates->leg[k].next_s < next_s ? gates->leg[k].next_s : next_s;
    }
    gates->next_s = next_s;
    if (changed != 0u) {
        gates->edge_s = t_s;
    }
    return changed;
}

gate_t gates_faulty(const gates_t *gates, int k)
{
    gate_t gate = gates->leg[k].gate;
    bool upper = gate == GATE_HIGH;
    bool lower = gate == GATE_LOW;
    switch (gates->leg[k].fault) {
    case PLANT_UPPER_OPEN:
        upper = false;
        break;
    case PLANT_LOWER_OPEN:
        lower = false;
        break;
    case PLANT_UPPER_SHORT:
        upper = true;
        break;
    case PLANT_LOWER_SHORT:
        lower = true;
        break;
    case PLANT_HEALTHY:
    case PLANT_WIRE_OPEN:
        break;
    }
    return upper ? (lower ? GATE_BOTH : GATE_HIGH) : (lower ? GATE_LOW : GATE_OFF);
}

bool gates_in_blocks(const gates_t *gates)
{
    bool driven = false, blocks = false;
    for (int k = 0; k < gates->legs; k++) {
        driven = driven || gates->leg[k].driven;
        blocks = blocks || !gates->leg[k].driven || gates->leg[k].state != PLANT_LEG_PWM;
    }
    return driven && blocks;
}

double gates_search_s(const gates_t *gates, double t_s)
{
    double next_s = gates->period_s;
    double after_s = t_s + gates->coincident_s;
    for (int k = 0; k < gates->legs; k++) {
        double leg_s = gates->leg[k].next_s;
        leg_s = leg_s > after_s ? leg_s : leg_next_s(gates, k, after_s);
        next_s = leg_s < next_s ? leg_s : next_s;
    }
    return next_s;
}
