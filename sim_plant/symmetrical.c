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
#include "sim_plant/field.h"
#include "sim_plant/steps.h"

#include <math.h>

/* Of d, where all is smooth: about what the embedded solution of a Runge-Kutta pair of this order misses. */
#define PART 0.125

/* Of the legs at a point */
typedef struct {
    double v_V[ACTIVE], drop_V[ACTIVE];
    double i_leg_A[PLANT_LEGS], share[PLANT_LEGS]; /* of the drop of closed switches, when there is one */
    double i_dc_A;
} tied_t;

/* Rates at the start of a step, and what they say about it. */
typedef struct {
    double rate[ELEMENTS], bend[ELEMENTS];    /* first and second derivative */
    double omega_jerk;                        /* third derivative of the angle */
    double v_leg_V_s3[PLANT_LEGS];            /* and of swinging terminals, nearly, */
    double v_V_s2[ACTIVE], flux_V_s2[ACTIVE]; /* and what these do to voltages and linkages */
    dq_t core_V[PLANT_SETS];
    tied_t tied;
} start_t;

/* Coordinates of leg k: of two stars those of its own set. */
INLINE int leg_first(shape_t shape, int k)
{
    return shape.sets == 2 ? 2 * (k / 3) : 0;
}

INLINE int leg_end(shape_t shape, int k)
{
    return shape.sets == 2 ? 2 * (k / 3) + 2 : shape.active;
}

INLINE double weight(shape_t shape, int a)
{
    return a < 2 * shape.sets ? 1.5 : 3.0;
}

INLINE double along(const winding_t *w, shape_t shape, int k, const double x[])
{
    double sum = 0.0;
    for (int a = leg_first(shape, k); a < leg_end(shape, k); a++) {
        sum += w->axis[k][a] * x[a];
    }
    return sum;
}

INLINE void spread(const winding_t *w, shape_t shape, int k, double v_V, double to_V[])
{
    for (int a = leg_first(shape, k); a < leg_end(shape, k); a++) {
        to_V[a] += w->share[k][a] * v_V;
    }
}

INLINE void tied_at(const circuit_t *c, const field_t *f, const double x[], shape_t shape, bool swings,
                    tied_t *t)
{
    const bridge_t *b = &c->bridge;
    const winding_t *w = &c->machine.winding;
    double i_dc_A = 0.0;
    double v_swing_V[ACTIVE] = {0.0};
    for (int a = 0; a < shape.active; a++) {
        t->drop_V[a] = b->r_series_ohm * f->i_A[a] - b->diode_V[a];
        i_dc_A += weight(shape, a) * b->rail[a] * f->i_A[a];
    }
    bool each = swings || b->v_switch_V != 0.0;
    for (int k = 0; k < shape.legs; k++) {
        t->i_leg_A[k] = each ? along(w, shape, k, f->i_A) : 0.0;
        t->share[k] = 0.0;
    }
    if (b->v_switch_V != 0.0) {
        for (int k = 0; k < shape.legs; k++) {
            t->share[k] = bridge_switch_share(t->i_leg_A[k] * b->inv_zone_1_A[k]);
            spread(w, shape, k, b->v_switch_V * t->share[k], t->drop_V);
        }
    }
    if (swings) {
        for (int k = 0; k < shape.legs; k++) {
            if (b->leg[k] == LEG_SWINGING) {
                spread(w, shape, k, x[V_LEG(k)], v_swing_V);
                spread(w, shape, k, -b->r_on_ohm * t->i_leg_A[k], t->drop_V);
            }
        }
    }
    for (int a = 0; a < shape.active; a++) {
        t->v_V[a] = b->rail[a] * x[V_DC] + b->source_V[a] - t->drop_V[a] + (swings ? v_swing_V[a] : 0.0);
    }
    t->i_dc_A = i_dc_A;
}

