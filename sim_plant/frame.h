/* Reference frames of the plant: stationary alpha-beta and rotor dq, amplitude invariant.
 *
 * METHODS.md 0.1. Own types and transforms, nothing shared with the firmware, so that an error there
 * cannot cancel itself here. Inline because the derivative of the circuit is made of them. */
#ifndef PLANT_FRAME_H
#define PLANT_FRAME_H

typedef struct {
    double alpha, beta;
} ab_t;

typedef struct {
    double d, q;
} dq_t;

/* cos and sin of the electrical rotor angle */
typedef struct {
    double c, s;
} rotor_t;

static inline dq_t frame_to_dq(ab_t x, rotor_t r)
{
    dq_t to = {r.c * x.alpha + r.s * x.beta, r.c * x.beta - r.s * x.alpha};
    return to;
}

static inline ab_t frame_to_ab(dq_t x, rotor_t r)
{
    ab_t to = {r.c * x.d - r.s * x.q, r.s * x.d + r.c * x.q};
    return to;
}

/* Largest angle that frame_turn() takes: its series is then exact to 3e-13. */
#define FRAME_TURN_MAX_RAD 0.1

/* The rotor further on by a small angle. A series, because sin() and cos() in every stage of every step
 * would cost more than all the rest of the circuit. */
static inline rotor_t frame_turn(rotor_t r, double rad)
{
    double x2 = rad * rad;
    double c = 1.0 - x2 * (0.5 - x2 * (1.0 / 24.0 - x2 * (1.0 / 720.0)));
    double s = rad * (1.0 - x2 * (1.0 / 6.0 - x2 * (1.0 / 120.0 - x2 * (1.0 / 5040.0))));
    rotor_t to = {r.c * c - r.s * s, r.s * c + r.c * s};
    return to;
}

#endif
