/* Machine, bridge, link and rotor as one system of differential equations between two gate changes.
 *
 * State: stator flux in the stationary frame (the terminal voltage integrates straight into it), rotor
 * angle, speed, link voltage; currents and torque follow from it algebraically. Six integrals ride along
 * for the mean voltage and the energy balance.
 *
 * circuit_advance() uses the Bogacki-Shampine 3(2) pair with error control; a step is as long as the
 * segment if the error allows it and the rotor turns by less than FRAME_TURN_MAX_RAD. Inside a segment it
 * finds the instants at which a diode stops or starts, or friction sticks or breaks away, to the margins
 * stated in bridge.c, and goes on from there; it asserts that this does not turn into chatter.
 *
 * The flux of a motor with floating legs is projected onto zero leg current after every step, so that the
 * error of integration does not leak into a current that cannot flow.
 *
 * Cost: three evaluations (about 50 multiplications each) a step. Tests: circuit_test.cpp, advance_test.cpp.
 */
#ifndef PLANT_CIRCUIT_H
#define PLANT_CIRCUIT_H

#include "sim_plant/bridge.h"
#include "sim_plant/dclink.h"
#include "sim_plant/machine.h"
#include "sim_plant/mechanics.h"

/* Elements of the state vector, and the integrals since the start that do not act back. */
enum {
    PSI_ALPHA, /* Wb */
    PSI_BETA,
    THETA_E, /* rad, unwrapped */
    OMEGA_MECH,
    V_DC,
    STATES,
    INT_I_ALPHA = STATES, /* A s */
    INT_I_BETA,
    INT_I2,   /* |i_alphabeta|^2, A^2 s */
    INT_DROP, /* loss in the constant drops, J */
    INT_IN,   /* from the link into the legs, J */
    INT_MECH, /* torque times speed, J */
    ELEMENTS
};

/* A point of the trajectory with what follows from it. */
typedef struct {
    double x[ELEMENTS];
    rotor_t rotor;
    ab_t i_A;
    dq_t psi_dq_Wb;
    dq_t i_dq_A;
    double torque_Nm;
} point_t;

typedef struct {
    machine_t machine;
    bridge_t bridge;
    dclink_t link;
    mechanics_t mech;
    point_t now;
    double e_copper_J, e_on_J; /* ohmic, up to the last change of resistance */
    double inv_tolerance;
    double inv_psi_scale_1_Wb;
    double inv_v_scale_1_V;
    double step_s; /* what the error control would allow next */
} circuit_t;

void circuit_init(circuit_t *circuit, const plant_config_t *config, double theta_e_rad);

/* Currents and torque anew after a jump of angle or parameters at unchanged flux. */
void circuit_refresh(circuit_t *circuit);

/* Exact cos and sin of the angle: sheds the rounding of many small turns. */
void circuit_align(circuit_t *circuit);

void circuit_switch(circuit_t *circuit, const gates_t *gates);
void circuit_advance(circuit_t *circuit, double duration_s);

motor_port_t circuit_port(const circuit_t *circuit, const point_t *point);

#endif
