#include "sim_plant/circuit_rates.h"
#include "sim_plant/floating.h"

#include <math.h>
#include <string.h>

#define FIRST_STEP 1e-3 /* of a PWM period: the error control lengthens it */
/* At a tolerance of 1e-6 a Heun step may decay and turn by this much, and swing: a commutation is a small
 * part of a swing of the winding with the output capacitance. Its error is then below 1e-7 of the change. */
#define CALM          0.01
#define SWING_SHARE   0.1
#define DAMPED        0.2   /* what dies out by itself, as the link on its source, may do more */
#define SLOPE_MARGIN  4.0   /* of v_dc / L: EMF, saturation */
#define SMALL_CURRENT 1e-12 /* of the converter's full scale: nothing, for a floating leg */

static void take_state(circuit_t *c, const machine_state_t *s, const machine_point_t *m)
{
    memcpy(&c->now.x[U], s->u, sizeof s->u);
    memcpy(&c->now.x[EDDY], s->eddy_A, sizeof s->eddy_A);
    circuit_take(&c->machine, m, &c->now);
    c->field_known = false;
}

/* A plain machine with every terminal tied or swinging */
static void plain_nodes(const circuit_t *c, const point_t *p, circuit_nodes_t *nodes)
{
    circuit_legs_t legs;
    circuit_legs(c, p, &legs);
    *nodes = (circuit_nodes_t){.i_dc_A = legs.i_dc_A};
    memcpy(nodes->v_leg_V, legs.v_leg_V, sizeof nodes->v_leg_V);
    nodes->v_neutral_V[0] = (legs.v_leg_V[0] + legs.v_leg_V[1] + legs.v_leg_V[2]) / 3.0;
}

static void all_nodes(const circuit_t *c, const point_t *p, const machine_state_t *state,
                      const machine_point_t *point, circuit_nodes_t *nodes)
{
    const machine_t *m = &c->machine;
    machine_rate_t moved = {0};
    circuit_legs_t legs;
    double omega_e = m->pole_pairs * p->x[OMEGA_MECH];
    circuit_legs(c, p, &legs);
    if (c->bridge.floating > 0) {
        floating_voltages(&c->bridge, m, state, point, omega_e, p->x[V_DC], legs.v_V, legs.v_leg_V, &moved);
    } else {
        machine_rates(m, state, point, omega_e, legs.v_V, &moved);
    }
    *nodes = (circuit_nodes_t){.i_dc_A = legs.i_dc_A};
    memcpy(nodes->v_leg_V, legs.v_leg_V, sizeof nodes->v_leg_V);
    for (int set = 0; set < m->winding.sets; set++) {
        const double *v = &legs.v_leg_V[3 * set];
        if (m->winding.zero >= 0) {
            nodes->v_zero_V[set] = legs.v_V[m->winding.zero];
            continue;
        }
        nodes->v_zero_V[set] =
            winding_zero_V(&m->winding, state->rotor, omega_e, point->i_A, moved.i_A_s, set);
        nodes->v_neutral_V[set] = (v[0] + v[1] + v[2]) / 3.0 - nodes->v_zero_V[set];
    }
}

/* Whether no star network sees anything */
static bool has_plain_nodes(const circuit_t *c)
{
    const winding_t *w = &c->machine.winding;
    return circuit_symmetrical(c) && c->machine.plain && w->flux_terms == 0 && w->inductance_terms == 0;
}

void circuit_nodes(const circuit_t *c, const point_t *p, circuit_nodes_t *nodes)
{
    if (has_plain_nodes(c)) {
        plain_nodes(c, p, nodes);
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
    } else {
        all_nodes(c, &c->now, state, machine, nodes);
    }
}

static double capacitor_J(const circuit_t *c, double v_V)
{
    return 0.5 * c->bridge.c_leg_F * v_V * v_V;
}

/* Voltage of an output capacitance */
static double output_V(const circuit_t *c, int k)
{
    const bridge_t *b = &c->bridge;
    double v_dc_V = c->now.x[V_DC];
    if (b->leg[k] == LEG_SWINGING) {
        return c->now.x[V_LEG(k)];
    }
    double diode_V =
        b->leg[k] == LEG_DIODE_HIGH ? b->v_diode_V : (b->leg[k] == LEG_DIODE_LOW ? -b->v_diode_V : 0.0);
    return b->upper[k] * v_dc_V + diode_V;
}

