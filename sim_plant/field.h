/* Currents of a symmetrical machine from its flux linkages, and how they move.
 *
 * Symmetrical (machine.h): the energy form, all phases alike, mutual inductance between two sets at most, and
 * any harmonics of the magnet. Then the linkage of a set, without the harmonics, is in rotor coordinates
 *
 *   psi_s = core_s + M i(core_of_the_other_set),   M = diag(M_d, M_q)
 *
 * and its rate is v - R i - omega psi_x', whatever the saturation: it is the state, and core and currents
 * follow from it. One set has psi = core; of two, Newton's method from a guess by the last rates gives core
 * to 1e-11 in one or two rounds. An open winding adds its zero sequence, which nothing links to the others.
 *
 * Inline, for a caller that knows the shape of the windings. Tests: field_test.cpp. */
#ifndef PLANT_FIELD_H
#define PLANT_FIELD_H

#include "sim_plant/machine_rates.h"

#include <math.h>

/* The common shapes, for which functions are compiled with constants. */
#define STAR   ((shape_t){2, 1, 3})
#define OPEN   ((shape_t){3, 1, 6})
#define DOUBLE ((shape_t){4, 2, 6})

#define FIELD_ROUNDS 20
#define FIELD_NEAR   3e-5 /* of the magnet's flux: a correction whose square is nothing */

typedef struct {
    double
        flux[ACTIVE]; /* linkages by set in stationary coordinates, Wb; of a zero sequence its current, A */
    double i_A[ACTIVE];
    double slope_Wb[ACTIVE], bend_Wb[ACTIVE]; /* of the magnet's harmonics: by the angle, once and twice */
    dq_t core_Wb[PLANT_SETS], i_dq_A[PLANT_SETS];
    machine_tangent_t gamma_1_H[PLANT_SETS];
    double split[4]; /* of two sets: inverse of 1 - M gamma M gamma, by rows */
    double torque_Nm;
} field_t;

INLINE dq_t field_mutual(const machine_t *m, dq_t x)
{
    return (dq_t){m->winding.M_d_H * x.d, m->winding.M_q_H * x.q};
}

/* Changes of the cores that make up those of the linkages. */
INLINE void field_cores(const machine_t *m, const field_t *f, shape_t shape, const dq_t psi[], dq_t core[])
{
    core[0] = psi[0];
    if (shape.sets < 2) {
        return;
    }
    dq_t other = field_mutual(m, times(f->gamma_1_H[1], psi[1]));
    dq_t rest = {psi[0].d - other.d, psi[0].q - other.q};
    core[0] =
        (dq_t){f->split[0] * rest.d + f->split[1] * rest.q, f->split[2] * rest.d + f->split[3] * rest.q};
    dq_t back = field_mutual(m, times(f->gamma_1_H[0], core[0]));
    core[1] = (dq_t){psi[1].d - back.d, psi[1].q - back.q};
}

INLINE void field_split(const machine_t *m, field_t *f)
{
    const machine_tangent_t *g = f->gamma_1_H;
    double d = m->winding.M_d_H, q = m->winding.M_q_H;
    double dd = 1.0 - d * (g[1].d * d * g[0].d + g[1].dq * q * g[0].dq);
    double dq = -d * (g[1].d * d * g[0].dq + g[1].dq * q * g[0].q);
    double qd = -q * (g[1].dq * d * g[0].d + g[1].q * q * g[0].dq);
    double qq = 1.0 - q * (g[1].dq * d * g[0].dq + g[1].q * q * g[0].q);
    double inv = 1.0 / (dd * qq - dq * qd);
    f->split[0] = qq * inv;
    f->split[1] = -dq * inv;
    f->split[2] = -qd * inv;
    f->split[3] = dd * inv;
}

/* Cores of two linked sets; on entry a guess. */
INLINE void field_solve(const machine_t *m, const dq_t psi[], field_t *f)
{
    double near_Wb = FIELD_NEAR * m->scale_Wb;
    double miss_Wb = 2.0 * near_Wb;
    for (int round = 0; round < FIELD_ROUNDS && miss_Wb > near_Wb; round++) {
        dq_t miss[PLANT_SETS], move[PLANT_SETS];
        for (int set = 0; set < 2; set++) {
            f->i_dq_A[set] = machine_current_A(m, f->core_Wb[set]);
            f->gamma_1_H[set] = machine_tangent_1_H(m, f->core_Wb[set]);
        }
        for (int set = 0; set < 2; set++) {
            dq_t other = field_mutual(m, f->i_dq_A[1 - set]);
            miss[set] =
                (dq_t){psi[set].d - f->core_Wb[set].d - other.d, psi[set].q - f->core_Wb[set].q - other.q};
        }
        field_split(m, f);
        field_cores(m, f, DOUBLE, miss, move);
        miss_Wb = 0.0;
        for (int set = 0; set < 2; set++) {
            f->core_Wb[set].d += move[set].d;
            f->core_Wb[set].q += move[set].q;
            miss_Wb += fabs(move[set].d) + fabs(move[set].q);
        }
    }
    for (int set = 0; set < 2; set++) {
        f->i_dq_A[set] = machine_current_A(m, f->core_Wb[set]);
    }
}

