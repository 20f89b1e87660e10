#include "sim_plant/circuit_rates.h"
#include "sim_plant/machine_rates.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#define MAX_EVENTS                                                                                           \
    10000 /* of a segment, as where a short rings with output capacitances; more would be chatter */

/* While diodes may start or stop, a step is at most this turn: what begins and ends within it is missed, a
 * peak of EMF above the link of at most 5e-5. */
#define WATCHED_TURN_RAD 0.02

/* Which elements of the state there are: the step is compiled for each. */
typedef enum { KIND_PLAIN, KIND_SWING, KIND_GENERAL } kind_t;

static kind_t kind_of(const circuit_t *c)
{
    if (!circuit_plain(c)) {
        return KIND_GENERAL;
    }
    return c->bridge.swinging > 0 ? KIND_SWING : KIND_PLAIN;
}

INLINE int first_of(kind_t kind)
{
    return kind == KIND_PLAIN ? V_LEG(0) + 1 : (kind == KIND_SWING ? V_LEG(2) : 0);
}

INLINE int end_of(kind_t kind)
{
    return kind == KIND_GENERAL ? ELEMENTS : U_BETA + 1;
}

/* fmax() without its care for NaN, which costs a call */
INLINE double larger(double x, double y)
{
    return x > y ? x : y;
}

/* What follows from the states of p, which lies a small turn from another point, t_s after the present. */
INLINE void evaluate(const circuit_t *c, const point_t *from, double turn_rad, double t_s, kind_t kind,
                     point_t *p, double rate[])
{
    p->rotor = frame_turn(from->rotor, turn_rad);
    if (kind == KIND_GENERAL) {
        circuit_general(c, c->t_s + t_s, p, rate);
    } else {
        plain_currents(&c->machine, p);
        plain_rates(c, p, kind == KIND_SWING, rate);
    }
}

/* Local error in units of the tolerance, of a step whose embedded solution misses by miss[]. */
INLINE double error_norm(const circuit_t *c, const point_t *from, const double miss[], kind_t kind)
{
    double worst = miss[OMEGA_MECH] / (fabs(from->x[OMEGA_MECH]) + 1.0);
    worst = larger(worst, larger(miss[U_ALPHA], miss[U_BETA]) * c->inv_u_scale);
    worst = larger(worst, miss[V_DC] * c->inv_v_scale_1_V);
    if (kind != KIND_PLAIN) {
        int legs = kind == KIND_SWING ? 3 : PLANT_LEGS;
        for (int k = 0; k < legs; k++) {
            worst = larger(worst, miss[V_LEG(k)] * c->inv_v_scale_1_V);
        }
    }
    if (kind == KIND_GENERAL) {
        for (int a = 2; a < ACTIVE; a++) {
            bool core = a < 2 * c->machine.winding.sets;
            worst = larger(worst, miss[U + a] * (core ? c->inv_u_scale : c->inv_i_scale_1_A));
        }
        for (int n = 0; n < 2 * PLANT_SETS; n++) {
            worst = larger(worst, miss[EDDY + n] * c->inv_i_scale_1_A);
        }
        worst = larger(worst, miss[OMEGA_LOAD] / (fabs(from->x[OMEGA_LOAD]) + 1.0));
        worst = larger(worst, miss[TWIST]);
    }
    return worst * c->inv_tolerance;
}

/* One step of length h of the Bogacki-Shampine pair. k1 is the rate at the start; k4, of the end, is the k1
 * of a next step if nothing switches. Returns the local error in units of the tolerance. */