INLINE void rates_at(const circuit_t *c, const field_t *f, const double x[], shape_t shape, bool swings,
                     tied_t *t, double rate[])
{
    const machine_t *m = &c->machine;
    const bridge_t *b = &c->bridge;
    double omega = x[OMEGA_MECH], v_dc = x[V_DC];
    double omega_e = m->pole_pairs * omega;
    double in_W = 0.0, copper = 0.0, device_W = 0.0;
    tied_at(c, f, x, shape, swings, t);
    for (int a = 0; a < shape.active; a++) {
        double power = weight(shape, a) * f->i_A[a];
        rate[U + a] = t->v_V[a] - m->R_s_ohm * f->i_A[a] - omega_e * f->slope_Wb[a];
        in_W += b->sources ? power * b->source_V[a] : 0.0;
        copper += power * f->i_A[a];
        device_W += power * t->drop_V[a];
    }
    if (shape.active > 2 * shape.sets) {
        rate[U + 2 * shape.sets] *= m->loose_gamma_1_H[2 * shape.sets];
    }
    for (int k = 0; k < shape.legs && swings; k++) {
        rate[V_LEG(k)] = b->leg[k] == LEG_SWINGING ? -t->i_leg_A[k] * b->inv_c_leg_1_F : 0.0;
    }
    rate[THETA_E] = omega_e;
    rate[OMEGA_MECH] = mechanics_rate(&c->mech, omega, f->torque_Nm);
    rate[V_DC] = dclink_rate(&c->link, v_dc, t->i_dc_A, 0.0);
    rate[INT_V_ALPHA] = t->v_V[0];
    rate[INT_V_BETA] = t->v_V[1];
    rate[INT_IN] = v_dc * t->i_dc_A + in_W;
    rate[INT_COPPER] = m->R_s_ohm * copper;
    rate[INT_DEVICE] = device_W;
    rate[INT_MECH] = f->torque_Nm * omega;
}

/* How voltages of the legs move with the currents. */
INLINE void tied_bends(const circuit_t *c, const tied_t *t, const double i_A_s[], shape_t shape, bool swings,
                       start_t *s, double drop_V_s[], double v_V_s[])
{
    const bridge_t *b = &c->bridge;
    const winding_t *w = &c->machine.winding;
    double swing_V_s[ACTIVE] = {0.0};
    for (int a = 0; a < shape.active; a++) {
        drop_V_s[a] = b->r_series_ohm * i_A_s[a];
    }
    if (b->v_switch_V != 0.0) {
        for (int k = 0; k < shape.legs; k++) {
            double x = t->i_leg_A[k] * b->inv_zone_1_A[k];
            if (x > -1.0 && x < 1.0) {
                double slope = b->v_switch_V * 1.5 * (1.0 - x * x) * b->inv_zone_1_A[k];
                spread(w, shape, k, slope * along(w, shape, k, i_A_s), drop_V_s);
            }
        }
    }
    if (swings) {
        for (int k = 0; k < shape.legs; k++) {
            s->bend[V_LEG(k)] = 0.0;
            if (b->leg[k] == LEG_SWINGING) {
                double moves_A_s = along(w, shape, k, i_A_s);
                s->bend[V_LEG(k)] = -moves_A_s * b->inv_c_leg_1_F;
                spread(w, shape, k, s->rate[V_LEG(k)], swing_V_s);
                spread(w, shape, k, -b->r_on_ohm * moves_A_s, drop_V_s);
            }
        }
    }
    for (int a = 0; a < shape.active; a++) {
        v_V_s[a] = b->rail[a] * s->rate[V_DC] - drop_V_s[a] + (swings ? swing_V_s[a] : 0.0);
    }
}

