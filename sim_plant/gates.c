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
    gates->in_blocks = false;
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

static gate_t command_at(const gates_leg_t *leg, double late_s)
{
    bool high = late_s >= leg->rise_s && late_s < leg->fall_s;
    if (!leg->driven) {
        return GATE_OFF;
    }
    if (leg->state == PLANT_LEG_PWM) {
        return high ? GATE_HIGH : GATE_LOW;
    }
    switch (leg->state) {
    case PLANT_LEG_HIGH:
        return GATE_HIGH;
    case PLANT_LEG_UPPER:
        return high ? GATE_HIGH : GATE_OFF;
    case PLANT_LEG_LOWER:
        return high ? GATE_OFF : GATE_LOW;
    case PLANT_LEG_INVERTED:
        return high ? GATE_LOW : GATE_HIGH;
    case PLANT_LEG_LOWER_INVERTED:
        return high ? GATE_LOW : GATE_OFF;
    default: /* PLANT_LEG_LOW */
        return GATE_LOW;
    }
}

/* When a switch that is commanded at time t closes. */
static double closing_at_s(const gates_t *gates, gates_leg_t *leg, gate_t command, double t_s)
{
    plant_leg_state_t state = leg->state;
    bool alone = state == PLANT_LEG_UPPER || state == PLANT_LEG_LOWER || state == PLANT_LEG_LOWER_INVERTED;
    if (command == GATE_OFF) {
        return t_s + gates->closing_s;
    }
    if (!alone || command != leg->last) {
        leg->last = command;
        leg->clear_s = t_s + gates->closing_s;
    }
    if (!alone) {
        return leg->clear_s;
    }
    double on_s = fmax(t_s + gates->turn_on_s, leg->clear_s);
    return leg->opening ? fmax(on_s, leg->off_s) : on_s;
}

/* Of the bootstrap capacitor at time t; the gate has not changed since charge_at_s. */
static double charge_at(const gates_t *gates, const gates_leg_t *leg, double t_s)
{
    double passed_s = t_s - leg->charge_at_s;
    if (leg->gate == GATE_LOW) {
        return 1.0 - (1.0 - leg->charge) * exp(-passed_s / gates->charge_s);
    }
    return fmax(leg->charge - gates->fall_1_s * passed_s, 0.0);
}

/* When the driver opens the upper switch that conducts. */
static double lockout_s(const gates_t *gates, const gates_leg_t *leg)
{
    return leg->gate == GATE_HIGH ? leg->charge_at_s + (leg->charge - gates->lockout) / gates->fall_1_s
                                  : HUGE_VAL;
}

/* Brings the bootstrap capacitor to time t; at its lockout the driver opens the upper switch. */
static void charge_leg(const gates_t *gates, gates_leg_t *leg, double t_s)
{
    bool locked = t_s + gates->coincident_s >= lockout_s(gates, leg);
    leg->charge = charge_at(gates, leg, t_s);
    leg->charge_at_s = t_s;
    if (locked) {
        leg->gate = GATE_OFF;
        leg->on_s = HUGE_VAL;
    }
}

/* The commanded switch closes, if its driver lets it. */
static void close_switch(const gates_t *gates, gates_leg_t *leg)
{
    bool locked = gates->charge_s > 0.0 && leg->charge <= gates->lockout;
    if (leg->command == GATE_HIGH && locked) {
        leg->on_s = HUGE_VAL;
    } else {
        leg->gate = leg->command;
    }
}

/* Whether a leg is driven otherwise from drive_s on */
static bool drive_changes(const gates_leg_t *leg)
{
    return leg->driven != leg->to_drive || leg->state != leg->to_state;
}

/* The next instant after that one at which something happens to a leg. */
static double leg_next_s(const gates_t *gates, const gates_leg_t *leg, double after_s)
{
    double next_s = HUGE_VAL;
    if (leg->driven && leg->rise_s > after_s) {
        next_s = leg->rise_s;
    }
    if (leg->driven && leg->fall_s > after_s && leg->fall_s < next_s) {
        next_s = leg->fall_s;
    }
    if (gates->drive_s < next_s && drive_changes(leg)) {
        next_s = gates->drive_s;
    }
    if (leg->opening && leg->off_s < next_s) {
        next_s = leg->off_s;
    }
    if (leg->gate != leg->command && leg->on_s < next_s) {
        next_s = leg->on_s;
    }
    return gates->charge_s > 0.0 ? fmin(lockout_s(gates, leg), next_s) : next_s;
}

static void find_blocks(gates_t *gates)
{
    bool driven = false, blocks = false;
    for (int k = 0; k < gates->legs; k++) {
        driven = driven || gates->leg[k].driven;
        blocks = blocks || !gates->leg[k].driven || gates->leg[k].state != PLANT_LEG_PWM;
    }
    gates->in_blocks = driven && blocks;
}

static void drive_leg(gates_t *gates, gates_leg_t *leg)
{
    leg->driven = leg->to_drive;
    leg->state = leg->to_state;
    find_blocks(gates);
}

static void command_leg(gates_t *gates, gates_leg_t *leg, gate_t command, gate_t before, double t_s)
{
    gates->commanded = true;
    leg->command = command;
    leg->on_s = closing_at_s(gates, leg, command, t_s);
    if (before != GATE_OFF && !leg->opening) {
        leg->opening = true;
        leg->off_s = t_s + gates->turn_off_s;
    }
}

static bool update_leg(gates_t *gates, gates_leg_t *leg, double t_s)
{
    double late_s = t_s + gates->coincident_s;
    gate_t before = leg->gate;
    if (gates->charge_s > 0.0) {
        charge_leg(gates, leg, t_s);
    }
    if (late_s >= gates->drive_s && drive_changes(leg)) {
        drive_leg(gates, leg);
    }
    gate_t command = command_at(leg, late_s);
    if (command != leg->command) {
        command_leg(gates, leg, command, before, t_s);
    }
    if (leg->opening && late_s >= leg->off_s) {
        leg->opening = false;
        leg->gate = GATE_OFF;
    }
    if (!leg->opening && leg->gate != command && late_s >= leg->on_s) {
        close_switch(gates, leg);
    }
    leg->next_s = leg_next_s(gates, leg, late_s);
    return leg->gate != before;
}

unsigned gates_update(gates_t *gates, double t_s)
{
    unsigned changed = 0u;
    double late_s = t_s + gates->coincident_s;
    double next_s = gates->period_s;
    gates->commanded = false;
    for (int k = 0; k < gates->legs; k++) {
        gates_leg_t *leg = &gates->leg[k];
        if (leg->next_s <= late_s && update_leg(gates, leg, t_s)) {
            changed |= 1u << k;
        }
        next_s = leg->next_s < next_s ? leg->next_s : next_s;
    }
    gates->next_s = next_s;
    if (late_s >= gates->drive_s) {
        gates->drive_s = HUGE_VAL; /* is done */
    }
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

double gates_search_s(const gates_t *gates, double t_s)
{
    double next_s = gates->period_s;
    double after_s = t_s + gates->coincident_s;
    for (int k = 0; k < gates->legs; k++) {
        double leg_s = gates->leg[k].next_s;
        leg_s = leg_s > after_s ? leg_s : leg_next_s(gates, &gates->leg[k], after_s);
        next_s = leg_s < next_s ? leg_s : next_s;
    }
    return next_s;
}
