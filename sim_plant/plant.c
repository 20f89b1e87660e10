#include "sim_plant/plant.h"

#include "sim_plant/circuit.h"
#include "sim_plant/config.h"
#include "sim_plant/gates.h"
#include "sim_plant/sensor.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct plant {
    plant_machine_t machine; /* as the scenario sets it, and as the circuit knows it */
    plant_machine_t machine_known;
    plant_sensor_t sensor;
    circuit_t circuit;
    gates_t gates;
    noise_t noise;
    plant_pwm_t queued;    /* for the period after the present one */
    unsigned long periods; /* complete ones */
    double t_s;            /* within the period */
    double i_sampled_A[PLANT_LEGS];
    double v_sampled_V;
    double start[ELEMENTS]; /* of the period */
    double v_mean_alpha_V, v_mean_beta_V;
    double field_base_J; /* field energy at init, less what was put in by hand since */
    double slip_J;       /* work of plant_turn_rotor() */
};

static double field_J(const plant_t *plant)
{
    return machine_energy_J(&plant->circuit.machine, plant->circuit.now.psi_dq_Wb);
}

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
    plant->machine = config->machine;
    plant->machine_known = config->machine;
    plant->sensor = config->sensor;
    noise_seed(&plant->noise, config->sensor.seed);
    gates_init(&plant->gates, &config->inverter);
    gates_load(&plant->gates, &plant->queued);
    circuit_init(&plant->circuit, config, theta_e_rad);
    plant->v_sampled_V = plant->circuit.now.x[V_DC];
    plant->field_base_J = field_J(plant);
    memcpy(plant->start, plant->circuit.now.x, sizeof plant->start);
    return plant;
}

void plant_destroy(plant_t *plant)
{
    free(plant);
}

/* Advances to time t of the present period. */
static void run_until(plant_t *plant, double t_s)
{
    gates_t *gates = &plant->gates;
    while (plant->t_s < t_s) {
        if (gates_update(gates, plant->t_s)) {
            circuit_switch(&plant->circuit, gates);
        }
        double next_s = fmin(gates_next_s(gates, plant->t_s), t_s);
        circuit_advance(&plant->circuit, next_s - plant->t_s);
        plant->t_s = next_s;
    }
}

static void capture(plant_t *plant)
{
    for (int k = 0; k < PLANT_LEGS; k++) {
        plant->i_sampled_A[k] = plant->circuit.bridge.leg[k] == LEG_FLOATING
                                    ? 0.0
                                    : frame_dot(frame_axis[k], plant->circuit.now.i_A);
    }
    plant->v_sampled_V = plant->circuit.now.x[V_DC];
}

static bool same_machine(const plant_machine_t *a, const plant_machine_t *b)
{
    return a->R_s_ohm == b->R_s_ohm && a->L_d0_H == b->L_d0_H && a->L_q0_H == b->L_q0_H &&
           a->c_A_Wb5 == b->c_A_Wb5 && a->psi_m_Wb == b->psi_m_Wb && a->pole_pairs == b->pole_pairs;
}

/* Drift is not the circuit's doing: ohmic energy so far is booked with the old resistance, and the field
 * energy that the change itself brings is left out of the balance. */
static void take_parameters(plant_t *plant)
{
    if (same_machine(&plant->machine, &plant->machine_known)) {
        return;
    }
    assert(!config_machine_fault(&plant->machine));
    circuit_t *circuit = &plant->circuit;
    circuit->e_copper_J += 1.5 * circuit->machine.R_s_ohm * circuit->now.x[INT_I2];
    circuit->e_on_J += 1.5 * circuit->bridge.r_on_ohm * circuit->now.x[INT_I2];
    circuit->now.x[INT_I2] = 0.0;
    double before_J = field_J(plant);
    machine_set(&circuit->machine, &plant->machine);
    circuit_refresh(circuit);
    plant->field_base_J += field_J(plant) - before_J;
    plant->machine_known = plant->machine;
}

static void finish_period(plant_t *plant)
{
    const double *x = plant->circuit.now.x;
    double R = plant->circuit.machine.R_s_ohm;
    double T = plant->gates.period_s;
    const double *x0 = plant->start;
    plant->v_mean_alpha_V = (x[PSI_ALPHA] - x0[PSI_ALPHA] + R * (x[INT_I_ALPHA] - x0[INT_I_ALPHA])) / T;
    plant->v_mean_beta_V = (x[PSI_BETA] - x0[PSI_BETA] + R * (x[INT_I_BETA] - x0[INT_I_BETA])) / T;
    plant->periods++;
    plant->t_s = 0.0;
    gates_load(&plant->gates, &plant->queued);
    circuit_align(&plant->circuit);
    take_parameters(plant);
    memcpy(plant->start, plant->circuit.now.x, sizeof plant->start);
}