INLINE double bogacki_shampine(const circuit_t *c, const point_t *from, double h, const double k1[],
                               kind_t kind, point_t *to, double k4[])
{
    int first = first_of(kind);
    int end = end_of(kind);
    double k2[ELEMENTS], k3[ELEMENTS], move[ELEMENTS], miss[ELEMENTS];
    point_t p;
    for (int e = first; e < end; e++) {
        p.x[e] = from->x[e] + h * 0.5 * k1[e];
    }
    evaluate(c, from, h * 0.5 * k1[THETA_E], 0.5 * h, kind, &p, k2);
    for (int e = first; e < end; e++) {
        p.x[e] = from->x[e] + h * 0.75 * k2[e];
    }
    evaluate(c, from, h * 0.75 * k2[THETA_E], 0.75 * h, kind, &p, k3);
    for (int e = first; e < end; e++) {
        move[e] = h * (2.0 / 9.0 * k1[e] + 1.0 / 3.0 * k2[e] + 4.0 / 9.0 * k3[e]);
        to->x[e] = from->x[e] + move[e];
    }
    evaluate(c, from, move[THETA_E], h, kind, to, k4);
    for (int e = first; e < end; e++) {
        miss[e] = h * fabs(-5.0 / 72.0 * k1[e] + 1.0 / 12.0 * k2[e] + 1.0 / 9.0 * k3[e] - 0.125 * k4[e]);
    }
    return error_norm(c, from, miss, kind);
}

/* A swinging terminal that a step of length h with the rates k1 and k2 at its ends takes past its diode: the
 * length with which the parabola through them arrives there. */
static double landing(const circuit_t *c, const point_t *from, double h, const double k1[], const double k2[])
{
    double shortest = h;
    for (int k = 0; k < c->bridge.legs; k++) {
        double rate = k1[V_LEG(k)];
        if (c->bridge.leg[k] != LEG_SWINGING || rate == 0.0) {
            continue;
        }
        double end_V = rate > 0.0 ? from->x[V_DC] + c->bridge.v_diode_V : -c->bridge.v_diode_V;
        double bend = 0.5 * (k2[V_LEG(k)] - rate) / h;
        double away_V = end_V - from->x[V_LEG(k)];
        double arrival = h;
        for (int round = 0; round < 2; round++) {
            arrival -= (arrival * (rate + bend * arrival) - away_V) / (rate + 2.0 * bend * arrival);
        }
        shortest = arrival > 0.5 * h && arrival < shortest ? arrival : shortest;
    }
    return shortest;
}

/* last: nobody needs the rates of the end. land: the step may end earlier, where a swinging terminal lands.
 * Returns its length. */
INLINE double heun(const circuit_t *c, const point_t *from, double h, const double k1[], kind_t kind,
                   bool last, bool land, point_t *to, double k3[])
{
    int first = first_of(kind);
    int end = end_of(kind);
    double k2[ELEMENTS], move[ELEMENTS];
    point_t p;
    for (int e = first; e < end; e++) {
        p.x[e] = from->x[e] + h * k1[e];
    }
    evaluate(c, from, h * k1[THETA_E], h, kind, &p, k2);
    double taken = land && kind != KIND_PLAIN && c->bridge.swinging > 0 ? landing(c, from, h, k1, k2) : h;
    double half = 0.5 * taken * taken / h;
    for (int e = first; e < end; e++) {
        move[e] = taken * k1[e] + half * (k2[e] - k1[e]);
        to->x[e] = from->x[e] + move[e];
    }
    if (last) {
        to->rotor = frame_turn(from->rotor, move[THETA_E]);
        if (kind == KIND_GENERAL) {
            circuit_currents(c, to);
        } else {
            plain_currents(&c->machine, to);
        }
    } else {
        evaluate(c, from, move[THETA_E], taken, kind, to, k3);
    }
    return taken;
}

/* Short enough for Heun's method, which costs a third less and checks nothing. The windings of floating legs
 * follow the rotor, not the voltage: that wants the better method. */
INLINE bool brief(const circuit_t *c, double h)
{
    return h <= (c->bridge.swinging > 0 ? c->calm_swing_s : c->calm_s) && c->bridge.floating == 0;
}

/* Whether the drop of a closed switch turns over on the way, or the link runs empty: Heun's method would not
 * notice. */
