/* Machine, bridge, link and rotor as one system of differential equations between two gate changes.
 *
 * State: the windings' (machine.h), rotor angle and speed, link voltage, voltages of swinging terminals,
 * second mass. Currents and torque follow from it algebraically. Integrals for the mean voltage and the
 * energy balance are integrated with it.
 *
 * circuit_advance() uses Taylor series of third order with error control where all phases are alike and every
 * leg is tied or swings (symmetrical.c), which is most of the time. All else (steps_general.c) is integrated
 * by the Bogacki-Shampine 3(2) pair, or by Heun's method where that is exact enough. A step is as long as the
 * segment if the error allows it and the rotor turns by less than FRAME_TURN_MAX_RAD. Inside a segment it
 * finds the instants at which a diode stops or starts, friction sticks or breaks away, or the chopper acts,
 * to the margins stated in bridge.c, and continues from there; it asserts that events do not chatter.
 *
 * The windings of floating legs are projected onto zero leg current after every step, so that the integration
 * error does not accumulate in a current that cannot flow.
 *
 * Tests: circuit_test.cpp, advance_test.cpp. */
#ifndef PLANT_CIRCUIT_H
#define PLANT_CIRCUIT_H

#include "sim_plant/bridge.h"
#include "sim_plant/dclink.h"
#include "sim_plant/field.h"
#include "sim_plant/lags.h"
#include "sim_plant/mechanics.h"
#include "sim_plant/probe.h"

#include <string.h>

/* Elements of the state vector. The INT_ do not act back: integrals since the start. What a plain machine has
 * lies in one piece, two by two; swinging terminals come before. */
enum {
    V_LEG_LAST, /* swinging terminals, V, the first leg last */
    OMEGA_MECH = PLANT_LEGS,
    V_DC,
    INT_IN,      /* from link or sources into the legs, J */
    INT_MECH,    /* torque times speed, J */
    INT_COPPER,  /* loss in the windings and eddy circuits, J */
    INT_DEVICE,  /* in switches and diodes, J */
    INT_V_ALPHA, /* terminal voltage of the first set, V s */
    INT_V_BETA,
    U, /* active coordinates of the windings, */
    U_ALPHA = U,
    U_BETA,
    EDDY = U + ACTIVE, /* and their eddy circuits */
    OMEGA_LOAD = EDDY + 2 * PLANT_SETS,
    TWIST,   /* rad */
    THETA_E, /* rad, unwrapped */
    ELEMENTS
};
#define V_LEG(k) (PLANT_LEGS - 1 - (k))

/* A point of the trajectory with what follows from it. */
typedef struct {
    _Alignas(16) double x[ELEMENTS];
    _Alignas(16) double i_A[ACTIVE];
    rotor_t rotor;
    double torque_Nm;
    _Alignas(16) double open_V[2]; /* of the active coordinates, where a step of two_phase.h began or ended */
} point_t;

typedef struct {
    machine_t machine;
    bridge_t bridge;
    dclink_t link;
    mechanics_t mech;
    probe_t probe;
    lags_t lags;
    bool probing; /* one of these has a memory */
    point_t now;
    point_t next;  /* the end of a step, until that is taken */
    field_t field; /* of the present point, when a symmetrical machine knows it */
    bool field_known;
    bool closed_form; /* machine, shaft and link are of those that steps_symmetrical() can do */
    bool in_blocks;   /* the legs commutate in blocks (gates.h) */
    int events;       /* since the end of a segment */
    double t_s;
    double period_start_s;
    double low_since_s[PLANT_LEGS];  /* when switch or diode of the negative rail began to conduct */
    double jump_in_J, jump_device_J; /* of charge that moves in no time */
    double inv_tolerance;
    double inv_u_scale;
    double inv_i_scale_1_A;
    double inv_v_scale_1_V;
    double step_s;                     /* what the error control would allow next */
    double calm, calm_s, calm_swing_s; /* what Heun's method may take, without and with swinging terminals */
} circuit_t;

void circuit_init(circuit_t *circuit, const plant_config_t *config, double theta_e_rad);

/* A jump of the rotor, or of the machine's parameters; the windings' state stays, so currents jump but for
 * those of floating legs. */
void circuit_turn(circuit_t *circuit, double angle_e_rad);
void circuit_set_machine(circuit_t *circuit, const plant_config_t *config, double winding_degC,
                         double magnet_degC);

/* Once a period: exact cos and sin of the angle sheds the rounding of many small turns, and the speed says
 * how long brief steps may be. */
void circuit_align(circuit_t *circuit);

/* Brings conduction, friction and chopper into the state that belongs to the present point: after any change
 * of load, speed or source. */
void circuit_settle(circuit_t *circuit);

/* The gates of the legs in the mask have changed. */
void circuit_switch(circuit_t *circuit, const gates_t *gates, unsigned legs);
/* The same within_s ahead of that change, if nothing shows it: legs pass between a diode and the switch
 * across it, with the same drop, and their currents cannot come near zero until then. False: nothing was
 * done. */
bool circuit_hand_over(circuit_t *circuit, const gates_t *gates, unsigned legs, double within_s);
static inline bool circuit_switch_early(circuit_t *c, const gates_t *gates, unsigned legs, double within_s)
{
    const bridge_t *b = &c->bridge;
    return b->v_diode_V == b->v_switch_V && (b->floating | b->swinging) == 0u &&
           circuit_hand_over(c, gates, legs, within_s);
}
void circuit_wire(circuit_t *circuit, int leg, bool off);
void circuit_short(circuit_t *circuit, int leg_a, int leg_b, double R_ohm);
void circuit_sources(circuit_t *circuit, const double v_leg_V[]);
/* Advances until the first event at most; returns the time left. */
double circuit_advance(circuit_t *circuit, double duration_s);

static inline double circuit_leg_A(const circuit_t *c, const point_t *p, int k)
{
    const winding_t *w = &c->machine.winding;
    double i_A = w->axis[k][0] * p->i_A[0] + w->axis[k][1] * p->i_A[1];
    for (int a = 2; a < w->active; a++) {
        i_A += w->axis[k][a] * p->i_A[a];
    }
    return i_A;
}

typedef struct {
    double v_leg_V[PLANT_LEGS];
    double v_neutral_V[PLANT_SETS];
    double v_zero_V[PLANT_SETS];
    double i_dc_A;
} circuit_nodes_t;

/* Voltages of all nodes, by the node equations where a terminal is tied to nothing (E11). */
void circuit_nodes(const circuit_t *circuit, const point_t *point, circuit_nodes_t *nodes);

/* Magnetic energy, and that of the output capacitances. */
double circuit_field_J(const circuit_t *circuit);

/* Both at the present point, whose machine has been evaluated. */
void circuit_nodes_of(const circuit_t *circuit, const machine_state_t *state, const machine_point_t *machine,
                      circuit_nodes_t *nodes);
double circuit_field_of_J(const circuit_t *circuit, const machine_state_t *state,
                          const machine_point_t *machine);

static inline machine_state_t circuit_machine_state(const point_t *p)
{
    machine_state_t s;
    s.rotor = p->rotor;
    s.theta_e_rad = p->x[THETA_E];
    memcpy(s.u, &p->x[U], sizeof s.u);
    memcpy(s.eddy_A, &p->x[EDDY], sizeof s.eddy_A);
    return s;
}

#endif
