/* What a plant is between two calls; for the parts of plant.h: plant.c (its life and its conditions),
 * plant_run.c (time and gates), plant_sample.c (what converters see), plant_truth.c. */
#ifndef PLANT_STATE_H
#define PLANT_STATE_H

#include "sim_plant/circuit.h"
#include "sim_plant/comparator.h"
#include "sim_plant/gates.h"
#include "sim_plant/plant.h"
#include "sim_plant/sensor.h"

struct plant {
    plant_config_t config; /* machine and sensor as the scenario sets them, */
    plant_machine_t known; /* and the machine as the circuit knows it, */
    plant_sensor_t sound;  /* and the sensor as it was when it made sense */
    circuit_t circuit;
    gates_t gates;
    noise_t noise;
    plant_pwm_t queued;    /* for the period after the present one */
    unsigned long periods; /* complete ones */
    double t_s;            /* within the period */
    double winding_degC, magnet_degC;
    sensor_input_t sampled;
    probe_t complete;       /* comparator edges of the last period */
    double start[ELEMENTS]; /* of the period */
    double v_mean_alpha_V, v_mean_beta_V;
    double field_base_J; /* field energy at init, less what was put in by hand since */
    double slip_J;       /* work of plant_turn_rotor() */
    comparator_t comparator;
    bool has_break, broke;
    double broke_s; /* when it did, in its period */
    double break_s; /* when the comparators open the bridge, in this period */
};

/* Moves on to an instant of the present period, with all that happens on the way. */
void plant_run_until(plant_t *plant, double t_s);

/* All legs off, and those of the next period. */
void plant_open_bridge(plant_t *plant);

/* The circuit takes over the machine as the scenario has it. */
void plant_change_machine(plant_t *plant);

/* What the converters see now. */
void plant_look(const plant_t *plant, sensor_input_t *seen);

static inline double plant_leg_A(const plant_t *plant, int k)
{
    return plant->circuit.bridge.leg[k] == LEG_FLOATING
               ? 0.0
               : circuit_leg_A(&plant->circuit, &plant->circuit.now, k);
}

#endif
