/* Steps of a symmetrical machine on legs that are tied or swing, or of a star with legs that float.
 *
 * The first and second derivative of the state are known in closed form at every point, as all follows from
 * the currents and these move by the tangent of the field. A step is the Taylor series of second order, and
 * the rates at its end add the third:
 *
 *   y' = y + h f + h^2/2 f',   d = h/3 (f(y') - f - h f'),   y(h) = y' + d
 *
 * d is also what the second order misses, which is the error that is controlled. So a step takes one
 * evaluation of the field, and a change of the legs none.
 *
 * Terminals that swing with their windings do so at 0.1 to 1 MHz, far faster than all else moves. Of them the
 * series goes on (symmetrical_swing.h): with nine orders a step is a quarter of a swing, and what follows from
 * the currents is integrated by Simpson's rule. */
#include "sim_plant/steps.h"
#include "sim_plant/symmetrical_drops.h"
#include "sim_plant/symmetrical_rates.h"
#include "sim_plant/symmetrical_swing.h"

#include <math.h>

/* Of d, where all is smooth: about what the embedded solution of a Runge-Kutta pair of this order misses. */
#define PART 0.125

/* motion_V: what of the miss is error, of speed and link */
INLINE double error_norm(const circuit_t *c, const rates_t *miss, pair_t motion, shape_t shape, bool swings)
{
    double worst = fabs(motion[0]) / (fabs(c->now.x[OMEGA_MECH]) + 1.0);
    double u = 0.0, v = fabs(motion[1]);
    for (int set = 0; set < shape.sets; set++) {
        u = larger(u, larger(fabs(miss->flux_V[set][0]), fabs(miss->flux_V[set][1])));
    }
    for (int k = 0; swings && k < shape.legs; k++) {
        v = larger(v, fabs(miss->leg_V_s[k / 3][k % 3]));
    }
    if (pairs(shape) > shape.sets) {
        worst = larger(worst, fabs(miss->flux_V[shape.sets][0]) * c->inv_i_scale_1_A);
    }
    worst = larger(worst, larger(u * c->inv_u_scale, v * c->inv_v_scale_1_V));
    return worst * c->inv_tolerance;
}

/* The Taylor series, without the angle. rate: of what swings, at the end. */
INLINE void predict(const circuit_t *c, const start_t *s, double h, shape_t shape, bool swings, double x[],
                    field_t *f, swing_t *rate)
{
    const double half = 0.5 * h;
    for (int n = 0; n < FOLLOWERS; n++) {
        pair_t mean = s->rate.follow[n] + both(half) * s->bend.follow[n];
        pair_put(&x[FOLLOWER(n)], pair_at(&c->now.x[FOLLOWER(n)]) + both(h) * mean);
    }
    if (swings) {
        swing_t moved;
        swing_at(s, h, shape, &moved, rate);
        for (int g = 0; g < groups(shape); g++) {
            trio_t v_V;
            terminals_at(c->now.x, g, &v_V);
            v_V += h * moved.leg[g];
            terminals_put(x, g, &v_V);
        }
        pair_put(&x[FOLLOWER(VOLTS)], pair_at(&c->now.x[FOLLOWER(VOLTS)]) + both(h) * moved.volts);
        for (int p = 0; p < pairs(shape); p++) {
            f->flux[p] = s->flux[p] + both(h) * moved.flux[p];
        }
    } else {
        for (int p = 0; p < pairs(shape); p++) {
            f->flux[p] = s->flux[p] + both(h) * (s->rate.flux_V[p] + both(half) * s->bend.flux_V[p]);
        }
    }
    for (int set = 0; set < shape.sets && shape.sets > 1; set++) {
        f->core_Wb[set] = s->core_Wb[set] + both(h) * s->core_V[set];
    }
}

