/* Steps of a symmetrical machine on legs that are tied or swing.
 *
 * The first and second derivative of the state are known in closed form at every point, as all follows from
 * the currents and these move by the tangent of the field. A step is the Taylor series of second order, and
 * the rates at its end add the third:
 *
 *   y' = y + h f + h^2/2 f',   d = h/3 (f(y') - f - h f'),   y(h) = y' + d
 *
 * d is also what the second order misses, which is the error that is controlled. So a step takes one
 * evaluation of the field, and a change of the legs none. Of the voltages of swinging terminals the third
 * derivative is known at the start as well, so that they gain an order. */
#include "sim_plant/steps.h"
#include "sim_plant/symmetrical_drops.h"
#include "sim_plant/symmetrical_rates.h"

#include <math.h>

/* Of d, where all is smooth: about what the embedded solution of a Runge-Kutta pair of this order misses. */
#define PART 0.125

INLINE double error_norm(const circuit_t *c, const double miss[], const pair_t by[], shape_t shape,
                         bool swings)
{
    double worst = fabs(miss[OMEGA_MECH]) / (fabs(c->now.x[OMEGA_MECH]) + 1.0);
    double u = 0.0, v = fabs(miss[V_DC]);
    for (int set = 0; set < shape.sets; set++) {
        u = larger(u, larger(fabs(by[set][0]), fabs(by[set][1])));
    }
    for (int k = 0; k < shape.legs && swings; k++) {
        v = larger(v, fabs(miss[V_LEG(k)]));
    }
    if (pairs(shape) > shape.sets) {
        worst = larger(worst, fabs(by[shape.sets][0]) * c->inv_i_scale_1_A);
    }
    worst = larger(worst, larger(u * c->inv_u_scale, v * c->inv_v_scale_1_V));
    return worst * c->inv_tolerance;
}

INLINE int first_of(shape_t shape, bool swings)
{
    return swings ? V_LEG(shape.legs - 1) : THETA_E;
}

/* The Taylor series, without the angle. */
INLINE void predict(const circuit_t *c, const start_t *s, double h, shape_t shape, bool swings, double x[],
                    field_t *f)
{
    const double half = 0.5 * h, third = h / 3.0;
    for (int e = first_of(shape, swings); e < U; e++) {
        x[e] = c->now.x[e] + h * (s->rate[e] + half * s->bend[e]);
    }
    for (int k = 0; k < shape.legs && swings; k++) {
        x[V_LEG(k)] += third * half * h * s->v_leg_V_s3[k];
    }
    for (int p = 0; p < pairs(shape); p++) {
        pair_t bend = swings ? s->flux_V_s[p] + both(third) * s->flux_V_s2[p] : s->flux_V_s[p];
        f->flux[p] = c->field.flux[p] + both(h) * (s->flux_V[p] + both(half) * bend);
    }
    for (int set = 0; set < shape.sets && shape.sets > 1; set++) {
        f->core_Wb[set] = c->field.core_Wb[set] + both(h) * s->core_V[set];
    }
}

/* d from the rates at the end; where third derivatives are in the series already, what is missing of it. */
INLINE void find_miss(const start_t *s, double h, const double end[], const pair_t end_V[], shape_t shape,
                      bool swings, double miss[], pair_t by[])
{
    const double third = h / 3.0, cube = third * 0.5 * h * h;
    for (int e = first_of(shape, swings); e < U; e++) {
        miss[e] = third * (end[e] - s->rate[e] - h * s->bend[e]);
    }
    for (int p = 0; p < pairs(shape); p++) {
        by[p] = both(third) * (end_V[p] - s->flux_V[p] - both(h) * s->flux_V_s[p]);
        by[p] = swings ? both(0.75) * (by[p] - both(cube) * s->flux_V_s2[p]) : by[p];
    }
    for (int k = 0; k < shape.legs && swings; k++) {
        miss[V_LEG(k)] = 0.75 * (miss[V_LEG(k)] - cube * s->v_leg_V_s3[k]);
    }
    for (int a = 0; a < 2 && swings; a++) {
        miss[INT_V_ALPHA + a] -= 0.25 * (miss[INT_V_ALPHA + a] - cube * s->v_V_s2[0][a]);
    }
}

