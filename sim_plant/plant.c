#include "sim_plant/plant.h"

#include "sim_plant/circuit.h"
#include "sim_plant/comparator.h"
#include "sim_plant/config.h"
#include "sim_plant/gates.h"
#include "sim_plant/sensor.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define AMBIENT_DEGC 25.0

struct plant {
    plant_config_t config; /* machine and sensor as the scenario sets them, */
    plant_machine_t known; /* and the machine as the circuit knows it */
    circuit_t circuit;
    gates_t gates;
    noise_t noise;
    plant_pwm_t queued;    /* for the period after the present one */
    unsigned long periods; /* complete ones */
    double t_s;            /* within the period */
    double winding_degC, magnet_degC;
    sensor_input_t sampled;
    double instant_s[PLANT_INSTANTS];
    int instants;
    sensor_input_t at_instant[PLANT_INSTANTS];
    probe_t complete;       /* comparator edges of the last period */
    double start[ELEMENTS]; /* of the period */
    double v_mean_alpha_V, v_mean_beta_V;
    double field_base_J; /* field energy at init, less what was put in by hand since */
    double slip_J;       /* work of plant_turn_rotor() */
    comparator_t comparator;
    bool has_break, broke;
    double broke_s;         /* when it did, in its period */
    double break_s, trip_s; /* when comparators and caller open the bridge, in this period */
};

plant_t *plant_create(const plant_config_t *config, double theta_e_rad, const char **error)
{
    const char *fault = config_fault(config);
    if (!fault && !isfinite(theta_e_rad)) {
        fault = "theta_e_rad must be finite";
    }
    plant_t *plant = fault ? NULL : calloc(1, sizeof *plant);
    if (error) {
        *error = fault ? fault : plant ? NULL : "out of memory";
    }
    if (!plant) {
        return NULL;
    }
    plant->config = *config;
    plant->known = config->machine;
    plant->winding_degC = AMBIENT_DEGC;
    plant->magnet_degC = AMBIENT_DEGC;
    plant->break_s = (double)INFINITY;
    plant->trip_s = (double)INFINITY;
    noise_seed(&plant->noise, config->sensor.seed);
    circuit_init(&plant->circuit, config, theta_e_rad);
    gates_init(&plant->gates, &config->inverter, plant->circuit.bridge.legs);
    gates_load(&plant->gates, &plant->queued);
    plant->sampled.v_dc_V = plant->circuit.now.x[V_DC];
    plant->sampled.legs = plant->circuit.bridge.legs;
    plant->sampled.sets = plant->circuit.machine.winding.sets;
    plant->sampled.temperature_degC = AMBIENT_DEGC;
    plant->field_base_J = circuit_field_J(&plant->circuit);
    memcpy(plant->start, plant->circuit.now.x, sizeof plant->start);
    return plant;
}

void plant_destroy(plant_t *plant)
{
    free(plant);
}

static void open_bridge(plant_t *plant)
{
    memset(&plant->queued, 0, sizeof plant->queued);
    gates_off(&plant->gates);
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
    unsigned changed = gates_update(gates, next_s);
    while (plant->t_s < t_s) {
        while (next_s < t_s && commutate(plant, changed, next_s)) {
            next_s = gates_next_s(gates, next_s);
            changed = next_s < t_s ? gates_update(gates, next_s) : 0u;
        }
        advance_until(plant, next_s < t_s ? next_s : t_s);
        t_s = plant->break_s < t_s ? plant->break_s : t_s;
    }
}

static void run_until(plant_t *plant, double t_s)
{
    while (plant->t_s < t_s) {
        run_closed(plant, fmin(t_s, fmin(plant->break_s, plant->trip_s)));
        if (plant->t_s >= plant->break_s) {
            plant->broke = true;
            plant->broke_s = plant->break_s;
            plant->break_s = (double)INFINITY;
            open_bridge(plant);
        }
        if (plant->t_s >= plant->trip_s) {
            plant->trip_s = (double)INFINITY;
            open_bridge(plant);
        }
    }
}