INLINE void field_harmonics(const winding_t *w, rotor_t rotor, shape_t shape, field_t *f)
{
    double slope_Wb[ACTIVE] = {0.0}, bend_Wb[ACTIVE] = {0.0};
    rotor_t turn = {1.0, 0.0};
    int order = 0;
    for (int t = 0; t < w->flux_series_terms; t++) {
        const flux_series_t *term = &w->flux_series[t];
        turn = winding_next(rotor, turn, &order, term->order);
        double n = term->order, nc = n * turn.c, ns = n * turn.s;
        double n2c = n * nc, n2s = n * ns;
        for (int a = 0; a < shape.active; a++) {
            slope_Wb[a] += nc * term->sine[a] - ns * term->cosine[a];
            bend_Wb[a] -= n2c * term->cosine[a] + n2s * term->sine[a];
        }
    }
    for (int a = 0; a < shape.active; a++) {
        f->slope_Wb[a] = slope_Wb[a];
        f->bend_Wb[a] = bend_Wb[a];
    }
}

/* Terminal currents and torque from what is known of the sets. */
INLINE void field_finish(const machine_t *m, rotor_t rotor, shape_t shape, field_t *f)
{
    const winding_t *w = &m->winding;
    double cross = 0.0, harmonic = 0.0;
    for (int set = 0; set < shape.sets; set++) {
        ab_t i = frame_to_ab(f->i_dq_A[set], rotor);
        f->i_A[2 * set] = i.alpha;
        f->i_A[2 * set + 1] = i.beta;
        cross += f->flux[2 * set] * i.beta - f->flux[2 * set + 1] * i.alpha;
    }
    if (shape.active > 2 * shape.sets) {
        f->i_A[2 * shape.sets] = f->flux[2 * shape.sets];
    }
    for (int a = 0; a < shape.active && w->flux_series_terms > 0; a++) {
        harmonic += w->weight[a] * f->i_A[a] * f->slope_Wb[a];
    }
    f->torque_Nm = m->torque_gain * cross + m->pole_pairs * harmonic;
}

/* Everything from f->flux, and f->core_Wb as a guess. */
INLINE void field_at(const machine_t *m, rotor_t rotor, shape_t shape, field_t *f)
{
    dq_t psi[PLANT_SETS];
    for (int set = 0; set < shape.sets; set++) {
        psi[set] = frame_to_dq(of_set(f->flux, set), rotor);
    }
    if (shape.sets < 2) {
        f->core_Wb[0] = psi[0];
        f->i_dq_A[0] = machine_current_A(m, psi[0]);
        f->gamma_1_H[0] = machine_tangent_1_H(m, psi[0]);
    } else {
        field_solve(m, psi, f);
    }
    field_harmonics(&m->winding, rotor, shape, f);
    field_finish(m, rotor, shape, f);
}

/* The same from the cores. */
INLINE void field_from_cores(const machine_t *m, rotor_t rotor, shape_t shape, const double core[],
                             double zero_A, field_t *f)
{
    for (int set = 0; set < shape.sets; set++) {
        f->core_Wb[set] = frame_to_dq(of_set(core, set), rotor);
        f->i_dq_A[set] = machine_current_A(m, f->core_Wb[set]);
    }
    for (int set = 0; set < shape.sets; set++) {
        dq_t psi = f->core_Wb[set];
        if (shape.sets > 1) {
            dq_t other = field_mutual(m, f->i_dq_A[1 - set]);
            psi.d += other.d;
            psi.q += other.q;
        }
        ab_t flux = frame_to_ab(psi, rotor);
        f->flux[2 * set] = flux.alpha;
        f->flux[2 * set + 1] = flux.beta;
    }
    if (shape.active > 2 * shape.sets) {
        f->flux[2 * shape.sets] = zero_A;
    }
    field_at(m, rotor, shape, f);
}

/* After a small change of the linkages; its square is left out. */
INLINE void field_shift(const machine_t *m, rotor_t rotor, shape_t shape, const double by[], field_t *f)
{
    dq_t psi[PLANT_SETS], core[PLANT_SETS];
    for (int set = 0; set < shape.sets; set++) {
        psi[set] = frame_to_dq(of_set(by, set), rotor);
    }
    field_cores(m, f, shape, psi, core);
    for (int set = 0; set < shape.sets; set++) {
        dq_t i = times(f->gamma_1_H[set], core[set]);
        f->core_Wb[set].d += core[set].d;
        f->core_Wb[set].q += core[set].q;
        f->i_dq_A[set].d += i.d;
        f->i_dq_A[set].q += i.q;
    }
    for (int a = 0; a < shape.active; a++) {
        f->flux[a] += by[a];
    }
    field_finish(m, rotor, shape, f);
}

/* Rates of the cores in rotor coordinates and of the currents, with given ones of f->flux. */
INLINE void field_rates(const machine_t *m, rotor_t rotor, double omega_e, shape_t shape, const field_t *f,
                        const double rate[], dq_t core_V[], double i_A_s[])
{
    dq_t psi[PLANT_SETS];
    for (int set = 0; set < shape.sets; set++) {
        ab_t turned = {rate[2 * set] + omega_e * f->flux[2 * set + 1],
                       rate[2 * set + 1] - omega_e * f->flux[2 * set]};
        psi[set] = frame_to_dq(turned, rotor);
    }
    field_cores(m, f, shape, psi, core_V);
    for (int set = 0; set < shape.sets; set++) {
        ab_t i = frame_to_ab(times(f->gamma_1_H[set], core_V[set]), rotor);
        i_A_s[2 * set] = i.alpha - omega_e * f->i_A[2 * set + 1];
        i_A_s[2 * set + 1] = i.beta + omega_e * f->i_A[2 * set];
    }
    if (shape.active > 2 * shape.sets) {
        i_A_s[2 * shape.sets] = rate[2 * shape.sets];
    }
}

#endif