/* One step of length h; its error in units of the tolerance. */
INLINE double step(const circuit_t *c, const start_t *s, double h, shape_t shape, bool swings, point_t *to,
                   field_t *f)
{
    double end[ELEMENTS], miss[ELEMENTS];
    pair_t end_V[PAIRS], by[PAIRS];
    tied_t tied;
    double turn = h * (s->rate[THETA_E] + 0.5 * h * (s->bend[THETA_E] + h / 3.0 * s->omega_jerk));
    to->rotor = frame_turn(c->now.rotor, turn);
    predict(c, s, h, shape, swings, to->x, f);
    field_at(&c->machine, to->rotor, shape, f);
    rates_at(c, f, to->x, shape, swings, &tied, end, end_V);
    find_miss(s, h, end, end_V, shape, swings, miss, by);
    for (int e = first_of(shape, swings); e < U; e++) {
        to->x[e] += miss[e];
    }
    to->x[THETA_E] = c->now.x[THETA_E] + turn;
    field_shift(&c->machine, to->rotor, shape, by, f);
    for (int p = 0; p < pairs(shape); p++) {
        bool linked = shape.sets > 1;
        pair_put(&to->x[U + 2 * p], linked ? from_rotor(f->core_Wb[p], to->rotor) : f->flux[p]);
        pair_put(&to->i_A[2 * p], f->i_A[p]);
    }
    to->torque_Nm = f->torque_Nm;
    double part = drop_part(&c->bridge, &s->tied, &tied, shape, swings ? 1.0 : PART);
    return part * error_norm(c, miss, by, shape, swings);
}

static void retake(const circuit_t *c, const void *start, double h, point_t *to)
{
    field_t f;
    bool swings = c->bridge.swinging != 0u;
    *to = c->now;
    switch (c->machine.winding.active) {
    case 2:
        step(c, start, h, STAR, swings, to, &f);
        break;
    case 3:
        step(c, start, h, OPEN, swings, to, &f);
        break;
    default:
        step(c, start, h, DOUBLE, swings, to, &f);
        break;
    }
}

/* Until a swinging terminal arrives at its diode, by the first three derivatives; h if not before. */
INLINE double arrival_s(const circuit_t *c, const start_t *s, int k, double h)
{
    double rate = s->rate[V_LEG(k)], bend = 0.5 * s->bend[V_LEG(k)], jerk = s->v_leg_V_s3[k] / 6.0;
    double end_V = rate > 0.0 ? c->now.x[V_DC] + c->bridge.v_diode_V : -c->bridge.v_diode_V;
    double away_V = end_V - c->now.x[V_LEG(k)];
    double t = 0.0;
    if (rate == 0.0 || away_V * rate <= 0.0) {
        return h;
    }
    for (int round = 0; round < 4; round++) {
        double speed = rate + t * (2.0 * bend + t * 3.0 * jerk);
        if (speed * rate <= 0.0) {
            return h;
        }
        t += (away_V - t * (rate + t * (bend + t * jerk))) / speed;
        if (round == 0 && t > 4.0 * h) {
            return h;
        }
    }
    return t > 0.0 && t < h ? t : h;
}

/* What swinging terminals allow. */
INLINE double swing_s(const circuit_t *c, const start_t *s, shape_t shape, double h)
{
    double bend = 0.0;
    for (int k = 0; k < shape.legs; k++) {
        if (c->bridge.leg[k] == LEG_SWINGING) {
            h = arrival_s(c, s, k, h);
            bend = larger(bend, fabs(s->bend[V_LEG(k)]));
        }
    }
    double square = c->machine.gamma_leg_1_H * c->bridge.inv_c_leg_1_F; /* of the angular frequency */
    double error = bend * square * h * h * h * h * (c->inv_v_scale_1_V * c->inv_tolerance / 24.0);
    return error > 0.5 ? h * sqrt(sqrt(0.5 / error)) : h;
}

/* What the error of a step says about the next. */
INLINE void control(circuit_t *c, double h, double error)
{
    if (error < 0.2 && h > 0.5 * c->step_s) {
        c->step_s = error < 0.02 ? 3.0 * h : 1.5 * h;
    }
}

