/* Terminals that swing with their windings: their Taylor series, and how far a step may follow it; for symmetrical.c.
 *
 * From the third on a derivative follows from the one before, as those of a circuit whose inductances stand still:
 *   i(n)       = G psi(n)
 *   v_leg(n+1) = -(i_leg(n) + g_winding v_winding(n)) / c_leg
 *   psi(n+1)   = v_winding(n) - R i(n) */
#ifndef PLANT_SYMMETRICAL_SWING_H
#define PLANT_SYMMETRICAL_SWING_H

#include "sim_plant/steps.h"
#include "sim_plant/symmetrical_rates.h"

#include <math.h>

/* Second derivatives of the currents, while inductances and speed stand still in rotor coordinates:
 *   i'' = G (psi'' - 2 j omega psi' - omega^2 psi) + 2 j omega i' + omega^2 i,   G in stationary coordinates */
INLINE void current_bends(const circuit_t *c, shape_t shape, const start_t *s, pair_t i_A_s2[])
{
    pair_t turned[PAIRS], core[PLANT_SETS];
    const double omega = s->omega_e, square = omega * omega;
    for (int p = 0; p < pairs(shape); p++) {
        turned[p] = s->bend.flux_V[p];
        if (p < shape.sets) {
            turned[p] -= both(2.0 * omega) * across(s->rate.flux_V[p]) + both(square) * s->flux[p];
        }
    }
    field_rates(&c->machine, c->now.rotor, 0.0, shape, &c->field, turned, core, i_A_s2);
    for (int set = 0; set < shape.sets; set++) {
        i_A_s2[set] += both(2.0 * omega) * across(s->i_A_s[set]) + both(square) * c->field.i_A[set];
    }
}

/* The derivative after from, whose currents move like that: other voltages stand still. */
INLINE void swing_next(const circuit_t *c, shape_t shape, const trio_t swings[], const swing_t *from,
                       const pair_t i_A[], swing_t *to)
{
    const machine_t *m = &c->machine;
    const winding_t *w = &m->winding;
    const bridge_t *b = &c->bridge;
    pair_t v_V[PAIRS];
    trio_t leg_A[PLANT_SETS];
    for (int p = 0; p < pairs(shape); p++) {
        v_V[p] = both(-b->r_series_ohm) * i_A[p];
    }
    for (int g = 0; g < groups(shape); g++) {
        along_group(w, shape, g, i_A, &leg_A[g]);
        leg_A[g] *= swings[g];
        trio_t leg_V = from->leg[g] + b->r_on_ohm * leg_A[g];
        spread_group(w, shape, g, &leg_V, v_V);
    }
    for (int g = 0; g < groups(shape); g++) {
        swing_rate(b, w, shape, g, &swings[g], &leg_A[g], v_V, &to->leg[g]);
    }
    for (int p = 0; p < pairs(shape); p++) {
        to->flux[p] = of_state(m, shape, p, v_V[p] - both(m->R_s_ohm) * i_A[p]);
    }
    to->volts = v_V[0];
}

/* One order of the series, of the rates that are known of it. */
INLINE void swing_known(shape_t shape, const rates_t *rate, swing_t *to)
{
    for (int p = 0; p < pairs(shape); p++) {
        to->flux[p] = rate->flux_V[p];
    }
    for (int g = 0; g < groups(shape); g++) {
        to->leg[g] = rate->leg_V_s[g];
    }
    to->volts = rate->follow[VOLTS];
}

/* The series as far as that order, from the rates that are known. */
INLINE void swing_series(const circuit_t *c, shape_t shape, start_t *s, int order)
{
    pair_t core[PLANT_SETS], i_A[PAIRS];
    if (s->order == 0) {
        swing_known(shape, &s->rate, &s->swing[1]);
        swing_known(shape, &s->bend, &s->swing[2]);
        current_bends(c, shape, s, i_A);
        swing_next(c, shape, s->swings, &s->swing[2], i_A, &s->swing[3]);
        s->order = 3;
    }
    for (; s->order < order; s->order++) {
        const swing_t *last = &s->swing[s->order];
        field_rates(&c->machine, c->now.rotor, 0.0, shape, &c->field, last->flux, core, i_A);
        swing_next(c, shape, s->swings, last, i_A, &s->swing[s->order + 1]);
    }
}

/* 1 / n */
static const double swing_part[SWING_ORDER + 1] = {0.0,     1.0,     1.0 / 2, 1.0 / 3, 1.0 / 4,
                                                   1.0 / 5, 1.0 / 6, 1.0 / 7, 1.0 / 8, 1.0 / 9};

/* By how much a series of swinging terminals and their windings has moved after h, and its rates there. */
INLINE void swing_at(const start_t *s, double h, shape_t shape, swing_t *moved, swing_t *rate)
{
    const swing_t *last = &s->swing[s->order];
    moved->volts = rate->volts = last->volts;
    for (int p = 0; p < pairs(shape); p++) {
        moved->flux[p] = rate->flux[p] = last->flux[p];
    }
    for (int g = 0; g < groups(shape); g++) {
        moved->leg[g] = rate->leg[g] = last->leg[g];
    }
    double after = h * swing_part[s->order];
    for (int n = s->order - 1; n >= 1; n--) {
        const swing_t *of = &s->swing[n];
        double next = h * swing_part[n];
        for (int p = 0; p < pairs(shape); p++) {
            rate->flux[p] = of->flux[p] + both(next) * rate->flux[p];
            moved->flux[p] = of->flux[p] + both(after) * moved->flux[p];
        }
        for (int g = 0; g < groups(shape); g++) {
            rate->leg[g] = of->leg[g] + next * rate->leg[g];
            moved->leg[g] = of->leg[g] + after * moved->leg[g];
        }
        rate->volts = of->volts + both(next) * rate->volts;
        moved->volts = of->volts + both(after) * moved->volts;
        after = next;
    }
}

