/* The differential equations of circuit.h. Those of a plain machine without floating legs are inline: they
 * are nearly all the time that the plant takes. */
#ifndef PLANT_CIRCUIT_RATES_H
#define PLANT_CIRCUIT_RATES_H

#include "sim_plant/circuit.h"

#include <math.h>

/* What an evaluation of the machine leaves at a point. */
static inline void circuit_take(const machine_t *machine, const machine_point_t *from, point_t *to)
{
    for (int a = 0; a < machine->winding.active; a++) {
        to->i_A[a] = from->i_A[a];
    }
    to->torque_Nm = from->torque_Nm;
    if (machine->winding.flux_series_terms > 0) {
        to->psi_theta_Wb[0] = from->series.psi_theta[0];
        to->psi_theta_Wb[1] = from->series.psi_theta[1];
    }
}

/* What the legs do at a point: voltages of the active coordinates, and of those legs that do not float. */
typedef struct {
    double v_V[ACTIVE];
    double v_leg_V[PLANT_LEGS];
    double i_leg_A[PLANT_LEGS];
    double i_dc_A, in_W, device_W;
} circuit_legs_t;

void circuit_legs(const circuit_t *circuit, const point_t *point, circuit_legs_t *legs);

/* Currents, torque and rates of any machine, bridge, link and shaft; t_s since the start. */
void circuit_general(const circuit_t *circuit, double t_s, point_t *point, double rate[ELEMENTS]);

/* Currents and torque alone. */
void circuit_currents(const circuit_t *circuit, point_t *point);

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

static inline bool circuit_plain(const circuit_t *c)
{
    return c->machine.plain && c->machine.winding.branch < 0 && c->bridge.floating == 0 &&
           mechanics_plain(&c->mech) && dclink_plain(&c->link);
}

static inline void plain_harmonics(const machine_t *machine, point_t *p)
{
    rotor_t turn = {1.0, 0.0};
    int order = 0;
    for (int t = 0; t < machine->winding.flux_series_terms; t++) {
        const flux_series_t *term = &machine->winding.flux_series[t];
        turn = winding_next(p->rotor, turn, &order, term->order);
        p->psi_theta_Wb[0] += term->order * (term->sine[0] * turn.c - term->cosine[0] * turn.s);
        p->psi_theta_Wb[1] += term->order * (term->sine[1] * turn.c - term->cosine[1] * turn.s);
    }
    p->torque_Nm += machine->torque_gain * (p->psi_theta_Wb[0] * p->i_A[0] + p->psi_theta_Wb[1] * p->i_A[1]);
}

static inline __attribute__((always_inline)) void plain_currents(const machine_t *machine, point_t *p)
{
    dq_t psi = frame_to_dq((ab_t){p->x[U_ALPHA], p->x[U_BETA]}, p->rotor);
    dq_t i_dq = machine_current_A(machine, psi);
    ab_t i = frame_to_ab(i_dq, p->rotor);
    p->i_A[0] = i.alpha;
    p->i_A[1] = i.beta;
    p->torque_Nm = machine_torque_Nm(machine, psi, i_dq);
    p->psi_theta_Wb[0] = 0.0;
    p->psi_theta_Wb[1] = 0.0;
    if (machine->winding.flux_series_terms > 0) {
        plain_harmonics(machine, p);
    }
}

/* Voltage of swinging terminals, whose current charges their capacitance. */
static inline void plain_swing(const circuit_t *c, const point_t *p, abc_t i, ab_t *v, double rate[])
{
    abc_t swing;
    for (int k = 0; k < 3; k++) {
        bool swings = c->bridge.leg[k] == LEG_SWINGING;
        swing.x[k] = swings ? p->x[V_LEG(k)] : 0.0;
        rate[V_LEG(k)] = swings ? -i.x[k] * c->bridge.inv_c_leg_1_F : 0.0;
    }
    ab_t added = frame_from_abc(swing);
    v->alpha += added.alpha;
    v->beta += added.beta;
}

static inline __attribute__((always_inline)) void plain_rates(const circuit_t *c, const point_t *p,
                                                              bool swings, double rate[])
{
    const bridge_t *b = &c->bridge;
    double v_dc = p->x[V_DC];
    double omega = p->x[OMEGA_MECH];
    ab_t i = {p->i_A[0], p->i_A[1]};
    ab_t drop = {b->r_series_ohm * i.alpha - b->diode_V[0], b->r_series_ohm * i.beta - b->diode_V[1]};
    abc_t i_leg = frame_to_abc(i);
    if (b->v_switch_V != 0.0) {
        abc_t share;
        for (int k = 0; k < 3; k++) {
            share.x[k] = bridge_switch_share(i_leg.x[k] * b->inv_zone_1_A[k]);
        }
        ab_t v = frame_from_abc(share);
        drop.alpha += b->v_switch_V * v.alpha;
        drop.beta += b->v_switch_V * v.beta;
    }
    ab_t v = {b->rail[0] * v_dc + b->source_V[0] - drop.alpha,
              b->rail[1] * v_dc + b->source_V[1] - drop.beta};
    if (swings) {
        plain_swing(c, p, i_leg, &v, rate);
    }
    double R = c->machine.R_s_ohm;
    double i_dc = 1.5 * (b->rail[0] * i.alpha + b->rail[1] * i.beta) + b->g_through_S * v_dc;
    rate[U_ALPHA] = v.alpha - R * i.alpha;
    rate[U_BETA] = v.beta - R * i.beta;
    if (c->machine.winding.flux_series_terms > 0) {
        double omega_e = c->machine.pole_pairs * omega;
        rate[U_ALPHA] -= omega_e * p->psi_theta_Wb[0];
        rate[U_BETA] -= omega_e * p->psi_theta_Wb[1];
    }
    rate[THETA_E] = c->machine.pole_pairs * omega;
    rate[OMEGA_MECH] = mechanics_rate(&c->mech, omega, p->torque_Nm);
    rate[V_DC] = dclink_rate(&c->link, v_dc, i_dc, 0.0);
    rate[INT_V_ALPHA] = v.alpha;
    rate[INT_V_BETA] = v.beta;
    rate[INT_IN] = v_dc * i_dc + 1.5 * (b->source_V[0] * i.alpha + b->source_V[1] * i.beta);
    rate[INT_COPPER] = 1.5 * R * frame_dot(i, i);
    rate[INT_DEVICE] = 1.5 * frame_dot(drop, i) + b->g_through_S * v_dc * v_dc;
    rate[INT_MECH] = p->torque_Nm * omega;
}

#endif
