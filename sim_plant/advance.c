#include "sim_plant/circuit_rates.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#define MAX_EVENTS 200 /* of a segment; more would be chatter */

/* While diodes may start or stop, a step is at most this turn: what begins and ends within it is missed, a
 * peak of EMF above the link of at most 5e-5. */
#define WATCHED_TURN_RAD 0.02

/* fmax() without its care for NaN, which costs a call */
static inline double larger(double x, double y)
{
    return x > y ? x : y;
}

/* What follows from the states of p, which lies a small turn from another point. */
static inline void evaluate(const circuit_t *c, const point_t *from, double turn_rad, point_t *p,
                            double rate[])
{
    p->rotor = frame_turn(from->rotor, turn_rad);
    circuit_currents(&c->machine, p);
    circuit_rates(c, p, rate);
}

/* One step of length h. k1 is the rate at the start; k4, of the end, is the k1 of a next step if nothing
 * switches. Returns the local error in units of the tolerance. */
static double step(const circuit_t *c, const point_t *from, double h, const double k1[], point_t *to,
                   double k4[])
{
    double k2[ELEMENTS], k3[ELEMENTS];
    point_t p;
    for (int e = 0; e < STATES; e++) {
        p.x[e] = from->x[e] + h * 0.5 * k1[e];
    }
    evaluate(c, from, h * 0.5 * k1[THETA_E], &p, k2);
    for (int e = 0; e < STATES; e++) {
        p.x[e] = from->x[e] + h * 0.75 * k2[e];
    }
    evaluate(c, from, h * 0.75 * k2[THETA_E], &p, k3);
    double move[ELEMENTS];
    for (int e = 0; e < ELEMENTS; e++) {
        move[e] = h * (2.0 / 9.0 * k1[e] + 1.0 / 3.0 * k2[e] + 4.0 / 9.0 * k3[e]);
        to->x[e] = from->x[e] + move[e];
    }
    evaluate(c, from, move[THETA_E], to, k4);

    double miss[STATES];
    for (int e = 0; e < STATES; e++) {
        miss[e] = fabs(-5.0 / 72.0 * k1[e] + 1.0 / 12.0 * k2[e] + 1.0 / 9.0 * k3[e] - 0.125 * k4[e]);
    }
    double worst = miss[OMEGA_MECH] / (fabs(from->x[OMEGA_MECH]) + 1.0);
    worst = larger(worst, larger(miss[PSI_ALPHA], miss[PSI_BETA]) * c->inv_psi_scale_1_Wb);
    worst = larger(worst, miss[V_DC] * c->inv_v_scale_1_V);
    return h * worst * c->inv_tolerance;
}

static double excess(const circuit_t *c, const point_t *p)
{
    motor_port_t port = circuit_port(c, p);
    return fmax(bridge_excess(&c->bridge, &c->machine, &port),
                mechanics_excess(&c->mech, p->x[OMEGA_MECH], p->torque_Nm));
}

/* Shortens a step, whose end is past an event, to just behind the first one: false position with bisection
 * whenever that does not halve the bracket. */
static double locate(const circuit_t *c, double h_late, const double rate_start[], point_t *to, double g_late)
{
    double h_early = 0.0;
    double g_early = excess(c, &c->now);
    double finest_s = 1e-9 * h_late;
    bool bisect = false;
    while (h_late - h_early > finest_s && g_late > 1e-9) {
        double width = h_late - h_early;
        double h = h_early + width * (bisect || g_early >= 0.0 ? 0.5 : g_early / (g_early - g_late));
        h = fmin(fmax(h, h_early + 0.1 * finest_s), h_late - 0.1 * finest_s);
        point_t probe;
        double rate_end[ELEMENTS];
        step(c, &c->now, h, rate_start, &probe, rate_end);
        double g = excess(c, &probe);
        if (g > 0.0) {
            h_late = h;
            g_late = g;
            *to = probe;
        } else {
            h_early = h;
            g_early = g;
        }
        bisect = h_late - h_early > 0.5 * width;
    }
    return h_late;
}

static bool watching(const circuit_t *c)
{
    return c->bridge.floating > 0 || c->bridge.diodes > 0 || c->mech.parameters.T_coulomb_Nm > 0.0;
}

static double next_step_s(const circuit_t *c, double left_s)
{
    double h = c->step_s < left_s ? c->step_s : left_s;
    double limit_rad =
        c->bridge.floating > 0 || c->bridge.diodes > 0 ? WATCHED_TURN_RAD : 0.9 * FRAME_TURN_MAX_RAD;
    double turn_rad = fabs(c->machine.pole_pairs * c->now.x[OMEGA_MECH]) * h;
    if (turn_rad > limit_rad) {
        h *= limit_rad / turn_rad;
    }
    return h > 0.999 * left_s ? left_s : h; /* no sliver at the end */
}

/* Takes the step that the error control allows, at most left_s; *rate is that of the start, and on return
 * of the end. Returns the time advanced. */
static double advance_once(circuit_t *c, double left_s, double rate[], int *events)
{
    point_t next;
    double rate_end[ELEMENTS];
    double h = next_step_s(c, left_s);
    double error = step(c, &c->now, h, rate, &next, rate_end);
    while (error > 1.0 && h > 1e-9 * left_s) {
        h *= fmax(0.2, 0.9 / cbrt(error));
        c->step_s = h;
        error = step(c, &c->now, h, rate, &next, rate_end);
    }
    if (error < 0.2 && h > 0.5 * c->step_s) {
        c->step_s = error < 0.02 ? 3.0 * h : 1.5 * h;
    }
    bool changed = c->bridge.floating > 0;
    if (watching(c)) {
        double g = excess(c, &next);
        if (g > 0.0 && *events < MAX_EVENTS) {
            h = locate(c, h, rate, &next, g);
            ++*events;
            assert(*events < MAX_EVENTS);
            changed = true;
        }
    }
    c->now = next;
    if (changed) {
        circuit_settle(c);
        circuit_rates(c, &c->now, rate);
    } else {
        memcpy(rate, rate_end, sizeof rate_end);
    }
    return h;
}

void circuit_advance(circuit_t *c, double duration_s)
{
    double rate[ELEMENTS];
    int events = 0;
    circuit_settle(c);
    circuit_rates(c, &c->now, rate);
    for (double left_s = duration_s; left_s > 0.0;) {
        left_s -= advance_once(c, left_s, rate, &events);
    }
}