INLINE double leg_of(const swing_t *swing, shape_t shape, int k)
{
    return shape.legs > 3 && k >= 3 ? swing->leg[1][k - 3] : swing->leg[0][k];
}

/* How far the series of terminal k is beyond the end ahead of it after t, and how fast it gets there. */
typedef struct {
    double sign, end_V, drift_V_s;
} ahead_t;

INLINE double beyond_V(const circuit_t *c, const start_t *s, shape_t shape, int k, const ahead_t *ahead,
                       double t, double *speed)
{
    double moved = leg_of(&s->swing[s->order], shape, k), rate = moved;
    double after = t * swing_part[s->order];
    for (int n = s->order - 1; n >= 1; n--) {
        double of = leg_of(&s->swing[n], shape, k), next = t * swing_part[n];
        rate = of + next * rate;
        moved = of + after * moved;
        after = next;
    }
    *speed = ahead->sign * (rate - ahead->drift_V_s);
    return ahead->sign * (c->now.x[V_LEG(k)] - ahead->end_V + t * (moved - ahead->drift_V_s));
}

/* Where it turns back within h */
INLINE double peak_s(const circuit_t *c, const start_t *s, shape_t shape, int k, const ahead_t *ahead,
                     double h)
{
    double early = 0.0, late = h, speed;
    for (int round = 0; round < 12; round++) {
        double t = 0.5 * (early + late);
        beyond_V(c, s, shape, k, ahead, t, &speed);
        *(speed > 0.0 ? &early : &late) = t;
    }
    return late;
}

/* Until a swinging terminal arrives at its diode; h if not before. A step is a part of a swing, in which the speed
 * hardly exceeds those at its ends. */
INLINE double arrival_s(const circuit_t *c, const start_t *s, shape_t shape, int k, double h)
{
    double rate = leg_of(&s->swing[1], shape, k);
    bool up = rate > 0.0;
    ahead_t ahead = {.sign = up ? 1.0 : -1.0,
                     .end_V = up ? c->now.x[V_DC] + c->bridge.v_diode_V : -c->bridge.v_diode_V,
                     .drift_V_s = up ? s->rate.follow[MOTION][1] : 0.0};
    double speed;
    double start_V = ahead.sign * (c->now.x[V_LEG(k)] - ahead.end_V);
    double end_V = beyond_V(c, s, shape, k, &ahead, h, &speed);
    if (start_V >= 0.0 || (end_V <= 0.0 && start_V + 1.2 * h * larger(fabs(rate), fabs(speed)) <= 0.0)) {
        return h;
    }
    double early = 0.0, late = h;
    if (end_V <= 0.0) {
        late = speed < 0.0 ? peak_s(c, s, shape, k, &ahead, h) : h;
        if (beyond_V(c, s, shape, k, &ahead, late, &speed) <= 0.0) {
            return h;
        }
    }
    double t = -start_V / fabs(rate), close_V = 0.01 * SNAP * c->now.x[V_DC];
    t = t < late ? t : late;
    for (int round = 0; round < 20; round++) {
        double at_V = beyond_V(c, s, shape, k, &ahead, t, &speed);
        if (fabs(at_V) < close_V) {
            break;
        }
        *(at_V > 0.0 ? &late : &early) = t;
        t -= at_V / speed;
        t = t > early && t < late ? t : 0.5 * (early + late);
    }
    return t;
}

/* The next derivative after a series of swinging terminals, V, as far as their swing of omega makes it. */
INLINE double swing_ahead(const circuit_t *c, const start_t *s, shape_t shape, double omega)
{
    double damping = c->bridge.g_winding_S * c->bridge.inv_c_leg_1_F;
    double next = 0.0;
    for (unsigned legs = c->bridge.swinging; legs != 0u; legs &= legs - 1u) {
        int k = bridge_first(legs);
        double before = fabs(leg_of(&s->swing[s->order - 1], shape, k)),
               last = fabs(leg_of(&s->swing[s->order], shape, k));
        next = larger(next, omega * omega * before + (omega + damping) * last);
    }
    return next;
}

INLINE double first_arrival_s(const circuit_t *c, const start_t *s, shape_t shape, double h)
{
    for (unsigned legs = c->bridge.swinging; legs != 0u; legs &= legs - 1u) {
        h = arrival_s(c, s, shape, bridge_first(legs), h);
    }
    return h;
}

/* What swinging terminals allow. The series is as long as the step needs it. */
INLINE double swing_s(const circuit_t *c, start_t *s, shape_t shape, double h)
{
    const double left_V = 0.1 / (c->inv_v_scale_1_V * c->inv_tolerance); /* d is 2.5 times what is missed */
    const double omega = sqrt(c->machine.gamma_leg_1_H * c->bridge.inv_c_leg_1_F);
    const double soon_s = 0.1 / omega;
    swing_series(c, shape, s, SWING_BRIEF);
    double brief = first_arrival_s(c, s, shape, h < soon_s ? h : soon_s), square = brief * brief;
    if (brief < soon_s &&
        brief * square * square * swing_ahead(c, s, shape, omega) <= SWING_BRIEF_NEXT * left_V) {
        return brief;
    }
    swing_series(c, shape, s, SWING_ORDER);
    double longest = pow(SWING_FACTORIAL * left_V / swing_ahead(c, s, shape, omega), 1.0 / (SWING_ORDER + 1));
    return first_arrival_s(c, s, shape, longest < h ? longest : h);
}

#endif