/* d from the rates at the end. */
INLINE void find_miss(const circuit_t *c, const start_t *s, double h, const rates_t *end, shape_t shape,
                      bool floats, rates_t *miss)
{
    const double third = h / 3.0;
    for (int n = 0; n < FOLLOWERS; n++) {
        miss->follow[n] = both(third) * (end->follow[n] - s->rate.follow[n] - both(h) * s->bend.follow[n]);
    }
    for (int p = 0; p < pairs(shape); p++) {
        miss->flux_V[p] = both(third) * (end->flux_V[p] - s->rate.flux_V[p] - both(h) * s->bend.flux_V[p]);
    }
    if (floats) {
        miss->flux_V[0] = two_phase_part(c, miss->flux_V[0]);
    }
}

/* Rates within a step, h after its start. */
INLINE void rates_between(const circuit_t *c, const start_t *s, double h, shape_t shape, rates_t *rate)
{
    double x[ELEMENTS];
    field_t f;
    swing_t end;
    tied_t tied = s->tied;
    rotor_t rotor = frame_turn(c->now.rotor, h * (s->omega_e + 0.5 * h * s->omega_e_s));
    predict(c, s, h, shape, true, x, &f, &end);
    field_at(&c->machine, rotor, shape, &f);
    rates_at(c, rotor, &f, x, shape, s->swings, false, s->steady, &tied, rate);
}

/* The same where terminals swing, of whose series these are the rates at the end: nearly all of the third
 * derivative is in it. Over a long step what follows takes Simpson's rule, with the rates in its middle.
 * Returns what of the miss of speed and link is error. */
INLINE pair_t find_swing_miss(const circuit_t *c, const start_t *s, double h, const swing_t *rate,
                              const rates_t *end, shape_t shape, rates_t *miss)
{
    const double fourth = 0.25 * h;
    find_miss(c, s, h, end, shape, false, miss);
    for (int p = 0; p < pairs(shape); p++) {
        miss->flux_V[p] = both(fourth) * (end->flux_V[p] - rate->flux[p]);
    }
    for (int g = 0; g < groups(shape); g++) {
        miss->leg_V_s[g] = fourth * (end->leg_V_s[g] - rate->leg[g]);
    }
    miss->follow[VOLTS] = both(fourth) * (end->follow[VOLTS] - rate->volts);
    pair_t motion = miss->follow[MOTION];
    if (s->order == SWING_BRIEF) {
        return motion;
    }
    rates_t between;
    rates_between(c, s, 0.5 * h, shape, &between);
    for (int n = 0; n < VOLTS; n++) {
        pair_t mean = (s->rate.follow[n] + both(4.0) * between.follow[n] + end->follow[n]) * both(1.0 / 6.0);
        miss->follow[n] = both(h) * (mean - s->rate.follow[n] - both(0.5 * h) * s->bend.follow[n]);
    }
    return miss->follow[MOTION] - motion;
}

INLINE void add_miss(const rates_t *miss, shape_t shape, bool swings, double x[])
{
    for (int n = 0; n < FOLLOWERS; n++) {
        pair_put(&x[FOLLOWER(n)], pair_at(&x[FOLLOWER(n)]) + miss->follow[n]);
    }
    for (int g = 0; swings && g < groups(shape); g++) {
        trio_t v_V;
        terminals_at(x, g, &v_V);
        v_V += miss->leg_V_s[g];
        terminals_put(x, g, &v_V);
    }
}

/* Across the tied phases no current flows, and the integral of the voltage is what the linkages have moved
 * by: those of the field, and those of the magnet's harmonics by Hermite's rule. */
INLINE void open_volts(const circuit_t *c, const start_t *s, double h, const field_t *f, point_t *to)
{
    double omega_e = c->machine.pole_pairs * to->x[OMEGA_MECH];
    pair_t slopes_V = both(s->omega_e) * s->slope_Wb + both(omega_e) * f->slope_Wb[0];
    pair_t bends_V_s = both(s->omega_e * s->omega_e) * s->bend_Wb - both(omega_e * omega_e) * f->bend_Wb[0];
    pair_t start_Wb = pair_at(&c->now.x[INT_V_ALPHA]);
    pair_t moved_Wb = pair_at(&to->x[INT_V_ALPHA]) - start_Wb;
    pair_t open_Wb = f->flux[0] - s->flux[0] + both(0.5 * h) * (slopes_V + both(h / 6.0) * bends_V_s);
    pair_put(&to->x[INT_V_ALPHA], start_Wb + open_Wb + two_phase_part(c, moved_Wb - open_Wb));
}

