/* A symmetrical star of which legs float, in closed form: two phases in series, or no current at all.
 *
 * One leg floats, with axis n. Its current n . i is none, so that one linkage is left, that along the tied
 * phases:
 *
 *   d psi_t/dt = v_t - R i_t - omega psi_x',t
 *
 * It does not depend on the voltage e of the floating terminal. The linkage along n is the one that makes
 * n . i(psi, theta) zero (field_release()): one division of a linear machine, one or two rounds of Newton's
 * method of a saturating one. e follows from n . di/dt = 0 with the tangent of the field:
 *
 *   e = -3/2 (n . di/dt without e) / (n . gamma n)
 *
 * Two or three legs float. Then psi is the magnet's, and the terminals show its rate. Where no leg is tied
 * the highest and the lowest lie evenly between the rails.
 *
 * A step integrates psi_t like any other linkage, to third order. The mean voltage across that is what the
 * linkage there has moved by, as no current flows.
 * Tests: two_phase_test.cpp, against floating.h and tests/reference. */
#ifndef PLANT_TWO_PHASE_H
#define PLANT_TWO_PHASE_H

#include "sim_plant/circuit_rates.h"
#include "sim_plant/field.h"

INLINE bool two_phase_idle(const circuit_t *c)
{
    return (c->bridge.floating & (c->bridge.floating - 1u)) != 0u;
}

INLINE pair_t two_phase_axis(const circuit_t *c, int k)
{
    return pair_at(c->machine.winding.axis[k]);
}

/* What is known of a vector: along the tied phases alone */
INLINE pair_t two_phase_part(const circuit_t *c, pair_t x)
{
    pair_t n = two_phase_axis(c, bridge_first(c->bridge.floating));
    return two_phase_idle(c) ? both(0.0) : x - n * both(total(n * x));
}

/* What floating terminals add to voltages; flux_V: rates of the linkages without it. */
INLINE pair_t two_phase_open_V(const circuit_t *c, rotor_t rotor, double omega_e, const field_t *f,
                               pair_t flux_V)
{
    pair_t n = two_phase_axis(c, bridge_first(c->bridge.floating));
    if (two_phase_idle(c)) {
        return both(omega_e) * across(f->flux[0]) - flux_V;
    }
    pair_t across_n = to_rotor(n, rotor);
    pair_t core_V = to_rotor(flux_V - both(omega_e) * across(f->flux[0]), rotor);
    pair_t i_A_s = by_columns(f->gamma_1_H[0], core_V) + both(omega_e) * across(f->i_dq_A[0]);
    return n * both(-total(across_n * i_A_s) / total(across_n * by_columns(f->gamma_1_H[0], across_n)));
}

/* Voltages of the terminals above their mean, from those of the active coordinates. */
INLINE double two_phase_above_V(const circuit_t *c, int k, pair_t v_V)
{
    return total(two_phase_axis(c, k) * v_V);
}

/* Mean of the terminals: where a leg is tied, by its voltage. */
INLINE double two_phase_mean_V(const circuit_t *c, const double i_A[], double v_dc_V, pair_t v_V)
{
    unsigned tied = 7u & ~c->bridge.floating;
    double highest_V = 0.0, lowest_V = 0.0;
    if (tied != 0u) {
        int k = bridge_first(tied);
        double i_leg_A = total(two_phase_axis(c, k) * pair_at(i_A));
        return bridge_tied_V(&c->bridge, k, i_leg_A, v_dc_V) - two_phase_above_V(c, k, v_V);
    }
    for (int k = 0; k < 3; k++) {
        double above_V = two_phase_above_V(c, k, v_V);
        highest_V = above_V > highest_V ? above_V : highest_V;
        lowest_V = above_V < lowest_V ? above_V : lowest_V;
    }
    return 0.5 * (v_dc_V - highest_V - lowest_V);
}

/* The field without current in the floating legs. */
INLINE void two_phase_release(const circuit_t *c, rotor_t rotor, field_t *f)
{
    if (two_phase_idle(c)) {
        field_idle(&c->machine, rotor, f);
    } else {
        field_release(&c->machine, rotor, two_phase_axis(c, bridge_first(c->bridge.floating)), f);
    }
}

#endif
