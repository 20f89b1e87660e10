/* Steps of a symmetrical machine on legs that are tied or swing, or of a star with legs that float.
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

INLINE double error_norm(const circuit_t *c, const rates_t *miss, shape_t shape, bool swings)
{
    double worst = fabs(miss->follow[MOTION][0]) / (fabs(c->now.x[OMEGA_MECH]) + 1.0);
    double u = 0.0, v = fabs(miss->follow[MOTION][1]);
    for (int set = 0; set < shape.sets; set++) {
        u = larger(u, larger(fabs(miss->flux_V[set][0]), fabs(miss->flux_V[set][1])));
    }
    for (unsigned legs = c->bridge.swinging; swings && legs != 0u; legs &= legs - 1u) {
        v = larger(v, fabs(miss->leg_V_s[bridge_first(legs)]));
    }
    if (pairs(shape) > shape.sets) {
        worst = larger(worst, fabs(miss->flux_V[shape.sets][0]) * c->inv_i_scale_1_A);
    }
    worst = larger(worst, larger(u * c->inv_u_scale, v * c->inv_v_scale_1_V));
    return worst * c->inv_tolerance;
}

/* The Taylor series, without the angle. */
INLINE void predict(const circuit_t *c, const start_t *s, double h, shape_t shape, bool swings, double x[],
                    field_t *f)
{
    const double half = 0.5 * h, third = h / 3.0;
    for (int n = 0; n < FOLLOWERS; n++) {
        pair_t mean = s->rate.follow[n] + both(half) * s->bend.follow[n];
        pair_put(&x[FOLLOWER(n)], pair_at(&c->now.x[FOLLOWER(n)]) + both(h) * mean);
    }
    for (unsigned legs = c->bridge.swinging; swings && legs != 0u; legs &= legs - 1u) {
        int k = bridge_first(legs);
        double mean = s->rate.leg_V_s[k] + half * (s->bend.leg_V_s[k] + third * s->leg_V_s3[k]);
        x[V_LEG(k)] = c->now.x[V_LEG(k)] + h * mean;
    }
    for (int p = 0; p < pairs(shape); p++) {
        pair_t bend = swings ? s->bend.flux_V[p] + both(third) * s->flux_V_s2[p] : s->bend.flux_V[p];
        f->flux[p] = s->flux[p] + both(h) * (s->rate.flux_V[p] + both(half) * bend);
    }
    for (int set = 0; set < shape.sets && shape.sets > 1; set++) {
        f->core_Wb[set] = s->core_Wb[set] + both(h) * s->core_V[set];
    }
}

/* d from the rates at the end; where third derivatives are in the series already, what is missing of it. */
INLINE void find_miss(const circuit_t *c, const start_t *s, double h, const rates_t *end, shape_t shape,
                      bool swings, bool floats, rates_t *miss)
{
    const double third = h / 3.0, cube = third * 0.5 * h * h;
    for (int n = 0; n < FOLLOWERS; n++) {
        miss->follow[n] = both(third) * (end->follow[n] - s->rate.follow[n] - both(h) * s->bend.follow[n]);
    }
    for (int p = 0; p < pairs(shape); p++) {
        pair_t d = both(third) * (end->flux_V[p] - s->rate.flux_V[p] - both(h) * s->bend.flux_V[p]);
        miss->flux_V[p] = swings ? both(0.75) * (d - both(cube) * s->flux_V_s2[p]) : d;
    }
    for (unsigned legs = c->bridge.swinging; swings && legs != 0u; legs &= legs - 1u) {
        int k = bridge_first(legs);
        double d = third * (end->leg_V_s[k] - s->rate.leg_V_s[k] - h * s->bend.leg_V_s[k]);
        miss->leg_V_s[k] = 0.75 * (d - cube * s->leg_V_s3[k]);
    }
    if (swings) {
        miss->follow[VOLTS] -= both(0.25) * (miss->follow[VOLTS] - both(cube) * s->v_V_s2[0]);
    }
    if (floats) {
        miss->flux_V[0] = two_phase_part(c, miss->flux_V[0]);
    }
}

