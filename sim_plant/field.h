/* Currents of a symmetrical machine from its flux linkages, and their rates.
 *
 * Symmetrical (machine.h): the energy form, all phases alike, mutual inductance between two sets at most, and
 * any harmonics of the magnet. Then the linkage of a set, without the harmonics, is in rotor coordinates
 *
 *   psi_s    = core_s + M i(core_of_the_other_set),   M = diag(M_d, M_q)
 *   dpsi/dt  = v - R i - omega psi_x'
 *
 * whatever the saturation: psi_s is the state, and core and currents follow from it. One set has psi = core;
 * of two, Newton's method from a guess by the last rates gives core to 1e-11 in one or two rounds. An open
 * winding adds its zero sequence, which is coupled to no other.
 *
 * Quantities of a set, alpha and beta or d and q, are one vector of two for the processor. For a zero
 * sequence the second element is unused.
 *
 * Inline, for a caller that knows the shape of the windings. Tests: plant_test.cpp, against the general way.
 * */
#ifndef PLANT_FIELD_H
#define PLANT_FIELD_H

#include "sim_plant/machine_rates.h"

#include <math.h>
#include <string.h>

/* The common shapes, for which functions are compiled with constants. */
#define STAR   ((shape_t){2, 1, 3})
#define OPEN   ((shape_t){3, 1, 6})
#define DOUBLE ((shape_t){4, 2, 6})

#define PAIRS        2
#define FIELD_ROUNDS 20
#define FIELD_NEAR   3e-5 /* of the machine's flux: a correction whose square is nothing */

typedef double pair_t __attribute__((vector_size(16)));

typedef struct {
    pair_t flux[PAIRS]; /* linkages by set in stationary coordinates, Wb; of a zero sequence its current, A */
    pair_t i_A[PAIRS];
    pair_t slope_Wb[PAIRS], bend_Wb[PAIRS]; /* of the magnet's harmonics: by the angle, once and twice */
    pair_t core_Wb[PLANT_SETS], i_dq_A[PLANT_SETS];
    pair_t gamma_1_H[PLANT_SETS][2]; /* columns of the tangent */
    pair_t split[2];                 /* of two sets: inverse of 1 - M gamma M gamma, by columns */
    double torque_Nm;
} field_t;

INLINE int pairs(shape_t shape)
{
    return (shape.active + 1) / 2;
}

INLINE pair_t both(double x)
{
    return (pair_t){x, x};
}

INLINE pair_t pair_at(const double x[])
{
    pair_t pair;
    memcpy(&pair, x, sizeof pair);
    return pair;
}

INLINE void pair_put(double x[], pair_t pair)
{
    memcpy(x, &pair, sizeof pair);
}

INLINE double total(pair_t x)
{
    return x[0] + x[1];
}

INLINE pair_t totals(pair_t x, pair_t y)
{
    return (pair_t){x[0], y[0]} + (pair_t){x[1], y[1]};
}

/* x[0] y[1] - x[1] y[0] */
INLINE double cross(pair_t x, pair_t y)
{
    pair_t products = x * (pair_t){y[1], y[0]};
    return products[0] - products[1];
}

/* Turned by a right angle */
INLINE pair_t across(pair_t x)
{
    return (pair_t){-x[1], x[0]};
}

INLINE pair_t to_rotor(pair_t x, rotor_t r)
{
    return x * both(r.c) + (pair_t){x[1], x[0]} * (pair_t){r.s, -r.s};
}

INLINE pair_t from_rotor(pair_t x, rotor_t r)
{
    return x * both(r.c) + (pair_t){x[1], x[0]} * (pair_t){-r.s, r.s};
}

INLINE pair_t by_columns(const pair_t columns[2], pair_t x)
{
    return columns[0] * both(x[0]) + columns[1] * both(x[1]);
}

INLINE pair_t field_mutual(const machine_t *m)
{
    return (pair_t){m->winding.M_d_H, m->winding.M_q_H};
}

/* Changes of the cores that make up those of the linkages. */
INLINE void field_cores(const machine_t *m, const field_t *f, shape_t shape, const pair_t psi[],
                        pair_t core[])
{
    core[0] = psi[0];
    if (shape.sets > 1) {
        pair_t M = field_mutual(m);
        core[0] = by_columns(f->split, psi[0] - M * by_columns(f->gamma_1_H[1], psi[1]));
        core[1] = psi[1] - M * by_columns(f->gamma_1_H[0], core[0]);
    }
}

