/* First and second derivatives of a symmetrical machine on legs that are tied or swing, or of a star with
 * legs that float (two_phase.h); for symmetrical.c.
 *
 * All follows from the currents, and these move by the tangent of the field, so that a point of the field
 * gives both in closed form, in this order:
 *   voltages of the legs
 *   dpsi/dt = v - R i - omega psi_x'
 *   di/dt
 *   rates of voltages, power and torque */
#ifndef PLANT_SYMMETRICAL_RATES_H
#define PLANT_SYMMETRICAL_RATES_H

#include "sim_plant/trio.h"
#include "sim_plant/two_phase.h"

/* What follows the windings' linkages, in pairs: elements of the state from OMEGA_MECH to U. */
enum { MOTION, POWER, LOSS, VOLTS, FOLLOWERS };
#define FOLLOWER(n) (OMEGA_MECH + 2 * (n))

/* Of the legs at a point */
typedef struct {
    pair_t v_V[PAIRS], drop_V[PAIRS];
    pair_t switch_V[PAIRS];   /* drops of closed switches, when there are any: */
    trio_t zones[PLANT_SETS]; /* their currents in units of the zone, */
    trio_t share[PLANT_SETS]; /* and shares of the drop */
    bool turning;             /* some are within the zone */
    double i_dc_A;
} tied_t;

typedef struct {
    pair_t flux_V[PAIRS]; /* of the field's flux, */
    pair_t follow[FOLLOWERS];
    trio_t leg_V_s[PLANT_SETS]; /* and of swinging terminals */
} rates_t;

/* A derivative of what takes part in the swing of terminals with the windings. */
typedef struct {
    pair_t flux[PAIRS], volts; /* of the field's flux, and of the integral of the voltage */
    trio_t leg[PLANT_SETS];
} swing_t;

#define SWING_ORDER      9         /* of their series, at most, */
#define SWING_FACTORIAL  3628800.0 /* of the next, */
#define SWING_BRIEF      4         /* and where a terminal arrives soon, */
#define SWING_BRIEF_NEXT 120.0     /* of the next */

/* A start of steps: where it is, and first and second derivatives. */
typedef struct {
    rates_t rate, bend;
    swing_t swing[SWING_ORDER + 1]; /* by order, from the first */
    tied_t tied;
    trio_t swings[PLANT_SETS];               /* 1: the leg does */
    pair_t flux[PAIRS], core_Wb[PLANT_SETS]; /* of the field */
    pair_t core_V[PLANT_SETS], i_A_s[PAIRS];
    pair_t slope_Wb, bend_Wb; /* of the magnet's harmonics, where legs float */
    double omega_e, omega_e_s, omega_e_s2;
    int order;   /* of the last of the swing */
    bool steady; /* no drop turns over in the step */
} start_t;

/* Into the rates of the state: that of a zero sequence is a current. */
INLINE pair_t of_state(const machine_t *m, shape_t shape, int p, pair_t flux)
{
    return p < shape.sets ? flux : flux * both(m->loose_gamma_1_H[2 * shape.sets]);
}

INLINE void no_drops(shape_t shape, tied_t *t)
{
    t->turning = false;
    for (int p = 0; p < pairs(shape); p++) {
        t->switch_V[p] = both(0.0);
    }
}

/* bridge_switch_share() of each leg, and whether one that switches is within the zone */
INLINE bool switch_share(const trio_t *zone, const trio_t *switched, trio_t *share)
{
    const trio_t one = {1.0, 1.0, 1.0, 1.0}, minus = -one;
    trio_mask_t above = *zone > one, below = *zone < minus;
    trio_mask_t within = (*zone > minus) & (*zone < one) & (*switched != 0.0);
    trio_t x;
    trio_pick(&above, &one, zone, &x);
    trio_pick(&below, &minus, &x, &x);
    *share = x * (1.5 - 0.5 * x * x);
    return trio_any(&within);
}

/* Drops of closed switches, which have one */
INLINE void find_drops(const circuit_t *c, const field_t *f, shape_t shape, tied_t *t)
{
    const bridge_t *b = &c->bridge;
    const winding_t *w = &c->machine.winding;
    no_drops(shape, t);
    for (int g = 0; g < groups(shape); g++) {
        trio_t switched;
        legs_at(b->inv_zone_1_A, g, &switched);
        along_group(w, shape, g, f->i_A, &t->zones[g]);
        t->zones[g] *= switched;
        t->turning = switch_share(&t->zones[g], &switched, &t->share[g]) || t->turning;
        trio_t drop_V = b->v_switch_V * t->share[g];
        spread_group(w, shape, g, &drop_V, t->switch_V);
    }
}