static double leg_A(const plant_t *plant, int k)
{
    return plant->circuit.bridge.leg[k] == LEG_FLOATING
               ? 0.0
               : circuit_leg_A(&plant->circuit, &plant->circuit.now, k);
}

static bool has_voltage_channels(const plant_t *plant)
{
    return plant->config.sensor.v_leg_full_scale_V > 0.0;
}

/* What the converters see now. Node voltages only where a board measures them: they cost. */
static void capture(const plant_t *plant, sensor_input_t *seen)
{
    const circuit_t *circuit = &plant->circuit;
    const gates_t *gates = &plant->gates;
    *seen = (sensor_input_t){
        .v_dc_V = circuit->now.x[V_DC],
        .temperature_degC = plant->winding_degC,
        .quiet_s = plant->t_s - gates->edge_s,
        .legs = circuit->bridge.legs,
        .sets = circuit->machine.winding.sets,
    };
    for (int k = 0; k < circuit->bridge.legs; k++) {
        bool low = circuit->bridge.leg[k] == LEG_LOW || circuit->bridge.leg[k] == LEG_DIODE_LOW;
        seen->i_A[k] = leg_A(plant, k);
        seen->low_for_s[k] = low ? circuit->t_s - circuit->low_since_s[k] : -1.0;
        seen->i_dc_A += circuit->bridge.upper[k] * seen->i_A[k];
    }
    if (!has_voltage_channels(plant)) {
        return;
    }
    circuit_nodes_t nodes;
    circuit_nodes(circuit, &circuit->now, &nodes);
    for (int n = 0; n < PLANT_LEGS + PLANT_SETS; n++) {
        double raw_V = n < PLANT_LEGS ? nodes.v_leg_V[n] : nodes.v_neutral_V[n - PLANT_LEGS];
        double seen_V = probe_active(&circuit->probe) ? probe_voltage(&circuit->probe, n) : raw_V;
        *(n < PLANT_LEGS ? &seen->v_leg_V[n] : &seen->v_neutral_V[n - PLANT_LEGS]) = seen_V;
    }
}

static bool same_machine(const plant_machine_t *a, const plant_machine_t *b)
{
    return a->R_s_ohm == b->R_s_ohm && a->L_d0_H == b->L_d0_H && a->L_q0_H == b->L_q0_H &&
           a->c_A_Wb5 == b->c_A_Wb5 && a->psi_m_Wb == b->psi_m_Wb && a->pole_pairs == b->pole_pairs;
}

/* Drift is not the circuit's doing: the field energy that the change itself brings is left out of the
 * balance. */
static void change_machine(plant_t *plant)
{
    assert(!config_machine_fault(&plant->config));
    double before_J = circuit_field_J(&plant->circuit);
    circuit_set_machine(&plant->circuit, &plant->config, plant->winding_degC, plant->magnet_degC);
    plant->field_base_J += circuit_field_J(&plant->circuit) - before_J;
    plant->known = plant->config.machine;
}