INLINE void add_miss(const circuit_t *c, const rates_t *miss, bool swings, double x[])
{
    for (int n = 0; n < FOLLOWERS; n++) {
        pair_put(&x[FOLLOWER(n)], pair_at(&x[FOLLOWER(n)]) + miss->follow[n]);
    }
    for (unsigned legs = c->bridge.swinging; swings && legs != 0u; legs &= legs - 1u) {
        int k = bridge_first(legs);
        x[V_LEG(k)] += miss->leg_V_s[k];
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
    rates_t end, miss;
    tied_t tied;
    double turn = h * (s->omega_e + 0.5 * h * (s->omega_e_s + h / 3.0 * s->omega_e_s2));
    double part = swings ? 1.0 : PART;
    bool steady = s->steady;
    for (int p = 0; p < pairs(shape); p++) {
        tied.switch_V[p] = s->tied.switch_V[p];
    }
    to->rotor = frame_turn(c->now.rotor, turn);
    predict(c, s, h, shape, swings, to->x, f);
    field_at(&c->machine, to->rotor, shape, f);
    if (floats) {
        two_phase_release(c, to->rotor, f);
    }
    rates_at(c, to->rotor, f, to->x, shape, swings, floats, steady, &tied, &end);
    find_miss(c, s, h, &end, shape, swings, floats, &miss);
    add_miss(c, &miss, swings, to->x);
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
    return part * error_norm(c, &miss, shape, swings);
}

static void retake(const circuit_t *c, const void *start, double h, point_t *to)
{
    field_t f = c->field;
    bool swings = c->bridge.swinging != 0u;
    *to = c->now;
    switch (c->machine.winding.active) {
    case 2:
        step(c, start, h, STAR, swings, c->bridge.floating != 0u, to, &f);
        break;
    case 3:
        step(c, start, h, OPEN, swings, false, to, &f);
        break;
    default:
        step(c, start, h, DOUBLE, swings, false, to, &f);
        break;
    }
}

/* Until a swinging terminal arrives at its diode, by the first three derivatives; h if not before. */
INLINE double arrival_s(const circuit_t *c, const start_t *s, int k, double h)
{
    double rate = s->rate.leg_V_s[k], bend = 0.5 * s->bend.leg_V_s[k], jerk = s->leg_V_s3[k] / 6.0;
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
INLINE double swing_s(const circuit_t *c, const start_t *s, double h)
{
    double bend = 0.0, jerk = 0.0;
    for (unsigned legs = c->bridge.swinging; legs != 0u; legs &= legs - 1u) {
        int k = bridge_first(legs);
        h = arrival_s(c, s, k, h);
        bend = larger(bend, fabs(s->bend.leg_V_s[k]));
        jerk = larger(jerk, fabs(s->leg_V_s3[k]));
    }
    double damping = c->bridge.g_winding_S * c->bridge.inv_c_leg_1_F;
    double square = c->machine.gamma_leg_1_H * c->bridge.inv_c_leg_1_F; /* of the angular frequency */
    double fourth_V = damping > 0.0 ? bend * square + jerk * damping : bend * square;
    double error = fourth_V * h * h * h * h * (c->inv_v_scale_1_V * c->inv_tolerance / 24.0);
    return error > 0.5 ? h * sqrt(sqrt(0.5 / error)) : h;
}

/* What the error of a step says about the next. */
INLINE void control(circuit_t *c, double h, double error)
{
    if (error < 0.2 && h > 0.5 * c->step_s) {
        c->step_s = error < 0.02 ? 3.0 * h : 1.5 * h;
    }
}

/* The end of a step becomes the present point. */
INLINE void arrive(circuit_t *c, const point_t *to, shape_t shape, bool swings)
{
    for (int n = 0; n < FOLLOWERS; n++) {
        pair_put(&c->now.x[FOLLOWER(n)], pair_at(&to->x[FOLLOWER(n)]));
    }
    for (unsigned legs = c->bridge.swinging; swings && legs != 0u; legs &= legs - 1u) {
        int k = bridge_first(legs);
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
        h = swings ? swing_s(c, &start, h) : h;
        double zone = zone_s(c, &start, shape, h);
        bool smooth = zone == h;
        h = zone;
        h = h > 0.999 * left_s ? left_s : h; /* no sliver at the end */
        double error = step(c, &start, h, shape, swings, floats, to, &c->field);
        while (!(error <= 1.0) && h > 1e-9 * left_s) {
            h = steps_shorter_s(h, error);
            c->step_s = swings || !smooth ? c->step_s : h;
            error = step(c, &start, h, shape, swings, floats, to, &c->field);
        }
        if (!swings) {
            control(c, h, error);
        }
        if (steps_watching(c, to)) {
            excess_t excess = steps_excess(c, to);
            *event = steps_event(excess);
            if (*event && !steps_landed(excess)) {
                h = steps_locate(c, h, retake, &start, to);
                step(c, &start, h, shape, swings, floats, to, &c->field);
            }
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
    no_drops(shape, &tied);
    rates_at(c, c->now.rotor, &c->field, c->now.x, shape, true, false, c->bridge.v_switch_V == 0.0, &tied,
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