/* Currents of swinging legs: out of their capacitances; v_V: across the resistors, or how that moves. */
INLINE void swing_rate(const bridge_t *b, const winding_t *w, shape_t shape, int g, const trio_t *swings,
                       const trio_t *i_leg_A, const pair_t v_V[], trio_t *rate_V_s)
{
    *rate_V_s = -*i_leg_A * b->inv_c_leg_1_F;
    if (b->g_winding_S > 0.0) {
        trio_t resistor_V;
        along_group(w, shape, g, v_V, &resistor_V);
        *rate_V_s -= b->g_winding_S * resistor_V * *swings * b->inv_c_leg_1_F;
    }
}

/* steady: drops of closed switches are known already. i_leg_A: of swinging legs. */
INLINE void tied_at(const circuit_t *c, const field_t *f, const double x[], shape_t shape,
                    const trio_t swings[], bool steady, tied_t *t, trio_t i_leg_A[])
{
    const bridge_t *b = &c->bridge;
    const winding_t *w = &c->machine.winding;
    pair_t i_dc_A = {0.0}, swing_V[PAIRS] = {{0.0}};
    if (!steady) {
        find_drops(c, f, shape, t);
    }
    for (int p = 0; p < pairs(shape); p++) {
        t->drop_V[p] = both(b->r_series_ohm) * f->i_A[p] - pair_at(&b->diode_V[2 * p]) + t->switch_V[p];
        i_dc_A += weights(shape, p) * pair_at(&b->rail[2 * p]) * f->i_A[p];
    }
    for (int g = 0; swings && g < groups(shape); g++) {
        trio_t v_V = {0.0}, drop_V; /* gcc 12 sees terminals_at() set it in parts, and warns */
        along_group(w, shape, g, f->i_A, &i_leg_A[g]);
        i_leg_A[g] *= swings[g];
        terminals_at(x, g, &v_V);
        v_V *= swings[g];
        drop_V = -b->r_on_ohm * i_leg_A[g];
        spread_group(w, shape, g, &v_V, swing_V);
        spread_group(w, shape, g, &drop_V, t->drop_V);
    }
    for (int p = 0; p < pairs(shape); p++) {
        t->v_V[p] = pair_at(&b->rail[2 * p]) * both(x[V_DC]) + pair_at(&b->source_V[2 * p]) - t->drop_V[p];
        t->v_V[p] = swings ? t->v_V[p] + swing_V[p] : t->v_V[p];
    }
    t->i_dc_A = total(i_dc_A);
}

/* swings: which legs do, NULL: none; floats: legs of a star do, as in all that follows. */
INLINE void rates_at(const circuit_t *c, rotor_t rotor, const field_t *f, const double x[], shape_t shape,
                     const trio_t swings[], bool floats, bool steady, tied_t *t, rates_t *rate)
{
    const machine_t *m = &c->machine;
    const bridge_t *b = &c->bridge;
    double omega = x[OMEGA_MECH], v_dc = x[V_DC];
    double omega_e = m->pole_pairs * omega;
    const winding_t *w = &m->winding;
    pair_t in_W = {0.0}, copper = {0.0}, device_W = {0.0}, resistor_W = {0.0};
    trio_t i_leg_A[PLANT_SETS] = {{0.0}};
    tied_at(c, f, x, shape, swings, steady, t, i_leg_A);
    for (int p = 0; p < pairs(shape); p++) {
        pair_t power = weights(shape, p) * f->i_A[p];
        pair_t rest_V = t->v_V[p] - both(m->R_s_ohm) * f->i_A[p] - both(omega_e) * f->slope_Wb[p];
        rate->flux_V[p] = of_state(m, shape, p, rest_V);
        in_W = b->sources ? in_W + power * pair_at(&b->source_V[2 * p]) : in_W;
        copper += power * f->i_A[p];
        device_W += power * t->drop_V[p];
    }
    if (floats) {
        pair_t open_V = two_phase_open_V(c, rotor, omega_e, f, rate->flux_V[0]);
        rate->flux_V[0] += open_V;
        t->v_V[0] += open_V;
    }
    for (int p = 0; p < pairs(shape) && b->g_winding_S > 0.0; p++) {
        pair_t power = weights(shape, p) * both(b->g_winding_S) * t->v_V[p];
        in_W = b->sources ? in_W + power * pair_at(&b->source_V[2 * p]) : in_W;
        t->i_dc_A += total(power * pair_at(&b->rail[2 * p]));
        resistor_W += power * t->v_V[p];
        device_W += power * t->drop_V[p];
    }
    for (int g = 0; swings && g < groups(shape); g++) {
        swing_rate(b, w, shape, g, &swings[g], &i_leg_A[g], t->v_V, &rate->leg_V_s[g]);
    }
    rate->follow[MOTION] =
        (pair_t){mechanics_rate(&c->mech, omega, f->torque_Nm), dclink_plain_rate(&c->link, v_dc, t->i_dc_A)};
    rate->follow[POWER] = (pair_t){v_dc, f->torque_Nm} * (pair_t){t->i_dc_A, omega};
    if (b->sources) {
        rate->follow[POWER][0] += total(in_W);
    }
    rate->follow[LOSS] = totals(copper, device_W) * (pair_t){m->R_s_ohm, 1.0};
    if (b->g_winding_S > 0.0) {
        rate->follow[LOSS][0] += total(resistor_W);
    }
    rate->follow[VOLTS] = t->v_V[0];
}

