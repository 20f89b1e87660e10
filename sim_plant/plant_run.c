/* Time and gates: from edge to edge through a period. */
#include "sim_plant/plant_state.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static void announce_edges(plant_t *plant, double at_s)
{
    if (plant->gates.commanded) {
        probe_command_edge(&plant->circuit.probe, at_s);
    }
}

static unsigned update_gates(plant_t *plant, double at_s)
{
    unsigned changed = gates_update(&plant->gates, at_s);
    announce_edges(plant, at_s);
    return changed;
}

void plant_open_bridge(plant_t *plant)
{
    memset(&plant->queued, 0, sizeof plant->queued);
    gates_off(&plant->gates);
    announce_edges(plant, plant->t_s);
    circuit_switch(&plant->circuit, &plant->gates, ~0u);
}

static bool any_on(const gates_t *gates)
{
    bool any = false;
    for (int k = 0; k < gates->legs; k++) {
        any = any || gates->leg[k].gate != GATE_OFF;
    }
    return any;
}

/* Towards time t without a change of gates: to there, to an event on the way, or to where the comparators
 * open the bridge. */
static void advance_until(plant_t *plant, double t_s)
{
    if (plant->has_break && !isfinite(plant->break_s) && any_on(&plant->gates)) {
        double left_s = t_s - plant->t_s;
        bool passed = comparator_advance(&plant->comparator, &plant->circuit, &left_s);
        plant->t_s = t_s - left_s;
        if (!passed) {
            return;
        }
        plant->break_s = plant->t_s + plant->comparator.delay_s;
        t_s = fmin(t_s, plant->break_s);
    }
    if (t_s > plant->t_s) {
        plant->t_s = t_s - circuit_advance(&plant->circuit, t_s - plant->t_s);
    }
}

/* The legs after a change of their gates at that time; false: the circuit must first get there. */
static bool commutate(plant_t *plant, unsigned changed, double at_s)
{
    if (changed != 0u && at_s > plant->t_s) {
        return circuit_switch_early(&plant->circuit, &plant->gates, changed, at_s - plant->t_s);
    }
    if (changed != 0u) {
        circuit_switch(&plant->circuit, &plant->gates, changed);
    }
    return true;
}

/* Advances to time t of the present period, or to where the bridge opens before. Half of all edges change
 * only whether a switch or the diode across it carries the current; where that makes no difference the
 * circuit need not stop for them. */
static void run_closed(plant_t *plant, double t_s)
{
    gates_t *gates = &plant->gates;
    circuit_settle(&plant->circuit);
    double next_s = plant->t_s; /* when the gates change next: they are those of then */
    unsigned changed = update_gates(plant, next_s);
    while (plant->t_s < t_s) {
        while (next_s < t_s && commutate(plant, changed, next_s)) {
            next_s = gates_next_s(gates);
            changed = next_s < t_s ? update_gates(plant, next_s) : 0u;
        }
        advance_until(plant, next_s < t_s ? next_s : t_s);
        t_s = plant->break_s < t_s ? plant->break_s : t_s;
    }
}

void plant_run_until(plant_t *plant, double t_s)
{
    while (plant->t_s < t_s) {
        run_closed(plant, fmin(t_s, plant->break_s));
        if (plant->t_s >= plant->break_s) {
            plant->broke = true;
            plant->broke_s = plant->break_s;
            plant->break_s = (double)INFINITY;
            plant_open_bridge(plant);
        }
    }
}

static bool same_machine(const plant_machine_t *a, const plant_machine_t *b)
{
    return a->R_s_ohm == b->R_s_ohm && a->L_d0_H == b->L_d0_H && a->L_q0_H == b->L_q0_H &&
           a->c_A_Wb5 == b->c_A_Wb5 && a->psi_m_Wb == b->psi_m_Wb && a->pole_pairs == b->pole_pairs;
}

static void start_period(plant_t *plant)
{
    plant->t_s = 0.0;
    plant->circuit.period_start_s = plant->circuit.t_s;
    if (probe_active(&plant->circuit.probe)) {
        plant->complete = plant->circuit.probe;
        probe_start_period(&plant->circuit.probe, plant->gates.period_s);
    }
    circuit_align(&plant->circuit);
    if (!same_machine(&plant->config.machine, &plant->known)) {
        plant_change_machine(plant);
    }
    memcpy(plant->start, plant->circuit.now.x, sizeof plant->start);
}

static void finish_period(plant_t *plant)
{
    const double *x = plant->circuit.now.x;
    double T = plant->gates.period_s;
    plant->v_mean_alpha_V = (x[INT_V_ALPHA] - plant->start[INT_V_ALPHA]) / T;
    plant->v_mean_beta_V = (x[INT_V_BETA] - plant->start[INT_V_BETA]) / T;
    plant->periods++;
    plant->break_s -= T;
    gates_load(&plant->gates, &plant->queued);
    start_period(plant);
}

void plant_run_period(plant_t *plant)
{
    double period_s = plant->gates.period_s;
    double delay_s = plant->config.sensor.delay_s;
    if (delay_s < 0.0) {
        plant_run_until(plant, fmax(period_s + delay_s, 0.0));
        plant_look(plant, &plant->sampled);
    }
    plant_run_until(plant, period_s);
    finish_period(plant);
}

void plant_set_pwm(plant_t *plant, const plant_pwm_t *pwm)
{
    plant->queued = *pwm;
}

void plant_trip(plant_t *plant)
{
    plant_open_bridge(plant);
}

void plant_drive(plant_t *plant, const bool driven[])
{
    gates_drive(&plant->gates, driven, NULL, plant->t_s);
}

void plant_drive_legs(plant_t *plant, const bool driven[], const plant_leg_state_t state[])
{
    gates_drive(&plant->gates, driven, state, plant->t_s);
}

void plant_move(plant_t *plant, double after_s)
{
    plant_run_until(plant, fmin(after_s, plant->gates.period_s));
}

void plant_set_break(plant_t *plant, const plant_break_t *comparators)
{
    plant->has_break = comparators != NULL;
    plant->break_s = (double)INFINITY;
    if (comparators) {
        assert(comparators->delay_s >= 0.0 && comparators->delay_s < plant->gates.period_s);
        comparator_init(&plant->comparator, comparators, plant->config.sensor.shunt == PLANT_IN_LINE);
    }
}

bool plant_broke(plant_t *plant, double *after_s)
{
    bool broke = plant->broke;
    plant->broke = false;
    *after_s = plant->broke_s;
    return broke;
}

bool plant_break_held(const plant_t *plant)
{
    return plant->has_break && comparator_sees(&plant->comparator, &plant->circuit) > 1.0;
}

void plant_run_voltages(plant_t *plant, const double v_leg_V[], double rate_rad_s2, double duration_s)
{
    circuit_t *circuit = &plant->circuit;
    assert(isfinite(duration_s) && duration_s >= 0.0 && isfinite(rate_rad_s2));
    circuit_sources(circuit, v_leg_V);
    circuit->mech.imposed_rate_rad_s2 = rate_rad_s2;
    double longest_s = plant->gates.period_s;
    for (double left_s = duration_s; left_s > 0.0;) {
        double part_s = fmin(left_s, longest_s);
        circuit_settle(circuit);
        left_s -= part_s - circuit_advance(circuit, part_s);
        circuit_align(circuit);
    }
    circuit->mech.imposed_rate_rad_s2 = 0.0;
}