static void start_period(plant_t *plant)
{
    plant->t_s = 0.0;
    plant->circuit.period_start_s = plant->circuit.t_s;
    if (probe_active(&plant->circuit.probe)) {
        plant->complete = plant->circuit.probe;
        probe_start_period(&plant->circuit.probe);
    }
    circuit_align(&plant->circuit);
    if (!same_machine(&plant->config.machine, &plant->known)) {
        change_machine(plant);
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
    double early_s = delay_s < 0.0 ? fmax(period_s + delay_s, 0.0) : (double)INFINITY;
    for (int n = 0; n < plant->instants; n++) {
        if (early_s <= plant->instant_s[n]) {
            run_until(plant, early_s);
            capture(plant, &plant->sampled);
            early_s = (double)INFINITY;
        }
        run_until(plant, plant->instant_s[n]);
        capture(plant, &plant->at_instant[n]);
    }
    if (early_s < period_s) {
        run_until(plant, early_s);
        capture(plant, &plant->sampled);
    }
    run_until(plant, period_s);
    finish_period(plant);
}

void plant_sample(plant_t *plant, plant_adc_t *adc)
{
    assert(!config_sensor_fault(&plant->config.sensor, plant->gates.period_s));
    if (plant->config.sensor.delay_s >= 0.0) {
        run_until(plant, fmin(plant->config.sensor.delay_s, plant->gates.period_s));
        capture(plant, &plant->sampled);
    }
    sensor_convert(&plant->config.sensor, &plant->noise, &plant->sampled, adc);
}

void plant_sample_at(plant_t *plant, double after_s, plant_adc_t *adc)
{
    plant_move(plant, after_s);
    capture(plant, &plant->sampled);
    sensor_convert(&plant->config.sensor, &plant->noise, &plant->sampled, adc);
}

void plant_set_instants(plant_t *plant, const double after_s[], int count)
{
    assert(count >= 0 && count <= PLANT_INSTANTS);
    plant->instants = count;
    for (int n = 0; n < count; n++) {
        assert(after_s[n] >= (n > 0 ? after_s[n - 1] : 0.0) && after_s[n] <= plant->gates.period_s);
        plant->instant_s[n] = after_s[n];
    }
}

void plant_sampled(plant_t *plant, int n, plant_adc_t *adc)
{
    assert(n >= 0 && n < plant->instants);
    sensor_convert(&plant->config.sensor, &plant->noise, &plant->at_instant[n], adc);
}

int plant_captured(const plant_t *plant, plant_capture_t captured[], int most)
{
    const probe_t *probe = &plant->complete;
    int count = probe->edges < most ? probe->edges : most;
    memcpy(captured, probe->edge, (size_t)(count > 0 ? count : 0) * sizeof captured[0]);
    return probe->edges + (int)probe->lost;
}

void plant_set_pwm(plant_t *plant, const plant_pwm_t *pwm)
{
    plant->queued = *pwm;
}

void plant_trip(plant_t *plant)
{
    open_bridge(plant);
}

void plant_trip_after(plant_t *plant, double after_s)
{
    assert(after_s >= 0.0 && after_s <= plant->gates.period_s);
    plant->trip_s = after_s;
}

void plant_drive(plant_t *plant, const bool driven[])
{
    gates_drive(&plant->gates, driven, plant->t_s);
}

void plant_move(plant_t *plant, double after_s)
{
    run_until(plant, fmin(after_s, plant->gates.period_s));
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

void plant_set_load(plant_t *plant, double torque_Nm)
{
    assert(isfinite(torque_Nm));
    plant->circuit.mech.load_Nm = torque_Nm;
}

void plant_set_speed(plant_t *plant, double omega_mech_rad_s)
{
    assert(isfinite(omega_mech_rad_s));
    mechanics_impose(&plant->circuit.mech, omega_mech_rad_s);
}

void plant_free_speed(plant_t *plant)
{
    plant->circuit.mech.imposed = false;
}

void plant_set_locked(plant_t *plant, bool locked)
{
    plant->circuit.mech.parameters.locked = locked;
}

void plant_set_source(plant_t *plant, double v_source_V)
{
    assert(isfinite(v_source_V) && v_source_V >= 0.0);
    plant->circuit.link.v_source_V = v_source_V;
    if (plant->circuit.link.inv_C_1_F == 0.0) {
        plant->circuit.now.x[V_DC] = v_source_V;
    }
}

void plant_set_supply(plant_t *plant, bool connected)
{
    assert(connected || plant->circuit.link.inv_C_1_F > 0.0);
    plant->circuit.link.connected = connected;
}

void plant_set_temperature(plant_t *plant, double winding_degC, double magnet_degC)
{
    assert(isfinite(winding_degC) && isfinite(magnet_degC));
    plant->winding_degC = winding_degC;
    plant->magnet_degC = magnet_degC;
    change_machine(plant);
}

void plant_set_leg_fault(plant_t *plant, int leg, plant_leg_fault_t fault)
{
    assert(leg >= 0 && leg < plant->circuit.bridge.legs);
    bool off = fault == PLANT_WIRE_OPEN;
    plant->gates.leg[leg].fault = fault;
    if (off != plant->circuit.bridge.off_wire[leg]) {
        circuit_wire(&plant->circuit, leg, off);
    }
    circuit_switch(&plant->circuit, &plant->gates, ~0u);
}

void plant_set_short(plant_t *plant, int leg_a, int leg_b, double R_ohm)
{
    int legs = plant->circuit.bridge.legs;
    assert(leg_a >= 0 && leg_a < legs && leg_b < legs && leg_a != leg_b && isfinite(R_ohm));
    circuit_short(&plant->circuit, leg_a, leg_b, R_ohm);
}

plant_machine_t *plant_machine(plant_t *plant)
{
    return &plant->config.machine;
}

plant_sensor_t *plant_sensor(plant_t *plant)
{
    return &plant->config.sensor;
}

const plant_inverter_t *plant_inverter(const plant_t *plant)
{
    return &plant->config.inverter;
}

void plant_turn_rotor(plant_t *plant, double angle_e_rad)
{
    assert(isfinite(angle_e_rad));
    double before_J = circuit_field_J(&plant->circuit);
    circuit_turn(&plant->circuit, angle_e_rad);
    plant->slip_J += before_J - circuit_field_J(&plant->circuit);
}

/* What follows from the state of windings and rotor. */
static void windings_truth(const plant_t *plant, const machine_state_t *state, const machine_point_t *point,
                           plant_truth_t *truth)
{
    const circuit_t *circuit = &plant->circuit;
    const double *x = circuit->now.x;
    dq_t i = frame_to_dq((ab_t){point->i_A[0], point->i_A[1]}, state->rotor);
    dq_t psi = machine_flux_Wb(&circuit->machine, state, point);
    *truth = (plant_truth_t){
        .t_s = (double)plant->periods * plant->gates.period_s + plant->t_s,
        .i_d_A = i.d,
        .i_q_A = i.q,
        .psi_d_Wb = psi.d,
        .psi_q_Wb = psi.q,
        .theta_e_rad = x[THETA_E],
        .omega_mech_rad_s = x[OMEGA_MECH],
        .torque_Nm = point->torque_Nm,
        .v_dc_V = x[V_DC],
        .i_zero_A = circuit->machine.winding.zero >= 0 ? point->i_A[circuit->machine.winding.zero] : 0.0,
        .v_mean_alpha_V = plant->v_mean_alpha_V,
        .v_mean_beta_V = plant->v_mean_beta_V,
        .omega_load_rad_s = x[OMEGA_LOAD],
        .e_in_J = x[INT_IN] + circuit->jump_in_J,
        .e_copper_J = x[INT_COPPER],
        .e_device_J = x[INT_DEVICE] + circuit->jump_device_J,
        .e_mech_J = x[INT_MECH] + plant->slip_J,
        .e_field_J = circuit_field_of_J(circuit, state, point) - plant->field_base_J,
    };
    for (int k = 0; k < circuit->bridge.legs; k++) {
        truth->i_A[k] = leg_A(plant, k);
    }
}

void plant_truth_windings(const plant_t *plant, plant_truth_t *truth)
{
    machine_state_t state = circuit_machine_state(&plant->circuit.now);
    machine_point_t point;
    machine_evaluate(&plant->circuit.machine, &state, &point);
    windings_truth(plant, &state, &point, truth);
}

void plant_truth(const plant_t *plant, plant_truth_t *truth)
{
    const circuit_t *circuit = &plant->circuit;
    machine_state_t state = circuit_machine_state(&circuit->now);
    machine_point_t point;
    circuit_nodes_t nodes;
    machine_evaluate(&circuit->machine, &state, &point);
    circuit_nodes_of(circuit, &state, &point, &nodes);
    windings_truth(plant, &state, &point, truth);
    truth->i_dc_A = nodes.i_dc_A;
    memcpy(truth->v_leg_V, nodes.v_leg_V, sizeof truth->v_leg_V);
    memcpy(truth->v_neutral_V, nodes.v_neutral_V, sizeof truth->v_neutral_V);
    memcpy(truth->v_zero_V, nodes.v_zero_V, sizeof truth->v_zero_V);
}