INLINE void know_field(circuit_t *c, shape_t shape)
{
    if (!c->field_known) {
        field_from_cores(&c->machine, c->now.rotor, shape, &c->now.x[U], c->now.x[U + 2 * shape.sets],
                         &c->field);
        c->field_known = true;
        c->next = c->now; /* what does not move in these steps */
    }
}

INLINE double take_steps(circuit_t *c, double left_s, shape_t shape, bool swings, bool *event)
{
    point_t *to = &c->next;
    field_t field;
    start_t start;
    know_field(c, shape);
    while (left_s > 0.0 && !*event) {
        begin(c, shape, swings, &start);
        double h = swings || c->step_s > left_s ? left_s : c->step_s;
        h = steps_turn_s(c, start.rate[THETA_E], h);
        h = swings ? swing_s(c, &start, shape, h) : h;
        double zone = zone_s(c, &start, shape, h);
        bool smooth = zone == h;
        h = zone;
        h = h > 0.999 * left_s ? left_s : h; /* no sliver at the end */
        double error = step(c, &start, h, shape, swings, to, &field);
        while (!(error <= 1.0) && h > 1e-9 * left_s) {
            h = steps_shorter_s(h, error);
            c->step_s = swings || !smooth ? c->step_s : h;
            error = step(c, &start, h, shape, swings, to, &field);
        }
        if (!swings) {
            control(c, h, error);
        }
        if (steps_watching(c, to)) {
            excess_t excess = steps_excess(c, to);
            *event = steps_event(excess);
            if (*event && !steps_landed(excess)) {
                h = steps_locate(c, h, retake, &start, to);
                step(c, &start, h, shape, swings, to, &field);
            }
        }
        if (probe_active(&c->probe)) {
            steps_probe(c, to, h);
        }
        for (int e = first_of(shape, swings); e < U + 2 * pairs(shape); e++) {
            c->now.x[e] = to->x[e];
        }
        for (int a = 0; a < 2 * pairs(shape); a++) {
            c->now.i_A[a] = to->i_A[a];
        }
        c->now.rotor = to->rotor;
        c->now.torque_Nm = to->torque_Nm;
        c->field = field;
        c->t_s += h;
        left_s -= h;
    }
    return left_s;
}

/* Compiled once more for processors with wider vectors: the same bits, as no product is contracted with a
 * sum. */
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__OPTIMIZE__) && !defined(__clang__) &&         \
    !defined(__SANITIZE_ADDRESS__)
#define WIDER __attribute__((target_clones("default", "avx2")))
#else
#define WIDER
#endif

WIDER double steps_symmetrical(circuit_t *c, double left_s, bool *event)
{
    bool swings = c->bridge.swinging != 0u;
    switch (c->machine.winding.active) {
    case 2:
        return swings ? take_steps(c, left_s, STAR, true, event) : take_steps(c, left_s, STAR, false, event);
    case 3:
        return swings ? take_steps(c, left_s, OPEN, true, event) : take_steps(c, left_s, OPEN, false, event);
    default:
        return swings ? take_steps(c, left_s, DOUBLE, true, event)
                      : take_steps(c, left_s, DOUBLE, false, event);
    }
}

INLINE void current_rates(const circuit_t *c, shape_t shape, double i_A_s[ACTIVE])
{
    double rate[ELEMENTS];
    pair_t flux_V[PAIRS], core_V[PLANT_SETS], moved_A_s[PAIRS];
    tied_t tied;
    rates_at(c, &c->field, c->now.x, shape, true, &tied, rate, flux_V);
    field_rates(&c->machine, c->now.rotor, rate[THETA_E], shape, &c->field, flux_V, core_V, moved_A_s);
    for (int p = 0; p < pairs(shape); p++) {
        pair_put(&i_A_s[2 * p], moved_A_s[p]);
    }
}

void circuit_symmetrical_rates(const circuit_t *c, double i_A_s[ACTIVE])
{
    switch (c->machine.winding.active) {
    case 2:
        current_rates(c, STAR, i_A_s);
        break;
    case 3:
        current_rates(c, OPEN, i_A_s);
        break;
    default:
        current_rates(c, DOUBLE, i_A_s);
        break;
    }
}