/* One step of length h; its error in units of the tolerance. */
INLINE double step(const circuit_t *c, const start_t *s, double h, shape_t shape, bool swings, bool floats,
                   point_t *to, field_t *f)
{
    rates_t end = {.leg_V_s = {{0.0}}}, miss;
    pair_t motion;
    swing_t swing;
    tied_t tied;
    double turn = h * (s->omega_e + 0.5 * h * (s->omega_e_s + h / 3.0 * s->omega_e_s2));
    double part = swings ? 1.0 : PART;
    bool steady = s->steady;
    for (int p = 0; p < pairs(shape); p++) {
        tied.switch_V[p] = s->tied.switch_V[p];
    }
    for (int g = 0; g < groups(shape); g++) { /* for drop_part() */
        tied.zones[g] = s->tied.zones[g];
        tied.share[g] = s->tied.share[g];
    }
    to->rotor = frame_turn(c->now.rotor, turn);
    predict(c, s, h, shape, swings, to->x, f, &swing);
    field_at(&c->machine, to->rotor, shape, f);
    if (floats) {
        two_phase_release(c, to->rotor, f);
    }
    rates_at(c, to->rotor, f, to->x, shape, swings ? s->swings : NULL, floats, steady, &tied, &end);
    if (swings) {
        motion = find_swing_miss(c, s, h, &swing, &end, shape, &miss);
    } else {
        find_miss(c, s, h, &end, shape, floats, &miss);
        motion = miss.follow[MOTION];
    }
    add_miss(&miss, shape, swings, to->x);
    to->x[THETA_E] = c->now.x[THETA_E] + turn;
    field_shift(&c->machine, to->rotor, shape, miss.flux_V, f);
    if (floats) {
        two_phase_release(c, to->rotor, f);
        pair_put(to->open_V, end.follow[VOLTS]);
        open_volts(c, s, h, f, to);
    }
    for (int p = 0; p < pairs(shape); p++) {
        bool linked = shape.sets > 1;
        pair_put(&to->x[U + 2 * p], linked ? from_rotor(f->core_Wb[p], to->rotor) : f->flux[p]);
        pair_put(&to->i_A[2 * p], f->i_A[p]);
    }
    to->torque_Nm = f->torque_Nm;
    part = steady ? part : drop_part(&s->tied, &tied, shape, part);
    return part * error_norm(c, &miss, motion, shape, swings);
}

/* The same for any shape, where a step is taken again: take_steps() has one call of step(), compiled into it. */
WIDER static double step_again(const circuit_t *c, const start_t *s, double h, point_t *to, field_t *f)
{
    bool swings = c->bridge.swinging != 0u;
    *to = c->now;
    switch (c->machine.winding.active) {
    case 2:
        return step(c, s, h, STAR, swings, c->bridge.floating != 0u, to, f);
    case 3:
        return step(c, s, h, OPEN, swings, false, to, f);
    default:
        return step(c, s, h, DOUBLE, swings, false, to, f);
    }
}

static void retake(const circuit_t *c, const void *start, double h, point_t *to)
{
    field_t f;
    step_again(c, start, h, to, &f);
}

/* What the error of a step says about the next. */
INLINE void control(circuit_t *c, double h, double error, bool swings)
{
    if (!swings && error < 0.2 && h > 0.5 * c->step_s) {
        c->step_s = error < 0.02 ? 3.0 * h : 1.5 * h;
    }
}

/* Whether a step has to be shortened to end at its event. */
INLINE bool past_event(const circuit_t *c, const point_t *to, bool *event)
{
    excess_t excess = steps_excess(c, to);
    *event = steps_event(excess);
    return *event && !steps_landed(excess);
}

