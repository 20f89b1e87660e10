/* What the converters see. */
#include "sim_plant/config.h"
#include "sim_plant/plant_state.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static bool has_node_channels(const plant_t *plant)
{
    const plant_sensor_t *sensor = &plant->config.sensor;
    return sensor->v_leg_full_scale_V > 0.0 || sensor->v_zero_full_scale_V > 0.0 ||
           sensor->i_dc_full_scale_A > 0.0;
}

static void see_nodes(const plant_t *plant, sensor_input_t *seen)
{
    const circuit_t *circuit = &plant->circuit;
    const lags_t *lags = &circuit->lags;
    circuit_nodes_t nodes;
    circuit_nodes(circuit, &circuit->now, &nodes);
    for (int n = 0; n < PLANT_LEGS + PLANT_SETS; n++) {
        double raw_V = n < PLANT_LEGS ? nodes.v_leg_V[n] : nodes.v_neutral_V[n - PLANT_LEGS];
        double seen_V = probe_active(&circuit->probe) ? probe_voltage(&circuit->probe, n) : raw_V;
        *(n < PLANT_LEGS ? &seen->v_leg_V[n] : &seen->v_neutral_V[n - PLANT_LEGS]) = seen_V;
    }
    seen->i_link_A = lags->dc_s > 0.0 ? lags->y.i_dc_A : nodes.i_dc_A;
    for (int set = 0; set < circuit->machine.winding.sets; set++) {
        seen->v_zero_V[set] = lags->zero_s > 0.0 ? lags->y.v_zero_V[set]
                                                 : lags_zero_V(lags, set, nodes.v_zero_V[set], nodes.v_leg_V,
                                                               nodes.v_neutral_V);
    }
}

/* What the converters see now. Node voltages only where a board measures them: they cost. */
void plant_look(const plant_t *plant, sensor_input_t *seen)
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
        double i_A = plant_leg_A(plant, k);
        seen->i_A[k] = circuit->lags.current_s > 0.0 ? circuit->lags.y.i_A[k] : i_A;
        seen->low_for_s[k] = low ? circuit->t_s - circuit->low_since_s[k] : -1.0;
        seen->i_dc_A += circuit->bridge.upper[k] * i_A;
    }
    if (has_node_channels(plant)) {
        see_nodes(plant, seen);
    }
}

/* A scenario may have changed it. What lies between the members can only have it checked once more. */
static void check_sensor(plant_t *plant)
{
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
    if (memcmp(&plant->sound, &plant->config.sensor, sizeof plant->sound) != 0) {
        assert(!config_sensor_fault(&plant->config.sensor, plant->gates.period_s));
        memcpy(&plant->sound, &plant->config.sensor, sizeof plant->sound);
    }
}

void plant_sample(plant_t *plant, plant_adc_t *adc)
{
    check_sensor(plant);
    if (plant->config.sensor.delay_s >= 0.0) {
        plant_run_until(plant, fmin(plant->config.sensor.delay_s, plant->gates.period_s));
        plant_look(plant, &plant->sampled);
    }
    sensor_convert(&plant->config.sensor, &plant->noise, &plant->sampled, adc);
}

void plant_sample_at(plant_t *plant, double after_s, plant_adc_t *adc)
{
    plant_move(plant, after_s);
    plant_look(plant, &plant->sampled);
    sensor_convert(&plant->config.sensor, &plant->noise, &plant->sampled, adc);
}

int plant_captured(const plant_t *plant, plant_capture_t captured[], int most)
{
    const probe_t *probe = &plant->complete;
    int count = probe->edges < most ? probe->edges : most;
    memcpy(captured, probe->edge, (size_t)(count > 0 ? count : 0) * sizeof captured[0]);
    return probe->edges + (int)probe->lost;
}