INLINE void field_split(const machine_t *m, field_t *f)
{
    pair_t M = field_mutual(m);
    pair_t other[2] = {M * f->gamma_1_H[1][0], M * f->gamma_1_H[1][1]};
    pair_t first = by_columns(other, M * f->gamma_1_H[0][0]);
    pair_t second = by_columns(other, M * f->gamma_1_H[0][1]);
    first = (pair_t){1.0, 0.0} - first;
    second = (pair_t){0.0, 1.0} - second;
    pair_t inv = both(1.0 / cross(first, second));
    f->split[0] = (pair_t){second[1], -first[1]} * inv;
    f->split[1] = (pair_t){-second[0], first[0]} * inv;
}

/* machine_current_A() and its tangent */
INLINE pair_t core_current(const machine_t *m, pair_t psi)
{
    double psi2 = total(psi * psi);
    pair_t gamma = {m->gamma_d_1_H, m->gamma_q_1_H};
    return psi * (gamma + both(m->c_A_Wb5 * psi2 * psi2)) - (pair_t){m->i_f_A, 0.0};
}

INLINE void core_tangent(const machine_t *m, pair_t psi, pair_t gamma[2])
{
    double psi2 = total(psi * psi);
    double c_psi2 = m->c_A_Wb5 * psi2;
    double sat = c_psi2 * psi2;
    pair_t steep = psi * both(4.0 * c_psi2);
    gamma[0] = steep * both(psi[0]) + (pair_t){m->gamma_d_1_H + sat, 0.0};
    gamma[1] = steep * both(psi[1]) + (pair_t){0.0, m->gamma_q_1_H + sat};
}

/* Cores of two linked sets; on entry a guess. */
INLINE void field_solve(const machine_t *m, const pair_t psi[], field_t *f)
{
    pair_t M = field_mutual(m);
    double near_Wb = FIELD_NEAR * m->scale_Wb;
    double miss_Wb = 2.0 * near_Wb;
    for (int round = 0; round < FIELD_ROUNDS && miss_Wb > near_Wb; round++) {
        pair_t miss[PLANT_SETS], move[PLANT_SETS];
        for (int set = 0; set < PLANT_SETS; set++) {
            miss[set] = psi[set] - f->core_Wb[set] - M * core_current(m, f->core_Wb[1 - set]);
            core_tangent(m, f->core_Wb[set], f->gamma_1_H[set]);
        }
        field_split(m, f);
        field_cores(m, f, DOUBLE, miss, move);
        miss_Wb = 0.0;
        for (int set = 0; set < PLANT_SETS; set++) {
            f->core_Wb[set] += move[set];
            miss_Wb += fabs(move[set][0]) + fabs(move[set][1]);
        }
    }
}

INLINE void field_harmonics(const winding_t *w, rotor_t rotor, shape_t shape, field_t *f)
{
    pair_t slope_Wb[PAIRS] = {{0.0}}, bend_Wb[PAIRS] = {{0.0}};
    rotor_t turn = {1.0, 0.0};
    int order = 0;
    for (int t = 0; t < w->flux_series_terms; t++) {
        const flux_series_t *term = &w->flux_series[t];
        turn = winding_next(rotor, turn, &order, term->order);
        pair_t n = both(term->order), c = both(turn.c), s = both(turn.s);
        for (int p = 0; p < pairs(shape); p++) {
            pair_t cosine = n * pair_at(&term->cosine[2 * p]), sine = n * pair_at(&term->sine[2 * p]);
            slope_Wb[p] += sine * c - cosine * s;
            bend_Wb[p] -= n * (cosine * c + sine * s);
        }
    }
    for (int p = 0; p < pairs(shape); p++) {
        f->slope_Wb[p] = slope_Wb[p];
        f->bend_Wb[p] = bend_Wb[p];
    }
}

/* Amplitude-invariant coordinates weigh in a power; what a zero sequence lacks, nothing. */
INLINE pair_t weights(shape_t shape, int p)
{
    return p < shape.sets ? (pair_t){1.5, 1.5} : (pair_t){3.0, 0.0};
}

/* Terminal currents and torque from what is known of the sets. */
INLINE void field_finish(const machine_t *m, rotor_t rotor, shape_t shape, field_t *f)
{
    double product = 0.0;
    pair_t harmonic = {0.0};
    for (int set = 0; set < shape.sets; set++) {
        f->i_A[set] = from_rotor(f->i_dq_A[set], rotor);
        product += cross(f->flux[set], f->i_A[set]);
    }
    if (pairs(shape) > shape.sets) {
        f->i_A[shape.sets] = f->flux[shape.sets];
    }
    for (int p = 0; p < pairs(shape); p++) {
        harmonic += weights(shape, p) * f->i_A[p] * f->slope_Wb[p];
    }
    f->torque_Nm = m->torque_gain * product + m->pole_pairs * total(harmonic);
}