/* Second derivatives of the flux linkages, and what of the others goes by coordinate. */
INLINE void flux_bends(const circuit_t *c, const field_t *f, const tied_t *t, const double i_A_s[],
                       shape_t shape, bool swings, start_t *s)
{
    const machine_t *m = &c->machine;
    const bridge_t *b = &c->bridge;
    double drop_V_s[ACTIVE], v_V_s[ACTIVE];
    double omega_e = s->rate[THETA_E], omega_e_s = m->pole_pairs * s->rate[OMEGA_MECH];
    double i_dc_A_s = 0.0, source_W_s = 0.0, copper = 0.0, device_W_s = 0.0, harmonic = 0.0;
    tied_bends(c, t, i_A_s, shape, swings, s, drop_V_s, v_V_s);
    for (int a = 0; a < shape.active; a++) {
        double i = weight(shape, a) * f->i_A[a], moves = weight(shape, a) * i_A_s[a];
        s->bend[U + a] =
            v_V_s[a] - m->R_s_ohm * i_A_s[a] - omega_e_s * f->slope_Wb[a] - omega_e * omega_e * f->bend_Wb[a];
        i_dc_A_s += b->rail[a] * moves;
        source_W_s += b->sources ? b->source_V[a] * moves : 0.0;
        copper += i * i_A_s[a];
        device_W_s += i * drop_V_s[a] + moves * t->drop_V[a];
        harmonic += moves * f->slope_Wb[a] + omega_e * i * f->bend_Wb[a];
    }
    double cross = 0.0;
    for (int set = 0; set < shape.sets; set++) {
        int a = 2 * set;
        cross += s->rate[U + a] * f->i_A[a + 1] - s->rate[U + a + 1] * f->i_A[a];
        cross += f->flux[a] * i_A_s[a + 1] - f->flux[a + 1] * i_A_s[a];
    }
    if (shape.active > 2 * shape.sets) {
        s->bend[U + 2 * shape.sets] *= m->loose_gamma_1_H[2 * shape.sets];
    }
    double torque_Nm_s = m->torque_gain * cross + m->pole_pairs * harmonic;
    double omega_s = s->rate[OMEGA_MECH];
    s->bend[THETA_E] = omega_e_s;
    s->bend[OMEGA_MECH] = c->mech.gain_1_kgm2 * (torque_Nm_s - c->mech.parameters.B_Nms * omega_s);
    s->bend[V_DC] = i_dc_A_s; /* for link_bends() */
    s->bend[INT_V_ALPHA] = v_V_s[0];
    s->bend[INT_V_BETA] = v_V_s[1];
    s->bend[INT_IN] = source_W_s;
    s->bend[INT_COPPER] = 2.0 * m->R_s_ohm * copper;
    s->bend[INT_DEVICE] = device_W_s;
    s->bend[INT_MECH] = torque_Nm_s * c->now.x[OMEGA_MECH] + f->torque_Nm * omega_s;
}

INLINE void link_bends(const circuit_t *c, double i_dc_A, start_t *s)
{
    double v_dc = c->now.x[V_DC], i_dc_A_s = s->bend[V_DC], v_dc_s = s->rate[V_DC];
    bool fed = c->link.connected && !(c->link.blocks && c->link.v_source_V < v_dc);
    double bend = (-(fed ? c->link.g_source_S * v_dc_s : 0.0) - i_dc_A_s) * c->link.inv_C_1_F;
    s->bend[V_DC] = v_dc > 0.0 ? bend : 0.0;
    s->bend[INT_IN] += v_dc_s * i_dc_A + v_dc * i_dc_A_s;
}

