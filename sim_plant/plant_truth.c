/* What tests and traces see. */
#include "sim_plant/plant_state.h"

#include <string.h>

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
        truth->i_A[k] = plant_leg_A(plant, k);
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
