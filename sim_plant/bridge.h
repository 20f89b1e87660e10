/* Three-leg bridge: which rail each motor terminal is tied to, and through what (METHODS.md 0.2 E6, E10).
 *
 * A leg is tied to a rail by a closed switch (either direction of current, drop v_switch against it), or by
 * a diode (one direction, drop v_diode), or it floats: no current, and its terminal takes the voltage that
 * keeps it so, which must lie between the rails widened by a diode drop. All paths have r_on in series.
 *
 * A switch drop reverses over +-zone_A with continuous slope instead of jumping, so that a current
 * creeping through zero under a closed switch makes no train of events. zone_A is a 2000th of the
 * converter's full scale, the step of 12 bits.
 *
 * The star point is not connected, so only differences of leg voltages act, and a motor with two floating
 * legs carries no current at all. Tests: bridge_test.cpp. */
#ifndef PLANT_BRIDGE_H
#define PLANT_BRIDGE_H

#include "sim_plant/frame.h"
#include "sim_plant/gates.h"
#include "sim_plant/machine.h"

typedef enum { LEG_FLOATING, LEG_LOW, LEG_HIGH, LEG_DIODE_LOW, LEG_DIODE_HIGH } leg_t;

typedef struct {
    double v_switch_V;
    double v_diode_V;
    double r_on_ohm;
    double zone_A;
    double switched_1_A; /* 1 / zone_A */
    leg_t leg[PLANT_LEGS];
    /* what follows from leg[] */
    int floating;
    int diodes;
    ab_t rail;                       /* (2/3) sum of the axes tied to the upper rail */
    ab_t diode_drop_V;               /* sum of the constant drops */
    double inv_zone_1_A[PLANT_LEGS]; /* 0: no switch closed */
} bridge_t;

/* Electrical state of the motor as the bridge sees it. */
typedef struct {
    ab_t psi_Wb, i_A;
    rotor_t rotor;
    double omega_e_rad_s;
    double v_dc_V;
} motor_port_t;

void bridge_init(bridge_t *bridge, const plant_config_t *config);

/* After a change of gates: closed switches take their legs; a leg whose switches have opened passes to the
 * diode that its current needs, or floats. */
void bridge_switch(bridge_t *bridge, const gates_t *gates, ab_t i_A);

/* Legs without gate re-assigned after a jump of current (rotor slip, parameter change). */
void bridge_reassign(bridge_t *bridge, ab_t i_A);

/* Diodes whose current has passed zero cease. */
void bridge_stop_diodes(bridge_t *bridge, ab_t i_A);

/* Floating legs beyond a rail start to conduct; expects the current of floating legs to be zero. */
void bridge_start_diodes(bridge_t *bridge, const machine_t *machine, const motor_port_t *port);

/* Above zero once one of the two would change something. */
double bridge_excess(const bridge_t *bridge, const machine_t *machine, const motor_port_t *port);

/* Voltage of floating leg k against the negative rail. Nothing fixes the potential of three floating legs;
 * their highest and lowest are then taken to lie evenly between the rails. */
double bridge_floating_V(const bridge_t *bridge, const machine_t *machine, const motor_port_t *port, int k);

/* Voltage of any leg against the negative rail. */
double bridge_leg_V(const bridge_t *bridge, const machine_t *machine, const motor_port_t *port, int k);

/* Drop of a closed switch at a current x in units of the zone, in units of v_switch. */
static inline double bridge_switch_share(double x)
{
    x = x > 1.0 ? 1.0 : x;
    x = x < -1.0 ? -1.0 : x;
    return x * (1.5 - 0.5 * x * x);
}

/* All drops but r_on, as a voltage of the motor. */
static inline ab_t bridge_drop_V(const bridge_t *b, ab_t i_A)
{
    if (b->v_switch_V == 0.0) {
        return b->diode_drop_V;
    }
    abc_t i = frame_to_abc(i_A);
    abc_t share;
    for (int k = 0; k < PLANT_LEGS; k++) {
        share.x[k] = bridge_switch_share(i.x[k] * b->inv_zone_1_A[k]);
    }
    ab_t v = frame_from_abc(share);
    v.alpha = b->diode_drop_V.alpha + b->v_switch_V * v.alpha;
    v.beta = b->diode_drop_V.beta + b->v_switch_V * v.beta;
    return v;
}

#endif
