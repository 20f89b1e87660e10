/* Voltages of the nodes, and stored energy. */
#include "sim_plant/circuit_rates.h"
#include "sim_plant/floating.h"

#include <string.h>

/* A plain machine with every terminal tied or swinging */
INLINE void plain_nodes(const circuit_t *c, const point_t *p, circuit_nodes_t *nodes)
{
    circuit_legs_t legs;
    circuit_legs(c, p, &legs);
    *nodes = (circuit_nodes_t){.i_dc_A = legs.i_dc_A};
    memcpy(nodes->v_leg_V, legs.v_leg_V, sizeof nodes->v_leg_V);
    nodes->v_neutral_V[0] = (legs.v_leg_V[0] + legs.v_leg_V[1] + legs.v_leg_V[2]) / 3.0;
}

INLINE void set_nodes(const circuit_t *c, const circuit_legs_t *legs, rotor_t rotor, double omega_e,
                      const double i_A[ACTIVE], const double i_A_s[ACTIVE], circuit_nodes_t *nodes)
{
    const winding_t *w = &c->machine.winding;
    *nodes = (circuit_nodes_t){.i_dc_A = legs->i_dc_A};
    memcpy(nodes->v_leg_V, legs->v_leg_V, sizeof nodes->v_leg_V);
    for (int set = 0; set < w->sets; set++) {
        const double *v = &legs->v_leg_V[3 * set];
        if (w->zero >= 0) {
            nodes->v_zero_V[set] = legs->v_V[w->zero];
            continue;
        }
        nodes->v_zero_V[set] = winding_zero_V(w, rotor, omega_e, i_A, i_A_s, set);
        nodes->v_neutral_V[set] = (v[0] + v[1] + v[2]) / 3.0 - nodes->v_zero_V[set];
    }
}

INLINE void all_nodes(const circuit_t *c, const point_t *p, const machine_state_t *state,
                      const machine_point_t *point, circuit_nodes_t *nodes)
{
    const machine_t *m = &c->machine;
    machine_rate_t moved = {0};
    circuit_legs_t legs;
    double omega_e = m->pole_pairs * p->x[OMEGA_MECH];
    circuit_legs(c, p, &legs);
    if (c->bridge.floating != 0u) {
        floating_voltages(&c->bridge, m, state, point, omega_e, p->x[V_DC], legs.v_V, legs.v_leg_V, &moved);
    } else {
        machine_rates(m, state, point, omega_e, legs.v_V, &moved);
    }
    set_nodes(c, &legs, state->rotor, omega_e, point->i_A, moved.i_A_s, nodes);
    for (int set = 0; set < m->winding.sets && m->winding.zero < 0; set++) {
        double map_V = machine_map_zero_V(m, state, point, omega_e, &moved, set);
        nodes->v_zero_V[set] += map_V;
        nodes->v_neutral_V[set] -= map_V;
    }
}

/* Where the field of the present point is known. */
static void symmetrical_nodes(const circuit_t *c, circuit_nodes_t *nodes)
{
    double i_A_s[ACTIVE] = {0.0};
    circuit_legs_t legs;
    circuit_legs(c, &c->now, &legs);
    circuit_symmetrical_rates(c, i_A_s);
    set_nodes(c, &legs, c->now.rotor, c->machine.pole_pairs * c->now.x[OMEGA_MECH], c->now.i_A, i_A_s, nodes);
}

INLINE void two_phase_nodes(const circuit_t *c, const point_t *p, circuit_nodes_t *nodes)
{
    double i_A_s[ACTIVE] = {0.0};
    circuit_legs_t legs;
    circuit_legs(c, p, &legs);
    circuit_two_phase_at(c, p, legs.v_leg_V, i_A_s);
    set_nodes(c, &legs, p->rotor, c->machine.pole_pairs * p->x[OMEGA_MECH], p->i_A, i_A_s, nodes);
}

/* Whether no star network sees anything */
static bool has_plain_nodes(const circuit_t *c)
{
    const winding_t *w = &c->machine.winding;
    return circuit_symmetrical(c) && c->machine.plain && w->flux_terms == 0 && w->inductance_terms == 0 &&
           !w->zero_moves;
}

void circuit_terminals(const circuit_t *c, const point_t *p, double v_leg_V[PLANT_LEGS])
{
    if (circuit_two_phase(c)) {
        double i_A_s[ACTIVE];
        circuit_two_phase_at(c, p, v_leg_V, i_A_s);
        return;
    }
    machine_state_t state = circuit_machine_state(p);
    machine_point_t point;
    machine_rate_t moved;
    circuit_legs_t legs;
    machine_evaluate(&c->machine, &state, &point);
    circuit_legs(c, p, &legs);
    floating_voltages(&c->bridge, &c->machine, &state, &point, c->machine.pole_pairs * p->x[OMEGA_MECH],
                      p->x[V_DC], legs.v_V, legs.v_leg_V, &moved);
    memcpy(v_leg_V, legs.v_leg_V, sizeof legs.v_leg_V);
}

WIDER void circuit_nodes(const circuit_t *c, const point_t *p, circuit_nodes_t *nodes)
{
    if (has_plain_nodes(c)) {
        plain_nodes(c, p, nodes);
        return;
    }
    if (circuit_two_phase(c)) {
        two_phase_nodes(c, p, nodes);
        return;
    }
    machine_state_t state = circuit_machine_state(p);
    machine_point_t point;
    machine_evaluate(&c->machine, &state, &point);
    all_nodes(c, p, &state, &point, nodes);
}

void circuit_nodes_of(const circuit_t *c, const machine_state_t *state, const machine_point_t *machine,
                      circuit_nodes_t *nodes)
{
    if (has_plain_nodes(c)) {
        plain_nodes(c, &c->now, nodes);
    } else if (circuit_two_phase(c)) {
        two_phase_nodes(c, &c->now, nodes);
    } else if (c->field_known && circuit_symmetrical(c)) {
        symmetrical_nodes(c, nodes);
    } else {
        all_nodes(c, &c->now, state, machine, nodes);
    }
}

double circuit_field_of_J(const circuit_t *c, const machine_state_t *state, const machine_point_t *machine)
{
    double energy_J = machine_energy_J(&c->machine, state, machine);
    for (int k = 0; k < c->bridge.legs && c->bridge.c_leg_F > 0.0; k++) {
        energy_J += circuit_capacitor_J(c, k, circuit_output_V(c, k));
    }
    return energy_J;
}

double circuit_field_J(const circuit_t *c)
{
    machine_state_t state = circuit_machine_state(&c->now);
    machine_point_t point;
    machine_evaluate(&c->machine, &state, &point);
    return circuit_field_of_J(c, &state, &point);
}