double circuit_field_of_J(const circuit_t *c, const machine_state_t *state, const machine_point_t *machine)
{
    double energy_J = machine_energy_J(&c->machine, state, machine);
    for (int k = 0; k < c->bridge.legs && c->bridge.c_leg_F > 0.0; k++) {
        energy_J += capacitor_J(c, output_V(c, k));
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

/* Leg k becomes another kind. What its capacitance holds more or less afterwards has come from the link if
 * the upper rail has it now, and the rest is lost in the switch. */
static void set_leg(circuit_t *c, int k, leg_t leg)
{
    bridge_t *b = &c->bridge;
    double before_V = output_V(c, k);
    if ((leg == LEG_LOW || leg == LEG_DIODE_LOW) && b->leg[k] != LEG_LOW && b->leg[k] != LEG_DIODE_LOW) {
        c->low_since_s[k] = c->t_s;
    }
    b->leg[k] = leg;
    if (b->c_leg_F == 0.0) {
        return;
    }
    if (leg == LEG_SWINGING) {
        c->now.x[V_LEG(k)] = before_V;
        return;
    }
    b->upper[k] = leg == LEG_HIGH || leg == LEG_DIODE_HIGH ? 1.0 : (leg == LEG_BOTH ? 0.5 : 0.0);
    double after_V = output_V(c, k);
    double charge_C = b->upper[k] == 1.0 ? b->c_leg_F * (after_V - before_V) : 0.0;
    double in_J = charge_C * c->now.x[V_DC];
    c->jump_in_J += in_J;
    c->jump_device_J += in_J + capacitor_J(c, before_V) - capacitor_J(c, after_V);
    c->now.x[V_DC] -= charge_C * c->link.inv_C_1_F;
}

/* Diodes of one rail alone, one or several, have no path back, so they carry nothing. Output capacitances are
 * one. */
static void drop_lone_diodes(circuit_t *c)
{
    bridge_t *b = &c->bridge;
    const winding_t *w = &c->machine.winding;
    if (b->diodes == 0 || b->floating == 0 || b->c_leg_F > 0.0 || w->branch >= 0) {
        return;
    }
    int size = w->legs > w->phases ? 2 : 3;
    int stride = w->legs > w->phases ? 3 : 1;
    for (int group = 0; group < w->legs / size; group++) {
        int first = w->legs > w->phases ? group : 3 * group;
        int conducting = 0;
        int low = 0;
        int high = 0;
        for (int n = 0; n < size; n++) {
            leg_t leg = b->leg[first + n * stride];
            conducting += leg != LEG_FLOATING;
            low += leg == LEG_DIODE_LOW;
            high += leg == LEG_DIODE_HIGH;
        }
        for (int n = 0; n < size && (conducting == low || conducting == high); n++) {
            b->leg[first + n * stride] = LEG_FLOATING;
        }
    }
    bridge_summarise(b, w);
}

static void summarise(circuit_t *c)
{
    bridge_summarise(&c->bridge, &c->machine.winding);
    drop_lone_diodes(c);
}

void circuit_switch(circuit_t *c, const gates_t *gates, unsigned legs)
{
    for (int k = 0; k < c->bridge.legs; k++) {
        if ((legs >> k & 1u) == 0u) {
            continue;
        }
        leg_t leg =
            bridge_commutated(&c->bridge, k, gates_conducting(gates, k), circuit_leg_A(c, &c->now, k));
        if (leg != c->bridge.leg[k]) {
            set_leg(c, k, leg);
        }
    }
    summarise(c);
}

static bool low_side(leg_t leg)
{
    return leg == LEG_LOW || leg == LEG_DIODE_LOW;
}

static bool high_side(leg_t leg)
{
    return leg == LEG_HIGH || leg == LEG_DIODE_HIGH;
}

bool circuit_ignores(const circuit_t *c, const gates_t *gates, unsigned legs, double within_s)
{
    const bridge_t *b = &c->bridge;
    if (b->v_diode_V != b->v_switch_V || b->floating > 0 || b->swinging > 0) {
        return false;
    }
    double slope_A_s = SLOPE_MARGIN * c->machine.gamma_sum_1_H * fabs(c->now.x[V_DC]);
    for (int k = 0; k < b->legs; k++) {
        if ((legs >> k & 1u) == 0u) {
            continue;
        }
        double i_A = circuit_leg_A(c, &c->now, k);
        leg_t leg = bridge_commutated(b, k, gates_conducting(gates, k), i_A);
        bool same = (low_side(leg) && low_side(b->leg[k])) || (high_side(leg) && high_side(b->leg[k]));
        if (!same || fabs(i_A) < 2.0 * b->zone_A + slope_A_s * within_s) {
            return false;
        }
    }
    return true;
}

void circuit_sources(circuit_t *c, const double v_leg_V[])
{
    for (int k = 0; k < c->bridge.legs; k++) {
        c->bridge.leg[k] = LEG_SOURCE;
        c->bridge.v_source_V[k] = v_leg_V[k];
    }
    summarise(c);
}

/* Moves the windings onto zero current of the floating legs. */
static void project(circuit_t *c)
{
    machine_state_t state = circuit_machine_state(&c->now);
    machine_point_t point;
    floating_project(&c->bridge, &c->machine, SMALL_CURRENT / c->inv_i_scale_1_A, &state, &point);
    take_state(c, &state, &point);
}

static void stop_diodes(circuit_t *c)
{
    bool stopped = false;
    for (int k = 0; k < c->bridge.legs && c->bridge.diodes > 0; k++) {
        if (bridge_is_diode(&c->bridge, k) &&
            bridge_reverse(&c->bridge, k, circuit_leg_A(c, &c->now, k)) > 0.0) {
            set_leg(c, k, c->bridge.c_leg_F > 0.0 ? LEG_SWINGING : LEG_FLOATING);
            stopped = true;
        }
    }
    if (stopped) {
        summarise(c);
    }
}

/* Swinging terminals that have arrived at a diode. */
static void catch_swinging(circuit_t *c)
{
    bool caught = false;
    for (int k = 0; k < c->bridge.legs && c->bridge.swinging > 0; k++) {
        if (c->bridge.leg[k] == LEG_SWINGING && circuit_swing_excess(c, &c->now, k) > 0.0) {
            bool up = c->now.x[V_LEG(k)] > 0.5 * c->now.x[V_DC];
            set_leg(c, k, up ? LEG_DIODE_HIGH : LEG_DIODE_LOW);
            caught = true;
        }
    }
    if (caught) {
        summarise(c);
    }
}

/* The floating leg furthest beyond a diode's threshold starts to conduct; true when there was one. */
static bool start_diode(circuit_t *c)
{
    circuit_nodes_t nodes;
    circuit_nodes(c, &c->now, &nodes);
    int first = -1;
    double most_V = 0.0;
    for (int k = 0; k < c->bridge.legs; k++) {
        if (c->bridge.leg[k] == LEG_FLOATING && !c->bridge.off_wire[k]) {
            double beyond_V = bridge_beyond_V(&c->bridge, c->now.x[V_DC], nodes.v_leg_V[k]);
            first = beyond_V > most_V ? k : first;
            most_V = fmax(beyond_V, most_V);
        }
    }
    if (first >= 0) {
        set_leg(c, first, nodes.v_leg_V[first] > 0.5 * c->now.x[V_DC] ? LEG_DIODE_HIGH : LEG_DIODE_LOW);
        bridge_summarise(&c->bridge, &c->machine.winding);
    }
    return first >= 0;
}

void circuit_settle_legs(circuit_t *c)
{
    if (c->bridge.diodes > 0) {
        stop_diodes(c);
    }
    if (c->bridge.swinging > 0) {
        catch_swinging(c);
    }
    if (c->bridge.floating > 0) {
        project(c);
        for (int n = 0; n < PLANT_LEGS && start_diode(c); n++) {
        }
    }
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
    c->calm_swing_s = c->calm / (fastest_1_s + SWING_SHARE * sqrt(gamma_1_H * c->bridge.inv_c_leg_1_F));
}

void circuit_align(circuit_t *c)
{
    double theta = c->now.x[THETA_E];
    c->now.rotor = (rotor_t){cos(theta), sin(theta)};
    find_calm(c);
}

/* After a jump of the currents: the diodes that they now flow through. */
static void reassign_diodes(circuit_t *c)
{
    for (int k = 0; k < c->bridge.legs; k++) {
        if (bridge_is_diode(&c->bridge, k)) {
            set_leg(c, k, bridge_released(&c->bridge, circuit_leg_A(c, &c->now, k)));
        }
    }
    summarise(c);
    circuit_settle(c);
}

static void refresh(circuit_t *c)
{
    circuit_align(c);
    circuit_currents(c, &c->now);
    project(c);
    reassign_diodes(c);
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
    c->bridge.leg[leg] = LEG_FLOATING; /* back on: its gate or a diode takes it again */
    summarise(c);
    project(c);
    c->jump_device_J += before_J - circuit_field_J(c);
    reassign_diodes(c);
}

void circuit_short(circuit_t *c, int leg_a, int leg_b, double R_ohm)
{
    double before_J = circuit_field_J(c);
    double axis[PLANT_LEGS] = {0.0};
    axis[leg_a] = 1.0;
    if (leg_b >= 0) {
        axis[leg_b] = -1.0;
    }
    machine_set_branch(&c->machine, axis, R_ohm);
    find_calm(c);
    for (int a = 2 * c->machine.winding.sets + (c->machine.winding.zero >= 0); a < ACTIVE; a++) {
        c->now.x[U + a] = 0.0;
    }
    bridge_summarise(&c->bridge, &c->machine.winding);
    project(c); /* a floating leg may have fed the branch that is gone */
    c->jump_device_J += before_J - circuit_field_J(c);
    reassign_diodes(c);
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
    c->inv_i_scale_1_A = 1.0 / config->sensor.i_full_scale_A;
    double weak_Wb = 0.1 * config->machine.L_d0_H * config->sensor.i_full_scale_A;
    c->inv_u_scale = config->map != NULL ? c->inv_i_scale_1_A : 1.0 / fmax(config->machine.psi_m_Wb, weak_Wb);
    c->inv_v_scale_1_V = 1.0 / fmax(config->dclink.v_source_V, 1.0);
    c->step_s = FIRST_STEP / config->inverter.f_pwm_Hz;
    c->now.x[THETA_E] = theta_e_rad;
    c->now.x[V_DC] = config->dclink.v_source_V;
    circuit_align(c);
    summarise(c);
    machine_state_t state = circuit_machine_state(&c->now);
    for (int set = 0; set < c->machine.winding.sets; set++) {
        machine_idle(&c->machine, &state, set);
    }
    machine_point_t point;
    machine_evaluate(&c->machine, &state, &point);
    take_state(c, &state, &point);
}
