/* Steps of any circuit: the Bogacki-Shampine 3(2) pair with error control, or Heun's method where that is
 * exact enough. */
#include "sim_plant/steps.h"

#include <math.h>
#include <string.h>

#define KINK 8.0 /* what the embedded solution sees too little of a drop that turns over within the step */

/* What follows from the states of p, which lies a small turn from another point, t_s after the present. */
static void evaluate(const circuit_t *c, const point_t *from, double turn_rad, double t_s, point_t *p,
                     double rate[])
{
    p->rotor = frame_turn(from->rotor, turn_rad);
    circuit_general(c, c->t_s + t_s, p, rate);
}

/* Local error in units of the tolerance, of a step whose embedded solution misses by miss[]. */
static double error_norm(const circuit_t *c, const point_t *from, const double miss[])
{
    double worst = miss[OMEGA_MECH] / (fabs(from->x[OMEGA_MECH]) + 1.0);
    worst = larger(worst, miss[V_DC] * c->inv_v_scale_1_V);
    for (int k = 0; k < PLANT_LEGS; k++) {
        worst = larger(worst, miss[V_LEG(k)] * c->inv_v_scale_1_V);
    }
    for (int a = 0; a < ACTIVE; a++) {
        bool core = a < 2 * c->machine.winding.sets;
        worst = larger(worst, miss[U + a] * (core ? c->inv_u_scale : c->inv_i_scale_1_A));
    }
    for (int n = 0; n < 2 * PLANT_SETS; n++) {
        worst = larger(worst, miss[EDDY + n] * c->inv_i_scale_1_A);
    }
    worst = larger(worst, miss[OMEGA_LOAD] / (fabs(from->x[OMEGA_LOAD]) + 1.0));
    worst = larger(worst, miss[TWIST]);
    return worst * c->inv_tolerance;
}

/* One step of length h of the Bogacki-Shampine pair. k1 is the rate at the start; k4, of the end, is the k1
 * of a next step if nothing switches. Returns the local error in units of the tolerance. */
WIDER static double bogacki_shampine(const circuit_t *c, const point_t *from, double h, const double k1[],
                                     point_t *to, double k4[])
{
    double k2[ELEMENTS], k3[ELEMENTS], move[ELEMENTS], miss[ELEMENTS];
    point_t p;
    for (int e = 0; e < ELEMENTS; e++) {
        p.x[e] = from->x[e] + h * 0.5 * k1[e];
    }
    evaluate(c, from, h * 0.5 * k1[THETA_E], 0.5 * h, &p, k2);
    for (int e = 0; e < ELEMENTS; e++) {
        p.x[e] = from->x[e] + h * 0.75 * k2[e];
    }
    evaluate(c, from, h * 0.75 * k2[THETA_E], 0.75 * h, &p, k3);
    for (int e = 0; e < ELEMENTS; e++) {
        move[e] = h * (2.0 / 9.0 * k1[e] + 1.0 / 3.0 * k2[e] + 4.0 / 9.0 * k3[e]);
        to->x[e] = from->x[e] + move[e];
    }
    evaluate(c, from, move[THETA_E], h, to, k4);
    for (int e = 0; e < ELEMENTS; e++) {
        miss[e] = h * fabs(-5.0 / 72.0 * k1[e] + 1.0 / 12.0 * k2[e] + 1.0 / 9.0 * k3[e] - 0.125 * k4[e]);
    }
    return error_norm(c, from, miss);
}

/* A swinging terminal that a step of length h with the rates k1 and k2 at its ends takes past its diode: the
 * length with which the parabola through them arrives there. */
