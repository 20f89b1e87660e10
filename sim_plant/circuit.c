#include "sim_plant/circuit_rates.h"

#include <math.h>
#include <string.h>

#define FIRST_STEP 1e-3 /* of a PWM period: the error control lengthens it */
/* At a tolerance of 1e-6 a Heun step may decay and turn by this much, and swing: a commutation is a small
 * part of a swing of the winding with the output capacitance. Its error is then below 1e-7 of the change. */
#define CALM        0.01
#define SWING_SHARE 0.1
#define DAMPED      0.2 /* what dies out by itself, as the link on its source, may do more */

void circuit_take_state(circuit_t *c, const machine_state_t *s, const machine_point_t *m)
{
    memcpy(&c->now.x[U], s->u, sizeof s->u);
    memcpy(&c->now.x[EDDY], s->eddy_A, sizeof s->eddy_A);
    circuit_take(m, c->machine.winding.active, &c->now);
    c->field_known = false;
}

void circuit_settle(circuit_t *c)
{
    circuit_settle_legs(c);
    mechanics_motion_t motion = circuit_motion(c, &c->now);
    c->now.x[OMEGA_MECH] = mechanics_settle(&c->mech, &motion, c->now.torque_Nm);
    dclink_settle(&c->link, c->now.x[V_DC]);
}

/* Of shaft, rotor in its field, and link with the windings: undamped they must not gain energy. */
static double oscillation_1_s(const circuit_t *c, double inv_J)
{
    const plant_mech_t *m = &c->mech.parameters;
    double psi_Wb = c->machine.pole_pairs * c->machine.psi_m_Wb;
    double gamma_1_H = c->machine.gamma_sum_1_H;
    double stiffness_Nm = m->k_shaft_Nm + 1.5 * psi_Wb * psi_Wb * gamma_1_H;
    return sqrt(stiffness_Nm * inv_J) + sqrt(gamma_1_H * c->link.inv_C_1_F);
}

static double damping_1_s(const circuit_t *c, double inv_J)
{
    const plant_mech_t *m = &c->mech.parameters;
    double omega = fabs(c->now.x[OMEGA_MECH]) + fabs(c->now.x[OMEGA_LOAD]);
    double damping_Nms = m->B_Nms + m->d_shaft_Nms + m->load_Nms + 2.0 * m->load_Nms2 * omega;
    return damping_Nms * inv_J + (c->link.g_source_S + c->link.g_chopper_S) * c->link.inv_C_1_F;
}

/* Longest steps of Heun's method, which checks nothing. */
static void find_calm(circuit_t *c)
{
    const plant_mech_t *m = &c->mech.parameters;
    double inv_J = 1.0 / m->J_kgm2 + (m->J_load_kgm2 > 0.0 ? 1.0 / m->J_load_kgm2 : 0.0);
    double gamma_1_H = c->machine.gamma_sum_1_H;
    double fastest_1_s = c->machine.fastest_1_s + gamma_1_H * c->bridge.r_on_ohm +
                         c->machine.pole_pairs * fabs(c->now.x[OMEGA_MECH]) + oscillation_1_s(c, inv_J) +
                         CALM / DAMPED * damping_1_s(c, inv_J);
    c->calm_s = c->calm / fastest_1_s;
    double swing_1_s = sqrt(gamma_1_H * c->bridge.inv_c_leg_1_F);
    double damping = c->bridge.g_winding_S * c->bridge.inv_c_leg_1_F;
    c->calm_swing_s = c->calm / (fastest_1_s + SWING_SHARE * (swing_1_s + damping));
}

/* What follows from machine, shaft and link as they are. */
static void choose_steps(circuit_t *c)
{
    c->closed_form = c->machine.symmetrical && c->machine.winding.branch < 0 && mechanics_plain(&c->mech) &&
                     dclink_plain(&c->link);
    find_calm(c);
}

void circuit_align(circuit_t *c)
{
    double theta = c->now.x[THETA_E];
    c->now.rotor = (rotor_t){cos(theta), sin(theta)};
    choose_steps(c);
}

static void refresh(circuit_t *c)
{
    circuit_align(c);
    circuit_currents(c, &c->now);
    circuit_project(c);
    circuit_reassign_diodes(c);
}

void circuit_turn(circuit_t *c, double angle_e_rad)
{
    c->now.x[THETA_E] += angle_e_rad;
    refresh(c);
}

