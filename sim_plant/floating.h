/* Legs without current: the terminal voltage that keeps each leg's current at zero (METHODS.md 0.2 E10,
 * E11).
 *
 *   di/dt          = Y v + (motion and tied legs)
 *   axis_k . di/dt = 0                               for each floating leg k
 *
 * Where nothing fixes the potential of a group (all legs of a star, both ends of an open phase) its highest
 * and lowest are assumed to lie evenly between the rails.
 * Cost: an elimination of at most six equations. Tests: floating_test.cpp. */
#ifndef PLANT_FLOATING_H
#define PLANT_FLOATING_H

#include "sim_plant/bridge.h"
#include "sim_plant/machine.h"

/* v_V: by active coordinates, from the tied legs; on return with the floating ones. Writes v_leg_V of those
 * and the rates under v_V. */
void floating_voltages(const bridge_t *bridge, const machine_t *machine, const machine_state_t *state,
                       const machine_point_t *point, double omega_e_rad_s, double v_dc_V, double v_V[ACTIVE],
                       double v_leg_V[PLANT_LEGS], machine_rate_t *rate);

/* Moves the windings onto zero current of the floating legs; point is that of the state on return. Energy
 * that was in the currents is gone. */
void floating_project(const bridge_t *bridge, const machine_t *machine, double small_A,
                      machine_state_t *state, machine_point_t *point);

#endif