static double landing(const circuit_t *c, const point_t *from, double h, const double k1[], const double k2[])
{
    double shortest = h;
    for (unsigned legs = c->bridge.swinging; legs != 0u; legs &= legs - 1u) {
        int k = bridge_first(legs);
        double rate = k1[V_LEG(k)];
        if (rate == 0.0) {
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
WIDER static double heun(const circuit_t *c, const point_t *from, double h, const double k1[], bool last,
                         bool land, point_t *to, double k3[])
{
    double k2[ELEMENTS], move[ELEMENTS];
    point_t p;
    for (int e = 0; e < ELEMENTS; e++) {
        p.x[e] = from->x[e] + h * k1[e];
    }
    evaluate(c, from, h * k1[THETA_E], h, &p, k2);
    double taken = land ? landing(c, from, h, k1, k2) : h;
    double half = 0.5 * taken * taken / h;
    for (int e = 0; e < ELEMENTS; e++) {
        move[e] = taken * k1[e] + half * (k2[e] - k1[e]);
        to->x[e] = from->x[e] + move[e];
    }
    if (last) {
        to->rotor = frame_turn(from->rotor, move[THETA_E]);
        circuit_currents(c, to);
    } else {
        evaluate(c, from, move[THETA_E], taken, to, k3);
    }
    return taken;
}

/* Longest step of Heun's method, which costs a third less and checks nothing. A leg that shorts the link
 * discharges it within 0.1 us, or less: only a method that checks its error follows that. */
static double calm_s(const circuit_t *c)
{
    if (c->bridge.both != 0u) {
        return 0.0;
    }
    return c->bridge.swinging != 0u ? c->calm_swing_s : c->calm_s;
}

/* Short enough for it. The windings of floating legs follow the rotor, not the voltage: that wants the better
 * method. */
static bool brief(const circuit_t *c, double h)
{
    return h <= calm_s(c) && c->bridge.floating == 0u;
}

/* Whether the drop of a closed switch turns over on the way, or the link runs empty: Heun's method would not
 * notice. */
static bool turns_over(const circuit_t *c, const point_t *from, const point_t *to)
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
WIDER static double step(const circuit_t *c, double *h, const double rate[], bool last, bool land,
                         point_t *to, double rate_end[])
{
    if (brief(c, *h)) {
        double taken = heun(c, &c->now, *h, rate, last, land, to, rate_end);
        if (!turns_over(c, &c->now, to)) {
            *h = taken;
            return -1.0;
        }
    }
    double error = bogacki_shampine(c, &c->now, *h, rate, to, rate_end);
    return turns_over(c, &c->now, to) ? KINK * error : error;
}

WIDER static void retake(const circuit_t *c, const void *rate, double h, point_t *to)
{
    double rate_end[ELEMENTS];
    step(c, &h, rate, true, false, to, rate_end);
}

/* A swinging terminal moves nearly straight towards its diode: the step ends there. */
static double arrival_s(const circuit_t *c, const double rate[], double h)
{
    for (unsigned legs = c->bridge.swinging; legs != 0u; legs &= legs - 1u) {
        int k = bridge_first(legs);
        if (rate[V_LEG(k)] != 0.0) {
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
    double h = steps_turn_s(c, rate[THETA_E], smaller(larger(c->step_s, calm_s(c)), left_s));
    double arrival = arrival_s(c, rate, h);
    *last = arrival < h || h > 0.999 * left_s;
    h = arrival < h ? arrival : h;
    return h > 0.999 * left_s ? left_s : h; /* no sliver at the end */
}

/* What the error of a step says about the next; Heun steps say only that they were short. */
static void control_step(circuit_t *c, double h, double error)
{
    if (error < 0.0) {
        c->step_s = larger(c->step_s, 2.0 * h);
    } else if (error < 0.2 && h > 0.5 * c->step_s) {
        c->step_s = error < 0.02 ? 3.0 * h : 1.5 * h;
    }
}

/* Takes the step that the error control allows, at most left_s; *rate is that of the start, and on return
 * of the end if nothing happened there. Returns the time advanced; *event when the kind of motion may have
 * changed at its end. */
WIDER static double take_step(circuit_t *c, double left_s, double rate[], bool *event)
{
    point_t next;
    double rate_end[ELEMENTS];
    bool last;
    double h = next_step_s(c, rate, left_s, &last);
    double error = step(c, &h, rate, last, true, &next, rate_end);
    while (!(error <= 1.0) && h > 1e-9 * left_s) { /* NaN too */
        h = steps_shorter_s(h, error);
        c->step_s = h;
        error = step(c, &h, rate, false, true, &next, rate_end);
    }
    control_step(c, h, error);
    if (steps_watching(c, &next)) {
        excess_t excess = steps_excess(c, &next);
        *event = steps_event(excess);
        if (*event && !steps_landed(excess)) {
            h = steps_locate(c, h, retake, rate, &next);
        }
    }
    if (steps_probing(c)) {
        steps_probe(c, &next, h);
    }
    c->now = next;
    c->t_s += h;
    if (*event) {
        return h; /* the rates will be those of another circuit */
    }
    if (last && h < left_s) {
        circuit_general(c, c->t_s, &c->now, rate);
    } else {
        memcpy(rate, rate_end, sizeof rate_end);
    }
    return h;
}

WIDER double steps_general(circuit_t *c, double left_s, bool *event)
{
    double rate[ELEMENTS];
    c->field_known = false;
    circuit_general(c, c->t_s, &c->now, rate);
    while (left_s > 0.0 && !*event) {
        left_s -= take_step(c, left_s, rate, event);
        if (c->bridge.floating != 0u && !*event) {
            circuit_settle_legs(c);
            circuit_general(c, c->t_s, &c->now, rate);
        }
    }
    return left_s;
}