void circuit_set_machine(circuit_t *c, const plant_config_t *config, double winding_degC, double magnet_degC)
{
    int branch = c->machine.winding.branch;
    double axis[PLANT_LEGS] = {0.0};
    for (int k = 0; k < c->bridge.legs && branch >= 0; k++) {
        axis[k] = c->machine.winding.axis[k][branch];
    }
    double R_ohm = branch >= 0 ? c->machine.winding.R_ohm[branch][branch] : -1.0;
    machine_set(&c->machine, config, winding_degC, magnet_degC);
    machine_set_branch(&c->machine, axis, R_ohm);
    bridge_summarise(&c->bridge, &c->machine.winding);
    refresh(c);
}

void circuit_wire(circuit_t *c, int leg, bool off)
{
    double before_J = circuit_field_J(c);
    c->bridge.off_wire[leg] = off;
    bridge_put(&c->bridge, leg, LEG_FLOATING); /* back on: its gate or a diode takes it again */
    circuit_summarise(c);
    circuit_project(c);
    c->jump_device_J += before_J - circuit_field_J(c);
    circuit_reassign_diodes(c);
}

/* The legs that now have no output capacitance; those that have it again swing from where they are. */
static void bare_outputs(circuit_t *c, unsigned bare)
{
    bridge_t *b = &c->bridge;
    double v_leg_V[PLANT_LEGS] = {0.0};
    if ((b->bare & b->floating) != 0u) {
        circuit_terminals(c, &c->now, v_leg_V);
    }
    for (int k = 0; k < b->legs; k++) {
        bool was = (b->bare >> k & 1u) != 0u, is = (bare >> k & 1u) != 0u;
        if (is && b->leg[k] == LEG_SWINGING) {
            bridge_put(b, k, LEG_FLOATING);
        } else if (was && !is && b->leg[k] == LEG_FLOATING && !b->off_wire[k] && b->c_leg_F > 0.0) {
            bridge_put(b, k, LEG_SWINGING);
            c->now.x[V_LEG(k)] = v_leg_V[k];
        }
    }
    b->bare = bare;
}

void circuit_short(circuit_t *c, int leg_a, int leg_b, double R_ohm)
{
    double before_J = circuit_field_J(c);
    double axis[PLANT_LEGS] = {0.0};
    unsigned legs = 1u << leg_a;
    axis[leg_a] = 1.0;
    if (leg_b >= 0) {
        axis[leg_b] = -1.0;
        legs |= 1u << leg_b;
    }
    bare_outputs(c, R_ohm < 0.0 ? 0u : legs);
    machine_set_branch(&c->machine, axis, R_ohm);
    choose_steps(c);
    for (int a = 2 * c->machine.winding.sets + (c->machine.winding.zero >= 0); a < ACTIVE; a++) {
        c->now.x[U + a] = 0.0;
    }
    bridge_summarise(&c->bridge, &c->machine.winding);
    circuit_project(c); /* a floating leg may have fed the branch that is gone */
    c->jump_device_J += before_J - circuit_field_J(c);
    circuit_reassign_diodes(c);
}

void circuit_init(circuit_t *c, const plant_config_t *config, double theta_e_rad)
{
    *c = (circuit_t){.inv_tolerance = 1.0 / (config->tolerance > 0.0 ? config->tolerance : 1e-6)};
    c->calm = CALM * cbrt(1e6 / c->inv_tolerance);
    machine_set(&c->machine, config, 25.0, 25.0);
    bridge_init(&c->bridge, config, c->machine.winding.legs);
    dclink_init(&c->link, &config->dclink);
    mechanics_init(&c->mech, &config->mech);
    probe_init(&c->probe, &config->sensor, c->machine.winding.legs, c->machine.winding.sets);
    lags_init(&c->lags, &config->sensor, c->machine.winding.legs);
    c->probing = probe_active(&c->probe) || lags_active(&c->lags);
    c->inv_i_scale_1_A = 1.0 / config->sensor.i_full_scale_A;
    double weak_Wb = 0.1 * config->machine.L_d0_H * config->sensor.i_full_scale_A;
    c->inv_u_scale = config->map != NULL ? c->inv_i_scale_1_A : 1.0 / fmax(config->machine.psi_m_Wb, weak_Wb);
    c->inv_v_scale_1_V = 1.0 / fmax(config->dclink.v_source_V, 1.0);
    c->step_s = FIRST_STEP / config->inverter.f_pwm_Hz;
    c->now.x[THETA_E] = theta_e_rad;
    c->now.x[V_DC] = config->dclink.v_source_V;
    circuit_align(c);
    circuit_summarise(c);
    machine_state_t state = circuit_machine_state(&c->now);
    for (int set = 0; set < c->machine.winding.sets; set++) {
        machine_idle(&c->machine, &state, set);
    }
    machine_point_t point;
    machine_evaluate(&c->machine, &state, &point);
    circuit_take_state(c, &state, &point);
}