INLINE bool turns_over(const circuit_t *c, const point_t *from, const point_t *to)
{
    const bridge_t *b = &c->bridge;
    for (int k = 0; k < b->legs && b->v_switch_V > 0.0; k++) {
        if (b->inv_zone_1_A[k] > 0.0) {
            double before = bridge_switch_share(circuit_leg_A(c, from, k) * b->inv_zone_1_A[k]);
            double after = bridge_switch_share(circuit_leg_A(c, to, k) * b->inv_zone_1_A[k]);
            if (before != after) {
                return true;
            }
        }
    }
    return to->x[V_DC] < 0.0;
}

/* A step of length *h, or less; returns its error, of Heun's method -1. */
INLINE double step_kind(const circuit_t *c, double *h, const double rate[], bool last, bool land, kind_t kind,
                        point_t *to, double rate_end[])
{
    if (brief(c, *h)) {
        double taken = heun(c, &c->now, *h, rate, kind, last, land, to, rate_end);
        if (!turns_over(c, &c->now, to)) {
            *h = taken;
            return -1.0;
        }
    }
    return bogacki_shampine(c, &c->now, *h, rate, kind, to, rate_end);
}

/* Takes over what a point of that kind has; the rest stays as it is. */
INLINE void take_point(const point_t *from, kind_t kind, point_t *to)
{
    for (int e = first_of(kind); e < end_of(kind); e++) {
        to->x[e] = from->x[e];
    }
    to->rotor = from->rotor;
    for (int a = 0; a < (kind == KIND_GENERAL ? ACTIVE : 2); a++) {
        to->i_A[a] = from->i_A[a];
    }
    to->psi_theta_Wb[0] = from->psi_theta_Wb[0];
    to->psi_theta_Wb[1] = from->psi_theta_Wb[1];
    to->torque_Nm = from->torque_Nm;
}

/* Any kind, where time is no matter. */
static void step_again(const circuit_t *c, double h, const double rate[], kind_t kind, point_t *to)
{
    double rate_end[ELEMENTS];
    *to = c->now;
    switch (kind) {
    case KIND_PLAIN:
        step_kind(c, &h, rate, true, false, KIND_PLAIN, to, rate_end);
        break;
    case KIND_SWING:
        step_kind(c, &h, rate, true, false, KIND_SWING, to, rate_end);
        break;
    case KIND_GENERAL:
        step_kind(c, &h, rate, true, false, KIND_GENERAL, to, rate_end);
        break;
    }
}

INLINE void rates_now(circuit_t *c, kind_t kind, double rate[])
{
    if (kind == KIND_GENERAL) {
        circuit_general(c, c->t_s, &c->now, rate);
    } else {
        plain_rates(c, &c->now, kind == KIND_SWING, rate);
    }
}

/* Arrival of swinging terminals at a diode; above zero: of one */
static double swing_excess(const circuit_t *c, const point_t *p)
{
    double excess = -1.0;
    for (int k = 0; k < c->bridge.legs && c->bridge.swinging > 0; k++) {
        if (c->bridge.leg[k] == LEG_SWINGING) {
            excess = larger(excess, circuit_swing_excess(c, p, k));
        }
    }
    return excess;
}

/* Everything else that ends the present kind of motion */
static double excess(const circuit_t *c, const point_t *p)
{
    const bridge_t *b = &c->bridge;
    double worst = -1.0;
    if (!dclink_plain(&c->link)) {
        worst = larger(worst, dclink_excess(&c->link, p->x[V_DC]));
    }
    if (c->mech.stuck || c->mech.slide != 0.0) {
        mechanics_motion_t motion = circuit_motion(c, p);
        worst = larger(worst, mechanics_excess(&c->mech, &motion, p->torque_Nm));
    }
    for (int k = 0; k < b->legs && b->diodes > 0; k++) {
        if (bridge_is_diode(b, k)) {
            worst = larger(worst, bridge_reverse(b, k, circuit_leg_A(c, p, k)));
        }
    }
    if (b->floating > 0) {
        circuit_nodes_t nodes;
        circuit_nodes(c, p, &nodes);
        for (int k = 0; k < b->legs; k++) {
            if (b->leg[k] == LEG_FLOATING && !b->off_wire[k]) {
                double beyond_V = bridge_beyond_V(b, p->x[V_DC], nodes.v_leg_V[k]);
                worst = larger(worst, beyond_V / (fabs(p->x[V_DC]) + 1.0));
            }
        }
    }
    return worst;
}

