#include "sim_plant/config.h"
#include "sim_plant/plant_state.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define AMBIENT_DEGC 25.0

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

/* Drift is not the circuit's doing: the field energy that the change itself brings is left out of the
 * balance. */
void plant_change_machine(plant_t *plant)
{
    assert(!config_machine_fault(&plant->config));
    double before_J = circuit_field_J(&plant->circuit);
    circuit_set_machine(&plant->circuit, &plant->config, plant->winding_degC, plant->magnet_degC);
    plant->field_base_J += circuit_field_J(&plant->circuit) - before_J;
    plant->known = plant->config.machine;
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
    plant_change_machine(plant);
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

int plant_leg_count(const plant_t *plant)
{
    return plant->gates.legs;
}

void plant_turn_rotor(plant_t *plant, double angle_e_rad)
{
    assert(isfinite(angle_e_rad));
    double before_J = circuit_field_J(&plant->circuit);
    circuit_turn(&plant->circuit, angle_e_rad);
    plant->slip_J += before_J - circuit_field_J(&plant->circuit);
}