/* The end of a step becomes the present point. */
INLINE void arrive(circuit_t *c, const point_t *to, shape_t shape, bool swings)
{
    for (int n = 0; n < FOLLOWERS; n++) {
        pair_put(&c->now.x[FOLLOWER(n)], pair_at(&to->x[FOLLOWER(n)]));
    }
    for (int k = 0; swings && k < shape.legs; k++) {
        c->now.x[V_LEG(k)] = to->x[V_LEG(k)];
    }
    for (int p = 0; p < pairs(shape); p++) {
        pair_put(&c->now.x[U + 2 * p], pair_at(&to->x[U + 2 * p]));
        pair_put(&c->now.i_A[2 * p], pair_at(&to->i_A[2 * p]));
    }
    c->now.x[THETA_E] = to->x[THETA_E];
    c->now.rotor = to->rotor;
    c->now.torque_Nm = to->torque_Nm;
}

INLINE double take_steps(circuit_t *c, double left_s, shape_t shape, bool swings, bool floats, bool *event)
{
    point_t *to = &c->next;
    start_t start;
    know_field(c, shape);
    while (left_s > 0.0 && !*event) {
        begin(c, shape, swings, floats, &start);
        if (floats) {
            pair_put(c->now.open_V, start.rate.follow[VOLTS]);
        }
        double h = swings || c->step_s > left_s ? left_s : c->step_s;
        h = steps_turn_s(c, start.omega_e, h);
        h = swings ? swing_s(c, &start, shape, h) : h;
        double zone = zone_s(c, &start, shape, h);
        bool smooth = zone == h;
        h = zone;
        h = h > 0.999 * left_s ? left_s : h; /* no sliver at the end */
        double error = step(c, &start, h, shape, swings, floats, to, &c->field);
        while (!(error <= 1.0) && h > 1e-9 * left_s) { /* NaN too */
            h = steps_shorter_s(h, error);
            c->step_s = swings || !smooth ? c->step_s : h;
            error = step_again(c, &start, h, to, &c->field);
        }
        control(c, h, error, swings);
        if (steps_watching(c, to) && past_event(c, to, event)) {
            h = steps_locate(c, h, retake, &start, to);
            step_again(c, &start, h, to, &c->field);
        }
        if (steps_probing(c)) {
            steps_probe(c, to, h);
        }
        arrive(c, to, shape, swings);
        c->t_s += h;
        left_s -= h;
    }
    return left_s;
}

WIDER double steps_symmetrical(circuit_t *c, double left_s, bool *event)
{
    bool swings = c->bridge.swinging != 0u;
    switch (c->machine.winding.active) {
    case 2:
        if (c->bridge.floating != 0u) {
            return take_steps(c, left_s, STAR, false, true, event);
        }
        return swings ? take_steps(c, left_s, STAR, true, false, event)
                      : take_steps(c, left_s, STAR, false, false, event);
    case 3:
        return swings ? take_steps(c, left_s, OPEN, true, false, event)
                      : take_steps(c, left_s, OPEN, false, false, event);
    default:
        return swings ? take_steps(c, left_s, DOUBLE, true, false, event)
                      : take_steps(c, left_s, DOUBLE, false, false, event);
    }
}

INLINE void current_rates(const circuit_t *c, shape_t shape, double i_A_s[ACTIVE])
{
    rates_t rate;
    pair_t core_V[PLANT_SETS], moved_A_s[PAIRS];
    tied_t tied;
    double omega_e = c->machine.pole_pairs * c->now.x[OMEGA_MECH];
    trio_t swings[PLANT_SETS];
    no_drops(shape, &tied);
    find_swinging(&c->bridge, shape, swings);
    rates_at(c, c->now.rotor, &c->field, c->now.x, shape, swings, false, c->bridge.v_switch_V == 0.0, &tied,
             &rate);
    field_rates(&c->machine, c->now.rotor, omega_e, shape, &c->field, rate.flux_V, core_V, moved_A_s);
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