/* Drops of switches within the zone move with their currents. */
INLINE void turn_drops(const circuit_t *c, const pair_t i_A_s[], shape_t shape, const tied_t *t,
                       pair_t drop_V_s[])
{
    const bridge_t *b = &c->bridge;
    const winding_t *w = &c->machine.winding;
    for (int g = 0; g < groups(shape); g++) {
        trio_t moves_A_s, slope = {0.0};
        along_group(w, shape, g, i_A_s, &moves_A_s);
        for (int n = 0; n < 3; n++) {
            double x = t->zones[g][n];
            if (x > -1.0 && x < 1.0) {
                slope[n] = b->v_switch_V * 1.5 * (1.0 - x * x) * b->inv_zone_1_A[3 * g + n];
            }
        }
        slope *= moves_A_s;
        spread_group(w, shape, g, &slope, drop_V_s);
    }
}

/* How voltages of the legs move with the currents. */
INLINE void tied_bends(const circuit_t *c, const pair_t i_A_s[], shape_t shape, bool swings, start_t *s,
                       pair_t drop_V_s[], pair_t v_V_s[])
{
    const bridge_t *b = &c->bridge;
    const winding_t *w = &c->machine.winding;
    pair_t swing_V_s[PAIRS] = {{0.0}};
    trio_t moves_A_s[PLANT_SETS];
    for (int p = 0; p < pairs(shape); p++) {
        drop_V_s[p] = both(b->r_series_ohm) * i_A_s[p];
    }
    if (s->tied.turning) {
        turn_drops(c, i_A_s, shape, &s->tied, drop_V_s);
    }
    for (int g = 0; swings && g < groups(shape); g++) {
        trio_t drop_V;
        along_group(w, shape, g, i_A_s, &moves_A_s[g]);
        moves_A_s[g] *= s->swings[g];
        drop_V = -b->r_on_ohm * moves_A_s[g];
        spread_group(w, shape, g, &s->rate.leg_V_s[g], swing_V_s);
        spread_group(w, shape, g, &drop_V, drop_V_s);
    }
    for (int p = 0; p < pairs(shape); p++) {
        v_V_s[p] = pair_at(&b->rail[2 * p]) * both(s->rate.follow[MOTION][1]) - drop_V_s[p];
        v_V_s[p] = swings ? v_V_s[p] + swing_V_s[p] : v_V_s[p];
    }
    for (int g = 0; swings && g < groups(shape); g++) {
        swing_rate(b, w, shape, g, &s->swings[g], &moves_A_s[g], v_V_s, &s->bend.leg_V_s[g]);
    }
}

/* Second derivatives of link and rotor, with those of torque and link current. */
INLINE void other_bends(const circuit_t *c, double torque_Nm_s, double i_dc_A_s, start_t *s)
{
    const double *x = c->now.x;
    double v_dc_s = s->rate.follow[MOTION][1], omega_s = s->rate.follow[MOTION][0];
    bool fed = c->link.connected && !(c->link.blocks && c->link.v_source_V < x[V_DC]);
    double bend_V = (-(fed ? c->link.g_source_S * v_dc_s : 0.0) - i_dc_A_s) * c->link.inv_C_1_F;
    double omega_s2 = mechanics_bend(&c->mech, x[OMEGA_MECH], omega_s, torque_Nm_s);
    s->omega_e_s = c->machine.pole_pairs * omega_s;
    s->omega_e_s2 = c->machine.pole_pairs * omega_s2;
    s->bend.follow[MOTION] = (pair_t){omega_s2, x[V_DC] > 0.0 ? bend_V : 0.0};
    s->bend.follow[POWER] = (pair_t){v_dc_s, torque_Nm_s} * (pair_t){s->tied.i_dc_A, x[OMEGA_MECH]} +
                            (pair_t){x[V_DC], c->field.torque_Nm} * (pair_t){i_dc_A_s, omega_s};
}

