#include "sim_plant/circuit_rates.h"

#include <math.h>

motor_port_t circuit_port(const circuit_t *circuit, const point_t *point)
{
    return (motor_port_t){
        .psi_Wb = {point->x[PSI_ALPHA], point->x[PSI_BETA]},
        .i_A = point->i_A,
        .rotor = point->rotor,
        .omega_e_rad_s = circuit->machine.pole_pairs * point->x[OMEGA_MECH],
        .v_dc_V = point->x[V_DC],
    };
}

void circuit_float_rate(const circuit_t *c, const point_t *p, double rate[])
{
    motor_port_t port = circuit_port(c, p);
    if (c->bridge.floating > 1) {
        rate[PSI_ALPHA] = -port.omega_e_rad_s * port.psi_Wb.beta;
        rate[PSI_BETA] = port.omega_e_rad_s * port.psi_Wb.alpha;
        /* the stages of a step lie beside the circle of the magnet's flux: their currents are not real */
        rate[OMEGA_MECH] = mechanics_rate(&c->mech, p->x[OMEGA_MECH], 0.0);
        rate[V_DC] = dclink_rate(&c->link, p->x[V_DC], 0.0);
        for (int e = STATES; e < ELEMENTS; e++) {
            rate[e] = 0.0;
        }
        return;
    }
    for (int k = 0; k < PLANT_LEGS; k++) {
        if (c->bridge.leg[k] == LEG_FLOATING) {
            double v_V = 2.0 / 3.0 * bridge_floating_V(&c->bridge, &c->machine, &port, k);
            rate[PSI_ALPHA] += frame_axis[k].alpha * v_V;
            rate[PSI_BETA] += frame_axis[k].beta * v_V;
        }
    }
}

/* Newton's steps onto zero current of leg k along the axis of that leg. One is enough after a step of the
 * integrator, but not after a jump of the rotor. The stored energy is convex, so they converge. */
static void project_leg(const circuit_t *c, point_t *p, int k)
{
    ab_t axis = frame_axis[k];
    double move_Wb;
    int left = 20;
    do {
        dq_t axis_dq = frame_to_dq(axis, p->rotor);
        machine_tangent_t g = machine_tangent_1_H(&c->machine, p->psi_dq_Wb);
        double stiffness_1_H = axis_dq.d * (g.d * axis_dq.d + g.dq * axis_dq.q) +
                               axis_dq.q * (g.dq * axis_dq.d + g.q * axis_dq.q);
        move_Wb = -frame_dot(axis, p->i_A) / stiffness_1_H;
        p->x[PSI_ALPHA] += axis.alpha * move_Wb;
        p->x[PSI_BETA] += axis.beta * move_Wb;
        circuit_currents(&c->machine, p);
    } while (fabs(move_Wb) * c->inv_psi_scale_1_Wb > 1e-7 && --left > 0);
}

void circuit_project(const circuit_t *c, point_t *p)
{
    if (c->bridge.floating > 1) {
        p->x[PSI_ALPHA] = c->machine.psi_m_Wb * p->rotor.c;
        p->x[PSI_BETA] = c->machine.psi_m_Wb * p->rotor.s;
        circuit_currents(&c->machine, p);
        p->i_A = (ab_t){0.0, 0.0};
        p->i_dq_A = (dq_t){0.0, 0.0};
        p->torque_Nm = 0.0;
        return;
    }
    for (int k = 0; k < PLANT_LEGS && c->bridge.floating > 0; k++) {
        if (c->bridge.leg[k] == LEG_FLOATING) {
            project_leg(c, p, k);
        }
    }
}

/* Brings conduction and friction into the state that belongs to this point. */
void circuit_settle(circuit_t *c)
{
    point_t *p = &c->now;
    bridge_stop_diodes(&c->bridge, p->i_A);
    if (c->bridge.floating > 0) {
        circuit_project(c, p);
        motor_port_t port = circuit_port(c, p);
        bridge_start_diodes(&c->bridge, &c->machine, &port);
    }
    p->x[OMEGA_MECH] = mechanics_settle(&c->mech, p->x[OMEGA_MECH], p->torque_Nm);
}

void circuit_switch(circuit_t *circuit, const gates_t *gates)
{
    bridge_switch(&circuit->bridge, gates, circuit->now.i_A);
}

void circuit_align(circuit_t *circuit)
{
    double theta = circuit->now.x[THETA_E];
    circuit->now.rotor = (rotor_t){cos(theta), sin(theta)};
}

void circuit_refresh(circuit_t *circuit)
{
    circuit_align(circuit);
    circuit_currents(&circuit->machine, &circuit->now);
    circuit_project(circuit, &circuit->now);
    bridge_reassign(&circuit->bridge, circuit->now.i_A);
    circuit_settle(circuit);
}

void circuit_init(circuit_t *circuit, const plant_config_t *config, double theta_e_rad)
{
    *circuit = (circuit_t){.inv_tolerance = 1.0 / (config->tolerance > 0.0 ? config->tolerance : 1e-6)};
    machine_set(&circuit->machine, &config->machine);
    bridge_init(&circuit->bridge, config);
    dclink_init(&circuit->link, &config->dclink);
    mechanics_init(&circuit->mech, &config->mech);
    double weak_Wb = 0.1 * config->machine.L_d0_H * config->sensor.i_full_scale_A;
    circuit->inv_psi_scale_1_Wb = 1.0 / fmax(config->machine.psi_m_Wb, weak_Wb);
    circuit->inv_v_scale_1_V = 1.0 / fmax(config->dclink.v_source_V, 1.0);
    circuit->step_s = 1.0 / config->inverter.f_pwm_Hz;
    circuit->now.x[THETA_E] = theta_e_rad;
    circuit->now.x[V_DC] = config->dclink.v_source_V;
    circuit_align(circuit);
    circuit_project(circuit, &circuit->now);
}
