/* The differential equations of circuit.h, for its parts. */
#ifndef PLANT_CIRCUIT_RATES_H
#define PLANT_CIRCUIT_RATES_H

#include "sim_plant/circuit.h"

#include <math.h>

/* What an evaluation of the machine leaves at a point; n: the active coordinates, as in winding_at(). */
static inline void circuit_take(const machine_point_t *from, int n, point_t *to)
{
    for (int a = 0; a < n; a++) {
        to->i_A[a] = from->i_A[a];
    }
    to->torque_Nm = from->torque_Nm;
}

/* What the legs do at a point: voltages of the active coordinates, and of those legs that do not float. */
typedef struct {
    double v_V[ACTIVE];
    double v_leg_V[PLANT_LEGS];
    double i_leg_A[PLANT_LEGS];
    double i_dc_A, in_W, device_W;
} circuit_legs_t;

void circuit_legs(const circuit_t *circuit, const point_t *point, circuit_legs_t *legs);

/* Voltages of all terminals where some float, without what neutrals need beyond. */
void circuit_terminals(const circuit_t *circuit, const point_t *point, double v_leg_V[PLANT_LEGS]);

/* Currents, torque and rates of any machine, bridge, link and shaft; t_s since the start. */
void circuit_general(const circuit_t *circuit, double t_s, point_t *point, double rate[ELEMENTS]);

/* Currents and torque alone. */
void circuit_currents(const circuit_t *circuit, point_t *point);

/* The windings' state, and what follows from it, into the present point. */
void circuit_take_state(circuit_t *circuit, const machine_state_t *state, const machine_point_t *machine);

/* Energy of a leg's output capacitance at a voltage, and the voltage that it has. */
static inline double circuit_capacitor_J(const circuit_t *c, int k, double v_V)
{
    return 0.5 * bridge_output_F(&c->bridge, k) * v_V * v_V;
}

static inline double circuit_output_V(const circuit_t *c, int k)
{
    const bridge_t *b = &c->bridge;
    if (b->leg[k] == LEG_SWINGING) {
        return c->now.x[V_LEG(k)];
    }
    const bridge_kind_t *is = &bridge_kinds[b->leg[k]];
    return is->upper * c->now.x[V_DC] + is->diode * b->v_diode_V;
}

/* What follows from the legs; moves the windings onto zero current of the floating ones; after a jump of the
 * currents: the diodes that they now flow through. */
void circuit_summarise(circuit_t *circuit);
void circuit_project(circuit_t *circuit);
void circuit_reassign_diodes(circuit_t *circuit);

/* Rates of the currents at the present point of a symmetrical circuit whose field is known. */
void circuit_symmetrical_rates(const circuit_t *circuit, double i_A_s[ACTIVE]);

/* With circuit_two_phase(): moves the windings onto zero current of the floating legs, if one has more than
 * that. */
void circuit_settle_two_phase(circuit_t *circuit, double small_A);

/* Then voltages of all terminals and rates of the currents at a point; or the voltages alone, where a step
 * began or ended. */
void circuit_two_phase_at(const circuit_t *circuit, const point_t *point, double v_leg_V[PLANT_LEGS],
                          double i_A_s[ACTIVE]);
void circuit_two_phase_terminals(const circuit_t *circuit, const point_t *point, double v_leg_V[PLANT_LEGS]);

/* Brings the conduction of the legs into the state that belongs to the present point. */
void circuit_settle_legs(circuit_t *circuit);

/* A swinging terminal counts as arrived this close to a diode's threshold, relative to the link. */
#define SNAP 1e-4

/* Above zero once the terminal of leg k has arrived at the diode that its current drives it to. */
static inline double circuit_swing_excess(const circuit_t *c, const point_t *p, int k)
{
    double v_V = p->x[V_LEG(k)];
    double v_dc_V = p->x[V_DC];
    double beyond_V = circuit_leg_A(c, p, k) > 0.0 ? -v_V : v_V - v_dc_V;
    return (beyond_V - c->bridge.v_diode_V) / (fabs(v_dc_V) + 1.0) + SNAP;
}

static inline mechanics_motion_t circuit_motion(const circuit_t *c, const point_t *p)
{
    return (mechanics_motion_t){
        .omega_mech_rad_s = p->x[OMEGA_MECH],
        .theta_mech_rad = p->x[THETA_E] / c->machine.pole_pairs,
        .omega_load_rad_s = p->x[OMEGA_LOAD],
        .twist_rad = p->x[TWIST],
    };
}

/* Legs of a symmetrical star float in block commutation, the others are tied (two_phase.h). Gaps of the dead
 * time and a bridge that is off take the general way. */
static inline bool circuit_two_phase(const circuit_t *c)
{
    return c->in_blocks && c->closed_form && c->bridge.floating != 0u &&
           (c->bridge.swinging | c->bridge.both) == 0u && c->machine.winding.active == 2;
}

/* What steps_symmetrical() can do: every leg tied or swinging, or that; and nothing that needs the time. */
static inline bool circuit_symmetrical(const circuit_t *c)
{
    return c->closed_form && (c->bridge.floating | c->bridge.both) == 0u;
}

#endif
