/* Steps of the integrator and the events that end them; for advance.c. */
#ifndef PLANT_STEPS_H
#define PLANT_STEPS_H

#include "sim_plant/circuit_rates.h"
#include "sim_plant/machine_rates.h"

/* While diodes may start or stop, a step is at most this turn: what begins and ends within it is missed, a
 * peak of EMF above the link of at most 5e-5. */
#define WATCHED_TURN_RAD 0.02

/* Take steps until left_s has passed or the kind of motion may have changed; the time left. *event: the
 * latter. steps_symmetrical() is for circuit_symmetrical(), steps_general() for any circuit. */
double steps_symmetrical(circuit_t *circuit, double left_s, bool *event);
double steps_general(circuit_t *circuit, double left_s, bool *event);

/* fmax() without its care for NaN, which costs a call */
INLINE double larger(double x, double y)
{
    return x > y ? x : y;
}

INLINE double smaller(double x, double y)
{
    return x < y ? x : y;
}

/* What a step shows: above zero where an event lies in it, of swinging terminals and of all else. */
typedef struct {
    double swing, rest;
} excess_t;

excess_t steps_excess(const circuit_t *circuit, const point_t *point);

/* Whether there is anything that could in a step to that point. */
static inline bool steps_watching(const circuit_t *c, const point_t *to)
{
    return (c->bridge.floating | c->bridge.diodes | c->bridge.swinging) != 0u || !dclink_plain(&c->link) ||
           c->mech.stuck || mechanics_sliding_excess(&c->mech, to->x[OMEGA_MECH]) > 0.0;
}

static inline bool steps_event(excess_t excess)
{
    return excess.rest > 0.0 || excess.swing > 0.0;
}

/* Close enough behind an event */
static inline bool steps_landed(excess_t excess)
{
    return excess.rest <= 1e-9 && excess.swing <= 2.0 * SNAP;
}

/* Takes the step anew with another length. */
typedef void steps_retake_t(const circuit_t *circuit, const void *start, double h, point_t *to);

/* Shortens a step, whose end is past an event, to just behind the first one: false position with bisection
 * whenever that does not halve the bracket. Its length. */
double steps_locate(const circuit_t *circuit, double h_late, steps_retake_t *retake, const void *start,
                    point_t *to);

/* Whether a board measures what has a memory. */
static inline bool steps_probing(const circuit_t *c)
{
    return c->probing;
}

/* Its channels, comparators and amplifiers over a step to that point. */
void steps_probe(circuit_t *circuit, const point_t *to, double h);

/* Longest step so that the rotor turns less than its series allows. */
static inline double steps_turn_s(const circuit_t *c, double omega_e, double h)
{
    double limit_rad =
        c->bridge.floating != 0u || c->bridge.diodes != 0u ? WATCHED_TURN_RAD : 0.9 * FRAME_TURN_MAX_RAD;
    double turn_rad = fabs(omega_e) * h;
    return turn_rad > limit_rad ? h * (limit_rad / turn_rad) : h;
}

/* After a step whose error was beyond one tolerance: its next length. */
static inline double steps_shorter_s(double h, double error)
{
    return h * (error > 1.0 ? larger(0.2, 0.9 / cbrt(error)) : 0.2); /* NaN too */
}

#endif