/* Second derivatives from those of the currents; without the part that floating legs add. */
INLINE void bends_at(const circuit_t *c, const pair_t i_A_s[], shape_t shape, bool swings, bool floats,
                     start_t *s)
{
    const field_t *f = &c->field;
    const machine_t *m = &c->machine;
    const bridge_t *b = &c->bridge;
    pair_t drop_V_s[PAIRS], v_V_s[PAIRS];
    pair_t i_dc_A_s = {0.0}, source_W_s = {0.0}, copper = {0.0}, device_W_s = {0.0}, harmonic = {0.0};
    pair_t resistor_W_s = {0.0};
    double omega_e = s->omega_e, omega_e_s = m->pole_pairs * s->rate.follow[MOTION][0];
    double product = 0.0;
    tied_bends(c, i_A_s, shape, swings, s, drop_V_s, v_V_s);
    for (int p = 0; p < pairs(shape); p++) {
        pair_t i = weights(shape, p) * f->i_A[p], moves = weights(shape, p) * i_A_s[p];
        pair_t turning = both(omega_e) * f->bend_Wb[p];
        s->bend.flux_V[p] = of_state(m, shape, p,
                                     v_V_s[p] - both(m->R_s_ohm) * i_A_s[p] -
                                         both(omega_e_s) * f->slope_Wb[p] - both(omega_e) * turning);
        i_dc_A_s += pair_at(&b->rail[2 * p]) * moves;
        source_W_s = b->sources ? source_W_s + pair_at(&b->source_V[2 * p]) * moves : source_W_s;
        copper += i * i_A_s[p];
        device_W_s += i * drop_V_s[p] + moves * s->tied.drop_V[p];
        harmonic += moves * f->slope_Wb[p] + i * turning;
        if (b->g_winding_S > 0.0) {
            pair_t power = weights(shape, p) * both(b->g_winding_S);
            i_dc_A_s += power * v_V_s[p] * pair_at(&b->rail[2 * p]);
            source_W_s =
                b->sources ? source_W_s + power * v_V_s[p] * pair_at(&b->source_V[2 * p]) : source_W_s;
            resistor_W_s += both(2.0) * power * s->tied.v_V[p] * v_V_s[p];
            device_W_s += power * (v_V_s[p] * s->tied.drop_V[p] + s->tied.v_V[p] * drop_V_s[p]);
        }
    }
    for (int set = 0; set < shape.sets; set++) {
        product += cross(s->rate.flux_V[set], f->i_A[set]) + cross(f->flux[set], i_A_s[set]);
    }
    other_bends(c, m->torque_gain * product + m->pole_pairs * total(harmonic), total(i_dc_A_s), s);
    if (b->sources) {
        s->bend.follow[POWER][0] += total(source_W_s);
    }
    s->bend.follow[LOSS] = totals(copper, device_W_s) * (pair_t){2.0 * m->R_s_ohm, 1.0};
    if (b->g_winding_S > 0.0) {
        s->bend.follow[LOSS][0] += total(resistor_W_s);
    }
    s->bend.follow[VOLTS] = v_V_s[0];
    if (floats) {
        s->bend.flux_V[0] = two_phase_part(c, s->bend.flux_V[0]);
        s->slope_Wb = f->slope_Wb[0];
        s->bend_Wb = f->bend_Wb[0];
    }
}

INLINE void begin(const circuit_t *c, shape_t shape, bool swings, bool floats, start_t *s)
{
    for (int p = 0; p < pairs(shape); p++) {
        s->flux[p] = c->field.flux[p];
    }
    for (int set = 0; set < shape.sets && shape.sets > 1; set++) {
        s->core_Wb[set] = c->field.core_Wb[set];
    }
    s->omega_e = c->machine.pole_pairs * c->now.x[OMEGA_MECH];
    no_drops(shape, &s->tied);
    if (swings) {
        find_swinging(&c->bridge, shape, s->swings);
    }
    rates_at(c, c->now.rotor, &c->field, c->now.x, shape, swings ? s->swings : NULL, floats,
             c->bridge.v_switch_V == 0.0, &s->tied, &s->rate);
    field_rates(&c->machine, c->now.rotor, s->omega_e, shape, &c->field, s->rate.flux_V, s->core_V, s->i_A_s);
    bends_at(c, s->i_A_s, shape, swings, floats, s);
    s->order = 0;
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

#endif