INLINE void begin(const circuit_t *c, shape_t shape, bool swings, start_t *s)
{
    const field_t *f = &c->field;
    const machine_t *m = &c->machine;
    double i_A_s[ACTIVE];
    rates_at(c, f, c->now.x, shape, swings, &s->tied, s->rate);
    field_rates(m, c->now.rotor, s->rate[THETA_E], shape, f, &s->rate[U], s->core_V, i_A_s);
    flux_bends(c, f, &s->tied, i_A_s, shape, swings, s);
    link_bends(c, s->tied.i_dc_A, s);
    s->omega_jerk = m->pole_pairs * s->bend[OMEGA_MECH];
    if (swings) {
        dq_t core_V_s[PLANT_SETS];
        double i_A_s2[ACTIVE];
        field_rates(m, c->now.rotor, 0.0, shape, f, &s->bend[U], core_V_s, i_A_s2);
        for (int a = 0; a < shape.active; a++) {
            s->v_V_s2[a] = -c->bridge.r_series_ohm * i_A_s2[a];
        }
        for (int k = 0; k < shape.legs; k++) {
            bool swinging = c->bridge.leg[k] == LEG_SWINGING;
            s->v_leg_V_s3[k] =
                swinging ? -along(&m->winding, shape, k, i_A_s2) * c->bridge.inv_c_leg_1_F : 0.0;
            spread(&m->winding, shape, k, s->bend[V_LEG(k)], s->v_V_s2);
        }
        for (int a = 0; a < shape.active; a++) {
            s->flux_V_s2[a] = s->v_V_s2[a] - m->R_s_ohm * i_A_s2[a];
        }
        if (shape.active > 2 * shape.sets) {
            s->flux_V_s2[2 * shape.sets] *= m->loose_gamma_1_H[2 * shape.sets];
        }
    }
}

/* Whether the drop of a closed switch has moved: then nothing is smooth. */
INLINE bool turned_over(const bridge_t *b, const tied_t *from, const tied_t *to, shape_t shape)
{
    bool moved = false;
    for (int k = 0; k < shape.legs && b->v_switch_V != 0.0; k++) {
        moved = moved || from->share[k] != to->share[k];
    }
    return moved;
}

INLINE double error_norm(const circuit_t *c, const double miss[], shape_t shape, bool swings)
{
    double worst = miss[OMEGA_MECH] / (fabs(c->now.x[OMEGA_MECH]) + 1.0);
    double u = 0.0, v = miss[V_DC];
    for (int a = 0; a < 2 * shape.sets; a++) {
        u = larger(u, miss[U + a]);
    }
    for (int k = 0; k < shape.legs && swings; k++) {
        v = larger(v, miss[V_LEG(k)]);
    }
    if (shape.active > 2 * shape.sets) {
        worst = larger(worst, miss[U + 2 * shape.sets] * c->inv_i_scale_1_A);
    }
    worst = larger(worst, larger(u * c->inv_u_scale, v * c->inv_v_scale_1_V));
    return worst * c->inv_tolerance;
}