/* Close enough behind an event */
INLINE bool landed(double g, double swing)
{
    return g <= 1e-9 && swing <= 2.0 * SNAP;
}

/* Shortens a step, whose end is past an event, to just behind the first one: false position with bisection
 * whenever that does not halve the bracket. */
static double locate(const circuit_t *c, double h_late, const double rate_start[], kind_t kind, point_t *to)
{
    double h_early = 0.0;
    double g_early = larger(excess(c, &c->now), swing_excess(c, &c->now));
    double g_late = excess(c, to);
    double swing_late = swing_excess(c, to);
    double finest_s = 1e-9 * h_late;
    bool bisect = false;
    while (h_late - h_early > finest_s && !landed(g_late, swing_late)) {
        double width = h_late - h_early;
        double late = larger(g_late, swing_late);
        double h = h_early + width * (bisect || g_early >= 0.0 ? 0.5 : g_early / (g_early - late));
        h = fmin(fmax(h, h_early + 0.1 * finest_s), h_late - 0.1 * finest_s);
        point_t probe;
        step_again(c, h, rate_start, kind, &probe);
        double g = excess(c, &probe);
        double swing = swing_excess(c, &probe);
        if (g > 0.0 || swing > 0.0) {
            h_late = h;
            g_late = g;
            swing_late = swing;
            *to = probe;
        } else {
            h_early = h;
            g_early = larger(g, swing);
        }
        bisect = h_late - h_early > 0.5 * width;
    }
    return h_late;
}

static bool watching(const circuit_t *c)
{
    return c->bridge.floating > 0 || c->bridge.diodes > 0 || c->bridge.swinging > 0 ||
           c->mech.parameters.T_coulomb_Nm > 0.0 || !dclink_plain(&c->link);
}

/* A swinging terminal moves nearly straight towards its diode: the step ends there. */
static double arrival_s(const circuit_t *c, const double rate[], double h)
{
    for (int k = 0; k < c->bridge.legs && c->bridge.swinging > 0; k++) {
        if (c->bridge.leg[k] == LEG_SWINGING && rate[V_LEG(k)] != 0.0) {
            double end_V = rate[V_LEG(k)] > 0.0 ? c->now.x[V_DC] + c->bridge.v_diode_V : -c->bridge.v_diode_V;
            double arrival = (end_V - c->now.x[V_LEG(k)]) / rate[V_LEG(k)];
            h = arrival > 0.0 && arrival < h ? arrival : h;
        }
    }
    return h;
}

/* last: its end is that of the segment, or an event, and nobody needs the rates there. */
static double next_step_s(const circuit_t *c, const double rate[], double left_s, bool *last)
{
    double calm_s = c->bridge.swinging > 0 ? c->calm_swing_s : c->calm_s;
    double h = fmin(larger(c->step_s, calm_s), left_s);
    double limit_rad =
        c->bridge.floating > 0 || c->bridge.diodes > 0 ? WATCHED_TURN_RAD : 0.9 * FRAME_TURN_MAX_RAD;
    double turn_rad = fabs(rate[THETA_E]) * h;
    if (turn_rad > limit_rad) {
        h *= limit_rad / turn_rad;
    }
    double arrival = arrival_s(c, rate, h);
    *last = arrival < h || h > 0.999 * left_s;
    h = arrival < h ? arrival : h;
    return h > 0.999 * left_s ? left_s : h; /* no sliver at the end */
}