void plant_run_period(plant_t *plant)
{
    double period_s = plant->gates.period_s;
    double early_s = plant->sensor.delay_s < 0.0 ? fmax(period_s + plant->sensor.delay_s, 0.0) : period_s;
    run_until(plant, early_s);
    if (early_s < period_s) {
        capture(plant);
        run_until(plant, period_s);
    }
    finish_period(plant);
}

void plant_sample(plant_t *plant, plant_adc_t *adc)
{
    assert(!config_sensor_fault(&plant->sensor, plant->gates.period_s));
    if (plant->sensor.delay_s >= 0.0) {
        run_until(plant, fmin(plant->sensor.delay_s, plant->gates.period_s));
        capture(plant);
    }
    for (int k = 0; k < PLANT_LEGS; k++) {
        adc->i_leg[k] = sensor_current(&plant->sensor, &plant->noise, k, plant->i_sampled_A[k]);
    }
    adc->v_dc = sensor_voltage(&plant->sensor, &plant->noise, plant->v_sampled_V);
}

void plant_set_pwm(plant_t *plant, const plant_pwm_t *pwm)
{
    plant->queued = *pwm;
}

void plant_trip(plant_t *plant)
{
    memset(&plant->queued, 0, sizeof plant->queued);
    gates_off(&plant->gates);
    circuit_switch(&plant->circuit, &plant->gates);
}

void plant_set_load(plant_t *plant, double torque_Nm)
{
    assert(isfinite(torque_Nm));
    plant->circuit.mech.load_Nm = torque_Nm;
}

void plant_set_speed(plant_t *plant, double omega_mech_rad_s)
{
    assert(isfinite(omega_mech_rad_s));
    plant->circuit.mech.imposed = true;
    plant->circuit.mech.imposed_rad_s = omega_mech_rad_s;
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

plant_machine_t *plant_machine(plant_t *plant)
{
    return &plant->machine;
}

plant_sensor_t *plant_sensor(plant_t *plant)
{
    return &plant->sensor;
}

void plant_turn_rotor(plant_t *plant, double angle_e_rad)
{
    assert(isfinite(angle_e_rad));
    double before_J = field_J(plant);
    plant->circuit.now.x[THETA_E] += angle_e_rad;
    circuit_refresh(&plant->circuit);
    plant->slip_J += before_J - field_J(plant);
}

void plant_truth(const plant_t *plant, plant_truth_t *truth)
{
    const circuit_t *circuit = &plant->circuit;
    const point_t *now = &circuit->now;
    double r_on = circuit->bridge.r_on_ohm;
    motor_port_t port = circuit_port(circuit, now);
    *truth = (plant_truth_t){
        .t_s = (double)plant->periods * plant->gates.period_s + plant->t_s,
        .i_d_A = now->i_dq_A.d,
        .i_q_A = now->i_dq_A.q,
        .psi_d_Wb = now->psi_dq_Wb.d,
        .psi_q_Wb = now->psi_dq_Wb.q,
        .theta_e_rad = now->x[THETA_E],
        .omega_mech_rad_s = now->x[OMEGA_MECH],
        .torque_Nm = now->torque_Nm,
        .v_dc_V = now->x[V_DC],
        .v_mean_alpha_V = plant->v_mean_alpha_V,
        .v_mean_beta_V = plant->v_mean_beta_V,
        .e_in_J = now->x[INT_IN],
        .e_copper_J = circuit->e_copper_J + 1.5 * circuit->machine.R_s_ohm * now->x[INT_I2],
        .e_device_J = circuit->e_on_J + 1.5 * r_on * now->x[INT_I2] + now->x[INT_DROP],
        .e_mech_J = now->x[INT_MECH] + plant->slip_J,
        .e_field_J = field_J(plant) - plant->field_base_J,
    };
    for (int k = 0; k < PLANT_LEGS; k++) {
        bool floating = circuit->bridge.leg[k] == LEG_FLOATING;
        truth->i_A[k] = floating ? 0.0 : frame_dot(frame_axis[k], now->i_A);
        truth->v_leg_V[k] = bridge_leg_V(&circuit->bridge, &circuit->machine, &port, k);
    }
}