/* One step of length h; its error in units of the tolerance. */
INLINE double step(const circuit_t *c, const start_t *s, double h, shape_t shape, bool swings, point_t *to,
                   field_t *f)
{
    const int first = swings ? V_LEG(shape.legs - 1) : THETA_E;
    const machine_t *m = &c->machine;
    const point_t *from = &c->now;
    double end[ELEMENTS], miss[ELEMENTS], by[ACTIVE];
    double half = 0.5 * h, third = h / 3.0, cube = third * half * h;
    tied_t tied;
    double turn = h * (s->rate[THETA_E] + half * (s->bend[THETA_E] + third * s->omega_jerk));
    to->rotor = frame_turn(from->rotor, turn);
    for (int e = first; e < U; e++) {
        to->x[e] = from->x[e] + h * (s->rate[e] + half * s->bend[e]);
    }
    for (int k = 0; k < shape.legs && swings; k++) {
        to->x[V_LEG(k)] += cube * s->v_leg_V_s3[k];
    }
    for (int a = 0; a < shape.active; a++) {
        double bend = s->bend[U + a] + (swings ? third * s->flux_V_s2[a] : 0.0);
        f->flux[a] = c->field.flux[a] + h * (s->rate[U + a] + half * bend);
    }
    for (int set = 0; set < shape.sets; set++) {
        f->core_Wb[set].d = c->field.core_Wb[set].d + h * s->core_V[set].d;
        f->core_Wb[set].q = c->field.core_Wb[set].q + h * s->core_V[set].q;
    }
    field_at(m, to->rotor, shape, f);
    rates_at(c, f, to->x, shape, swings, &tied, end);
    for (int e = first; e < U + shape.active; e++) {
        miss[e] = third * (end[e] - s->rate[e] - h * s->bend[e]);
    }
    for (int k = 0; k < shape.legs && swings; k++) {
        double known = cube * s->v_leg_V_s3[k];
        double more = 0.75 * (miss[V_LEG(k)] - known);
        to->x[V_LEG(k)] += more;
        miss[V_LEG(k)] = fabs(more);
    }
    for (int a = 0; a < 2 && swings; a++) {
        miss[INT_V_ALPHA + a] -= 0.25 * (miss[INT_V_ALPHA + a] - cube * s->v_V_s2[a]);
    }
    for (int e = THETA_E; e < U; e++) {
        to->x[e] += miss[e];
        miss[e] = fabs(miss[e]);
    }
    for (int a = 0; a < shape.active; a++) {
        double known = swings ? cube * s->flux_V_s2[a] : 0.0;
        by[a] = (swings ? 0.75 : 1.0) * (miss[U + a] - known);
        miss[U + a] = fabs(by[a]);
    }
    to->x[THETA_E] = from->x[THETA_E] + turn;
    field_shift(m, to->rotor, shape, by, f);
    for (int a = 0; a < shape.active; a++) {
        to->x[U + a] = f->flux[a];
        to->i_A[a] = f->i_A[a];
    }
    for (int set = 0; set < shape.sets && shape.sets > 1; set++) {
        ab_t core = frame_to_ab(f->core_Wb[set], to->rotor);
        to->x[U + 2 * set] = core.alpha;
        to->x[U + 2 * set + 1] = core.beta;
    }
    to->torque_Nm = f->torque_Nm;
    bool smooth = !swings && !turned_over(&c->bridge, &s->tied, &tied, shape);
    return (smooth ? PART : 1.0) * error_norm(c, miss, shape, swings);
}

static void retake(const circuit_t *c, const void *start, double h, point_t *to)
{
    field_t f;
    bool swings = c->bridge.swinging > 0;
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
    }
}

INLINE double take_steps(circuit_t *c, double left_s, shape_t shape, bool swings, bool *event)
{
    point_t to = c->now;
    field_t field;
    start_t start;
    know_field(c, shape);
    while (left_s > 0.0 && !*event) {
        begin(c, shape, swings, &start);
        double h = swings || c->step_s > left_s ? left_s : c->step_s;
        h = steps_turn_s(c, start.rate[THETA_E], h);
        h = swings ? swing_s(c, &start, shape, h) : h;
        h = h > 0.999 * left_s ? left_s : h; /* no sliver at the end */
        double error = step(c, &start, h, shape, swings, &to, &field);
        while (!(error <= 1.0) && h > 1e-9 * left_s) {
            h = steps_shorter_s(h, error);
            c->step_s = swings ? c->step_s : h;
            error = step(c, &start, h, shape, swings, &to, &field);
        }
        if (!swings) {
            control(c, h, error);
        }
        if (steps_watching(c)) {
            excess_t excess = steps_excess(c, &to);
            *event = steps_event(excess);
            if (*event && !steps_landed(excess)) {
                h = steps_locate(c, h, retake, &start, &to);
                step(c, &start, h, shape, swings, &to, &field);
            }
        }
        if (probe_active(&c->probe)) {
            steps_probe(c, &to, h);
        }
        c->now = to;
        c->field = field;
        c->t_s += h;
        left_s -= h;
    }
    return left_s;
}

double steps_symmetrical(circuit_t *c, double left_s, bool *event)
{
    bool swings = c->bridge.swinging > 0;
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
