/* The differential equations of circuit.h, inline: they are nearly all the time that the plant takes. */
#ifndef PLANT_CIRCUIT_RATES_H
#define PLANT_CIRCUIT_RATES_H

#include "sim_plant/circuit.h"

/* Corrects the flux rate of a motor with floating legs: one leg is held at zero current by its own voltage,
 * and with two there is none at all and the flux follows the magnet. */
void circuit_float_rate(const circuit_t *circuit, const point_t *point, double rate[]);

/* Moves the flux onto zero current of the floating legs. */
void circuit_project(const circuit_t *circuit, point_t *point);

/* Brings conduction and friction into the state that belongs to the present point. */
void circuit_settle(circuit_t *circuit);

static inline void circuit_currents(const machine_t *machine, point_t *p)
{
    p->psi_dq_Wb = frame_to_dq((ab_t){p->x[PSI_ALPHA], p->x[PSI_BETA]}, p->rotor);
    p->i_dq_A = machine_current_A(machine, p->psi_dq_Wb);
    p->i_A = frame_to_ab(p->i_dq_A, p->rotor);
    p->torque_Nm = machine_torque_Nm(machine, p->psi_dq_Wb, p->i_dq_A);
}

static inline void circuit_rates(const circuit_t *c, const point_t *p, double rate[])
{
    double v_dc = p->x[V_DC];
    double omega = p->x[OMEGA_MECH];
    ab_t i = p->i_A;
    ab_t drop = bridge_drop_V(&c->bridge, i);
    double R = c->machine.R_s_ohm + c->bridge.r_on_ohm;
    double i_dc = 1.5 * frame_dot(c->bridge.rail, i);

    rate[PSI_ALPHA] = c->bridge.rail.alpha * v_dc - drop.alpha - R * i.alpha;
    rate[PSI_BETA] = c->bridge.rail.beta * v_dc - drop.beta - R * i.beta;
    rate[THETA_E] = c->machine.pole_pairs * omega;
    rate[OMEGA_MECH] = mechanics_rate(&c->mech, omega, p->torque_Nm);
    rate[V_DC] = dclink_rate(&c->link, v_dc, i_dc);
    rate[INT_I_ALPHA] = i.alpha;
    rate[INT_I_BETA] = i.beta;
    rate[INT_I2] = frame_dot(i, i);
    rate[INT_DROP] = 1.5 * frame_dot(drop, i);
    rate[INT_IN] = v_dc * i_dc;
    rate[INT_MECH] = p->torque_Nm * omega;
    if (c->bridge.floating > 0) {
        circuit_float_rate(c, p, rate);
    }
}

#endif
