#include "sim_plant/gates.h"

#include <math.h>

const gate_t gates_conduct[][GATE_HIGH + 1] = {
    [PLANT_HEALTHY] = {[GATE_LOW] = GATE_LOW, [GATE_HIGH] = GATE_HIGH},
    [PLANT_UPPER_OPEN] = {[GATE_LOW] = GATE_LOW},
    [PLANT_LOWER_OPEN] = {[GATE_HIGH] = GATE_HIGH},
    [PLANT_UPPER_SHORT] = {[GATE_OFF] = GATE_HIGH, [GATE_LOW] = GATE_BOTH, [GATE_HIGH] = GATE_HIGH},
    [PLANT_LOWER_SHORT] = {[GATE_OFF] = GATE_LOW, [GATE_LOW] = GATE_LOW, [GATE_HIGH] = GATE_BOTH},
    [PLANT_WIRE_OPEN] = {[GATE_LOW] = GATE_LOW, [GATE_HIGH] = GATE_HIGH},
};

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
    for (int k = 0; k < legs; k++) {
        gates->leg[k].off_s = HUGE_VAL;
        gates->leg[k].on_s = HUGE_VAL;
    }
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

/* Of a leg that is to be driven otherwise from time t on */
static double drive_due_s(const gates_leg_t *leg, double t_s)
{
    return leg->driven != leg->to_drive || leg->state != leg->to_state ? t_s : HUGE_VAL;
}

void gates_drive(gates_t *gates, const bool driven[], const plant_leg_state_t state[], double t_s)
{
    for (int k = 0; k < gates->legs; k++) {
        gates_leg_t *leg = &gates->leg[k];
        leg->to_drive = driven[k];
        leg->to_state = state ? state[k] : leg->to_state;
        leg->drive_s = drive_due_s(leg, t_s);
        leg->edge_s = -1.0;
        leg->next_s = -1.0;
    }
}

void gates_off(gates_t *gates)
{
    gates->next_s = gates->period_s;
    gates->commanded = false;
    gates->in_blocks = false;
    for (int k = 0; k < gates->legs; k++) {
        gates_leg_t *leg = &gates->leg[k];
        gates->commanded = gates->commanded || leg->command != GATE_OFF;
        leg->driven = false;
        leg->to_drive = false;
        leg->command = GATE_OFF;
        leg->gate = GATE_OFF;
        leg->drive_s = drive_due_s(leg, leg->drive_s);
        leg->edge_s = HUGE_VAL;
        leg->off_s = HUGE_VAL;
        leg->on_s = HUGE_VAL;
        leg->next_s = -1.0;
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

/* The next command edge after that time, also one that leaves the command as it is. */
static double edge_after_s(const gates_leg_t *leg, double late_s)
{
    if (!leg->driven) {
        return HUGE_VAL;
    }
    return leg->rise_s > late_s ? leg->rise_s : leg->fall_s > late_s ? leg->fall_s : HUGE_VAL;
}

/* When a switch that is commanded at time t closes. */
static double closing_at_s(const gates_t *gates, gates_leg_t *leg, gate_t command, double t_s)
{
    plant_leg_state_t state = leg->state;
    bool alone = state == PLANT_LEG_UPPER || state == PLANT_LEG_LOWER || state == PLANT_LEG_LOWER_INVERTED;
    if (command == GATE_OFF) {
        return HUGE_VAL;
    }
    if (!alone || command != leg->last) {
        leg->last = command;
        leg->clear_s = t_s + gates->closing_s;
    }
    if (!alone) {
        return leg->clear_s;
    }
    double on_s = fmax(t_s + gates->turn_on_s, leg->clear_s);
    return leg->off_s < HUGE_VAL ? fmax(on_s, leg->off_s) : on_s;
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
    leg->on_s = HUGE_VAL;
    if (leg->command != GATE_HIGH || !locked) {
        leg->gate = leg->command;
    }
}

/* fmin() without its care for NaN, which costs a call */
static double sooner(double x_s, double y_s)
{
    return x_s < y_s ? x_s : y_s;
}

static double leg_next_s(const gates_t *gates, const gates_leg_t *leg)
{
    double next_s = sooner(sooner(leg->drive_s, leg->edge_s), sooner(leg->off_s, leg->on_s));
    return gates->charge_s > 0.0 ? sooner(lockout_s(gates, leg), next_s) : next_s;
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
    leg->drive_s = HUGE_VAL;
    leg->edge_s = -1.0;
    find_blocks(gates);
}

static void command_leg(gates_t *gates, gates_leg_t *leg, double t_s)
{
    double late_s = t_s + gates->coincident_s;
    gate_t command = command_at(leg, late_s);
    leg->edge_s = edge_after_s(leg, late_s);
    if (command == leg->command) {
        return;
    }
    gates->commanded = true;
    leg->command = command;
    leg->on_s = closing_at_s(gates, leg, command, t_s);
    if (leg->gate != GATE_OFF && leg->off_s == HUGE_VAL) {
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
    if (late_s >= leg->drive_s) {
        drive_leg(gates, leg);
    }
    if (late_s >= leg->edge_s) {
        command_leg(gates, leg, t_s);
    }
    if (late_s >= leg->off_s) {
        leg->off_s = HUGE_VAL;
        leg->gate = GATE_OFF;
    }
    if (late_s >= leg->on_s) {
        close_switch(gates, leg);
    }
    leg->next_s = leg_next_s(gates, leg);
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
        next_s = sooner(leg->next_s, next_s);
    }
    gates->next_s = next_s;
    if (changed != 0u) {
        gates->edge_s = t_s;
    }
    return changed;
}