/* Everything from f->flux, and f->core_Wb as a guess. */
INLINE void field_at(const machine_t *m, rotor_t rotor, shape_t shape, field_t *f)
{
    pair_t psi[PLANT_SETS];
    for (int set = 0; set < shape.sets; set++) {
        psi[set] = to_rotor(f->flux[set], rotor);
    }
    if (shape.sets > 1) {
        field_solve(m, psi, f);
    } else {
        f->core_Wb[0] = psi[0];
        core_tangent(m, psi[0], f->gamma_1_H[0]);
    }
    for (int set = 0; set < shape.sets; set++) {
        f->i_dq_A[set] = core_current(m, f->core_Wb[set]);
    }
    field_harmonics(&m->winding, rotor, shape, f);
    field_finish(m, rotor, shape, f);
}

/* The same from the cores and the current of a zero sequence. */
INLINE void field_from_cores(const machine_t *m, rotor_t rotor, shape_t shape, const double core[],
                             double zero_A, field_t *f)
{
    for (int set = 0; set < shape.sets; set++) {
        f->core_Wb[set] = to_rotor(pair_at(&core[2 * set]), rotor);
        f->i_dq_A[set] = core_current(m, f->core_Wb[set]);
    }
    for (int set = 0; set < shape.sets; set++) {
        pair_t psi = f->core_Wb[set];
        f->flux[set] = from_rotor(shape.sets > 1 ? psi + field_mutual(m) * f->i_dq_A[1 - set] : psi, rotor);
    }
    if (pairs(shape) > shape.sets) {
        f->flux[shape.sets] = (pair_t){zero_A, 0.0};
    }
    field_at(m, rotor, shape, f);
}

/* After a small change of the linkages; its square is left out. */
INLINE void field_shift(const machine_t *m, rotor_t rotor, shape_t shape, const pair_t by[], field_t *f)
{
    pair_t psi[PLANT_SETS], core[PLANT_SETS];
    for (int set = 0; set < shape.sets; set++) {
        psi[set] = to_rotor(by[set], rotor);
    }
    field_cores(m, f, shape, psi, core);
    for (int set = 0; set < shape.sets; set++) {
        f->core_Wb[set] += core[set];
        f->i_dq_A[set] += by_columns(f->gamma_1_H[set], core[set]);
    }
    for (int p = 0; p < pairs(shape); p++) {
        f->flux[p] += by[p];
    }
    field_finish(m, rotor, shape, f);
}

/* Of a star without current: the magnet alone. */
INLINE void field_idle(const machine_t *m, rotor_t rotor, field_t *f)
{
    f->flux[0] = both(m->psi_m_Wb) * (pair_t){rotor.c, rotor.s};
    f->core_Wb[0] = to_rotor(f->flux[0], rotor);
    f->i_dq_A[0] = both(0.0);
    core_tangent(m, f->core_Wb[0], f->gamma_1_H[0]);
    field_finish(m, rotor, STAR, f);
}

/* Of a star: moves the linkage along an axis until no current flows along it. */
INLINE void field_release(const machine_t *m, rotor_t rotor, pair_t axis, field_t *f)
{
    pair_t n = to_rotor(axis, rotor);
    double near_Wb = FIELD_NEAR * m->scale_Wb;
    bool near = false;
    for (int round = 0; round < FIELD_ROUNDS && !near; round++) {
        pair_t response = by_columns(f->gamma_1_H[0], n);
        double move_Wb = -total(n * f->i_dq_A[0]) / total(n * response);
        near = fabs(move_Wb) <= near_Wb || m->c_A_Wb5 == 0.0;
        f->core_Wb[0] += both(move_Wb) * n;
        f->flux[0] += both(move_Wb) * axis;
        if (near) {
            f->i_dq_A[0] += both(move_Wb) * response;
        } else {
            f->i_dq_A[0] = core_current(m, f->core_Wb[0]);
            core_tangent(m, f->core_Wb[0], f->gamma_1_H[0]);
        }
    }
    field_finish(m, rotor, STAR, f);
}

/* Rates of the cores in rotor coordinates and of the currents, with given ones of f->flux. */
INLINE void field_rates(const machine_t *m, rotor_t rotor, double omega_e, shape_t shape, const field_t *f,
                        const pair_t rate[], pair_t core_V[], pair_t i_A_s[])
{
    pair_t psi[PLANT_SETS];
    for (int set = 0; set < shape.sets; set++) {
        psi[set] = to_rotor(rate[set] - both(omega_e) * across(f->flux[set]), rotor);
    }
    field_cores(m, f, shape, psi, core_V);
    for (int set = 0; set < shape.sets; set++) {
        i_A_s[set] = from_rotor(by_columns(f->gamma_1_H[set], core_V[set]), rotor) +
                     both(omega_e) * across(f->i_A[set]);
    }
    if (pairs(shape) > shape.sets) {
        i_A_s[shape.sets] = rate[shape.sets];
    }
}

#endif