/* What the error of a step says about the next; Heun steps say only that they were short. */
INLINE void control_step(circuit_t *c, double h, double error)
{
    if (error < 0.0) {
        c->step_s = larger(c->step_s, 2.0 * h);
    } else if (error < 0.2 && h > 0.5 * c->step_s) {
        c->step_s = error < 0.02 ? 3.0 * h : 1.5 * h;
    }
}

static void advance_probe(circuit_t *c, const point_t *to, double h)
{
    circuit_nodes_t before, after;
    double v_before_V[PLANT_LEGS + PLANT_SETS], v_after_V[PLANT_LEGS + PLANT_SETS];
    circuit_nodes(c, &c->now, &before);
    circuit_nodes(c, to, &after);
    memcpy(v_before_V, before.v_leg_V, sizeof before.v_leg_V);
    memcpy(v_after_V, after.v_leg_V, sizeof after.v_leg_V);
    memcpy(&v_before_V[PLANT_LEGS], before.v_neutral_V, sizeof before.v_neutral_V);
    memcpy(&v_after_V[PLANT_LEGS], after.v_neutral_V, sizeof after.v_neutral_V);
    probe_advance(&c->probe, c->t_s - c->period_start_s, h, v_before_V, v_after_V);
}

/* Takes the step that the error control allows, at most left_s; *rate is that of the start, and on return
 * of the end if nothing happened there. Returns the time advanced; *event when the kind of motion may have
 * changed at its end. */
INLINE double advance_once(circuit_t *c, double left_s, kind_t kind, double rate[], bool *event)
{
    point_t next;
    double rate_end[ELEMENTS];
    bool last;
    double h = next_step_s(c, rate, left_s, &last);
    double error = step_kind(c, &h, rate, last, true, kind, &next, rate_end);
    while (!(error <= 1.0) && h > 1e-9 * left_s) { /* NaN too */
        h *= error > 1.0 ? fmax(0.2, 0.9 / cbrt(error)) : 0.2;
        c->step_s = h;
        error = step_kind(c, &h, rate, false, true, kind, &next, rate_end);
    }
    control_step(c, h, error);
    *event = false;
    if (watching(c)) {
        double g = excess(c, &next);
        double swing = swing_excess(c, &next);
        *event = g > 0.0 || swing > 0.0;
        if (*event && !landed(g, swing)) {
            h = locate(c, h, rate, kind, &next);
        }
    }
    if (probe_active(&c->probe)) {
        advance_probe(c, &next, h);
    }
    take_point(&next, kind, &c->now);
    c->t_s += h;
    if (*event) {
        return h; /* the rates will be those of another circuit */
    }
    if (last && h < left_s) {
        rates_now(c, kind, rate);
    } else {
        memcpy(rate, rate_end, sizeof rate_end);
    }
    return h;
}

/* Advances while the kind stays what it is. Returns the time left. */
INLINE double advance_kind(circuit_t *c, double left_s, kind_t kind, int *events)
{
    double rate[ELEMENTS];
    bool event = false;
    rates_now(c, kind, rate);
    while (left_s > 0.0 && !event) {
        left_s -= advance_once(c, left_s, kind, rate, &event);
        if (event) {
            ++*events;
            assert(*events < MAX_EVENTS);
            circuit_settle(c);
        } else if (c->bridge.floating > 0) {
            circuit_settle_legs(c);
            rates_now(c, kind, rate);
        }
    }
    return left_s;
}

void circuit_advance(circuit_t *c, double duration_s)
{
    int events = 0;
    circuit_settle_legs(c);
    for (double left_s = duration_s; left_s > 0.0;) {
        switch (kind_of(c)) {
        case KIND_PLAIN:
            left_s = advance_kind(c, left_s, KIND_PLAIN, &events);
            break;
        case KIND_SWING:
            left_s = advance_kind(c, left_s, KIND_SWING, &events);
            break;
        case KIND_GENERAL:
            left_s = advance_kind(c, left_s, KIND_GENERAL, &events);
            break;
        }
    }
}
