/* The rates of any circuit. */
#include "sim_plant/circuit_rates.h"
#include "sim_plant/floating.h"
#include "sim_plant/machine_rates.h"

#include <string.h>

/* Coordinates that leg k has a part in: of two stars without a fault branch only those of its own set. */
INLINE int first_of_leg(shape_t shape, int k)
{
    return shape.active == 4 && shape.sets == 2 ? 2 * (k / 3) : 0;
}

INLINE int end_of_leg(shape_t shape, int k)
{
    return shape.active == 4 && shape.sets == 2 ? 2 * (k / 3) + 2 : shape.active;
}

INLINE void add_leg(const circuit_t *c, const point_t *p, int k, shape_t shape, circuit_legs_t *legs)
{
    const winding_t *w = &c->machine.winding;
    const bridge_t *b = &c->bridge;
    double v_dc_V = p->x[V_DC];
    double i_A = 0.0;
    for (int a = first_of_leg(shape, k); a < end_of_leg(shape, k); a++) {
        i_A += w->axis[k][a] * p->i_A[a];
    }
    legs->i_leg_A[k] = i_A;
    if (b->leg[k] == LEG_FLOATING) {
        return;
    }
    double v_V;
    if (b->leg[k] == LEG_SWINGING) {
        v_V = p->x[V_LEG(k)];
    } else if (b->leg[k] == LEG_SOURCE) {
        v_V = b->v_source_V[k];
        legs->in_W += v_V * i_A;
    } else {
        v_V = bridge_tied_V(b, k, i_A, v_dc_V);
        legs->i_dc_A += b->upper[k] * i_A;
        legs->device_W += (b->upper[k] * v_dc_V - v_V) * i_A;
    }
    legs->v_leg_V[k] = v_V;
    for (int a = first_of_leg(shape, k); a < end_of_leg(shape, k); a++) {
        legs->v_V[a] += w->share[k][a] * v_V;
    }
}

/* The resistors across the windings, which every leg feeds but those that float. */
INLINE void add_resistors(const circuit_t *c, double v_dc_V, shape_t shape, circuit_legs_t *legs)
{
    const bridge_t *b = &c->bridge;
    for (int k = 0; k < shape.legs; k++) {
        double i_A = 0.0;
        for (int a = first_of_leg(shape, k); a < end_of_leg(shape, k); a++) {
            i_A += c->machine.winding.axis[k][a] * b->g_winding_S * legs->v_V[a];
        }
        if (b->leg[k] == LEG_SOURCE) {
            legs->in_W += legs->v_leg_V[k] * i_A;
        } else if (b->leg[k] != LEG_FLOATING && b->leg[k] != LEG_SWINGING) {
            legs->i_dc_A += b->upper[k] * i_A;
            legs->device_W += (b->upper[k] * v_dc_V - legs->v_leg_V[k]) * i_A;
        }
        legs->i_leg_A[k] += i_A;
    }
}

INLINE double resistors_W(const circuit_t *c, const circuit_legs_t *legs, int n)
{
    double loss_W = 0.0;
    for (int a = 0; a < n; a++) {
        loss_W += c->machine.winding.weight[a] * c->bridge.g_winding_S * legs->v_V[a] * legs->v_V[a];
    }
    return loss_W;
}

INLINE void legs_n(const circuit_t *c, const point_t *p, shape_t shape, circuit_legs_t *legs)
{
    double v_dc_V = p->x[V_DC];
    legs->i_dc_A = c->bridge.g_through_S * v_dc_V;
    legs->device_W = c->bridge.g_through_S * v_dc_V * v_dc_V;
    legs->in_W = 0.0;
    for (int a = 0; a < shape.active; a++) {
        legs->v_V[a] = 0.0;
    }
    for (int k = 0; k < PLANT_LEGS; k++) {
        legs->v_leg_V[k] = 0.0;
    }
    for (int k = 0; k < shape.legs; k++) {
        add_leg(c, p, k, shape, legs);
    }
    if (c->bridge.g_winding_S > 0.0) {
        add_resistors(c, v_dc_V, shape, legs);
    }
    legs->in_W += v_dc_V * legs->i_dc_A;
}

WIDER void circuit_legs(const circuit_t *c, const point_t *p, circuit_legs_t *legs)
{
    if (c->machine.winding.active == STAR.active) {
        legs_n(c, p, STAR, legs);
    } else {
        legs_n(c, p, machine_shape(&c->machine), legs);
    }
}

INLINE void shaft_rates(const circuit_t *c, const point_t *p, double rate[ELEMENTS])
{
    rate[OMEGA_LOAD] = 0.0;
    rate[TWIST] = 0.0;
    if (mechanics_plain(&c->mech)) {
        rate[OMEGA_MECH] = mechanics_rate(&c->mech, p->x[OMEGA_MECH], p->torque_Nm);
        return;
    }
    mechanics_motion_t motion = circuit_motion(c, p);
    mechanics_motion_rate_t moved;
    mechanics_rates(&c->mech, &motion, p->torque_Nm, &moved);
    rate[OMEGA_MECH] = moved.omega_mech_rad_s2;
    rate[OMEGA_LOAD] = moved.omega_load_rad_s2;
    rate[TWIST] = moved.twist_rad_s;
}

INLINE double copper_W(const machine_t *m, const machine_state_t *s, const double i_A[ACTIVE], int n)
{
    double drop_V[ACTIVE];
    double loss_W = 0.0;
    machine_drop_n(m, i_A, drop_V, n);
    for (int a = 0; a < n; a++) {
        loss_W += m->winding.weight[a] * i_A[a] * drop_V[a];
    }
    for (int e = 0; e < 2 * PLANT_SETS && m->biased; e++) {
        loss_W += 1.5 * m->R_eddy_ohm * s->eddy_A[e] * s->eddy_A[e];
    }
    return loss_W;
}

INLINE void swing_rates(const circuit_t *c, const circuit_legs_t *legs, double rate[ELEMENTS])
{
    for (int k = 0; k < PLANT_LEGS; k++) {
        rate[V_LEG(k)] = 0.0;
    }
    for (unsigned swinging = c->bridge.swinging; swinging != 0u; swinging &= swinging - 1u) {
        int k = bridge_first(swinging);
        rate[V_LEG(k)] = -legs->i_leg_A[k] * c->bridge.inv_c_leg_1_F;
    }
}

INLINE void general_n(const circuit_t *c, double t_s, point_t *p, shape_t shape, double rate[ELEMENTS])
{
    const machine_t *m = &c->machine;
    machine_state_t state = circuit_machine_state(p);
    machine_point_t point;
    machine_rate_t moved;
    circuit_legs_t legs;
    bool floating = c->bridge.floating != 0u;
    double omega_e = m->pole_pairs * p->x[OMEGA_MECH];
    machine_evaluate_n(m, &state, shape, floating || !m->loose, &point);
    circuit_take(&point, shape.active, p);
    legs_n(c, p, shape, &legs);
    memset(&rate[U], 0, (ACTIVE + 2 * PLANT_SETS) * sizeof rate[U]);
    if (m->loose && !floating) {
        machine_loose_rates_n(m, &point, omega_e, legs.v_V, shape, &rate[U]);
    } else {
        if (floating) {
            floating_voltages(&c->bridge, m, &state, &point, omega_e, p->x[V_DC], legs.v_V, legs.v_leg_V,
                              &moved);
        } else {
            machine_rates_n(m, &state, &point, omega_e, legs.v_V, shape, &moved);
        }
        memcpy(&rate[U], moved.u, (size_t)shape.active * sizeof rate[U]);
        memcpy(&rate[EDDY], moved.eddy_A_s, 2 * (size_t)shape.sets * sizeof rate[U]);
    }
    swing_rates(c, &legs, rate);
    rate[THETA_E] = omega_e;
    shaft_rates(c, p, rate);
    rate[V_DC] = dclink_rate(&c->link, p->x[V_DC], legs.i_dc_A, t_s);
    rate[INT_V_ALPHA] = legs.v_V[0];
    rate[INT_V_BETA] = legs.v_V[1];
    rate[INT_IN] = legs.in_W;
    rate[INT_COPPER] = copper_W(m, &state, point.i_A, shape.active);
    if (c->bridge.g_winding_S > 0.0) {
        rate[INT_COPPER] += resistors_W(c, &legs, shape.active);
    }
    rate[INT_DEVICE] = legs.device_W;
    rate[INT_MECH] = p->torque_Nm * p->x[OMEGA_MECH];
}

WIDER void circuit_general(const circuit_t *c, double t_s, point_t *p, double rate[ELEMENTS])
{
    const winding_t *w = &c->machine.winding;
    if (w->branch >= 0) {
        general_n(c, t_s, p, machine_shape(&c->machine), rate);
    } else if (w->zero >= 0) {
        general_n(c, t_s, p, OPEN, rate);
    } else if (w->sets > 1) {
        general_n(c, t_s, p, DOUBLE, rate);
    } else {
        general_n(c, t_s, p, STAR, rate);
    }
}

INLINE void currents_n(const circuit_t *c, point_t *p, shape_t shape)
{
    machine_state_t state = circuit_machine_state(p);
    machine_point_t point;
    machine_evaluate_n(&c->machine, &state, shape, false, &point);
    circuit_take(&point, shape.active, p);
}

WIDER void circuit_currents(const circuit_t *c, point_t *p)
{
    const winding_t *w = &c->machine.winding;
    if (w->branch >= 0) {
        currents_n(c, p, machine_shape(&c->machine));
    } else if (w->zero >= 0) {
        currents_n(c, p, OPEN);
    } else if (w->sets > 1) {
        currents_n(c, p, DOUBLE);
    } else {
        currents_n(c, p, STAR);
    }
}
