/* The hot functions of machine.h, inline for a caller that knows the shape of the windings. */
#ifndef PLANT_MACHINE_RATES_H
#define PLANT_MACHINE_RATES_H

#include "sim_plant/machine.h"

#include <stddef.h>

#ifndef INLINE /* builds with sanitizers, which make a minute's work of it, leave it to the compiler */
#define INLINE static inline __attribute__((always_inline))
#endif

/* Compiled once more for processors with wider vectors: the same bits, as no product is contracted with a
 * sum. */
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__OPTIMIZE__) && !defined(__clang__) &&         \
    !defined(__SANITIZE_ADDRESS__)
#define WIDER __attribute__((target_clones("default", "avx2")))
#else
#define WIDER
#endif

/* Constants, where a function is to be compiled for them. */
typedef struct {
    int active, sets, legs;
} shape_t;

INLINE shape_t machine_shape(const machine_t *m)
{
    return (shape_t){m->winding.active, m->winding.sets, m->winding.legs};
}

INLINE ab_t of_set(const double x[ACTIVE], int set)
{
    return (ab_t){x[2 * set], x[2 * set + 1]};
}

/* a = b^-1 of a symmetric 2 x 2 */
INLINE machine_tangent_t inverse(machine_tangent_t b)
{
    double inv = 1.0 / (b.d * b.q - b.dq * b.dq);
    return (machine_tangent_t){b.q * inv, -b.dq * inv, b.d * inv};
}

INLINE dq_t times(machine_tangent_t m, dq_t x)
{
    return (dq_t){m.d * x.d + m.dq * x.q, m.dq * x.d + m.q * x.q};
}

/* What psi_0 of a table and the zero-sequence current make of it: map_zero.h */
static inline void core_zero(const machine_t *m, const machine_state_t *s, dq_t i_A, map_point_t *at,
                             core_t *core)
{
    map_zero_t zero;
    double twice_A = 2.0 * s->u[m->winding.zero];
    map_zero_eval(m->map, i_A, s->theta_e_rad, &zero);
    at->psi_Wb.d += twice_A * zero.d_H;
    at->psi_Wb.q += twice_A * zero.q_H;
    at->L_d_H += twice_A * zero.dd_H_A;
    at->L_dq_H += twice_A * zero.dq_H_A;
    at->L_q_H += twice_A * zero.qq_H_A;
    at->psi_theta_Wb.d += twice_A * zero.d_theta_H;
    at->psi_theta_Wb.q += twice_A * zero.q_theta_H;
    at->coenergy_theta_J += 1.5 * twice_A * zero.theta_Wb;
    core->zero_H = (dq_t){zero.d_H, zero.q_H};
    core->zero_theta_Wb = zero.theta_Wb;
}

/* Core of a set from its state. Returns the torque of a map that depends on the angle, less its cross
 * product. */
INLINE double evaluate_core(const machine_t *m, const machine_state_t *s, int set, bool tangent, core_t *core)
{
    dq_t u = frame_to_dq(of_set(s->u, set), s->rotor);
    machine_tangent_t gamma = {0};
    double torque_Nm = 0.0;
    core->psi_theta_Wb = (dq_t){0.0, 0.0};
    core->zero_H = (dq_t){0.0, 0.0};
    core->zero_theta_Wb = 0.0;
    if (m->map == NULL) {
        core->psi_Wb = u;
        core->i_A = machine_current_A(m, u);
        if (tangent) {
            gamma = machine_tangent_1_H(m, u);
        }
    } else {
        map_point_t at;
        map_table_eval(m->map, u, machine_own_angle_rad(s, set), &at);
        if (m->zero_map) {
            core_zero(m, s, u, &at, core);
        }
        core->psi_Wb = at.psi_Wb;
        core->i_A = u;
        core->psi_theta_Wb = at.psi_theta_Wb;
        gamma = inverse((machine_tangent_t){at.L_d_H, at.L_dq_H, at.L_q_H});
        torque_Nm = m->pole_pairs * at.coenergy_theta_J;
    }
    if (tangent) {
        core->gamma_1_H = gamma;
        gamma.d += m->gamma_eddy_d_1_H;
        gamma.q += m->gamma_eddy_q_1_H;
        core->L_H = inverse(gamma);
    }
    return torque_Nm;
}

/* tangent: with what the rates of a machine that is not loose need */
INLINE void machine_evaluate_n(const machine_t *m, const machine_state_t *s, shape_t shape, bool tangent,
                               machine_point_t *p)
{
    const winding_t *w = &m->winding;
    int n = shape.active;
    double torque_Nm = 0.0;
    if (tangent || !m->loose || w->flux_series_terms > 0) {
        winding_at(w, s->rotor, n, &p->series);
    }
    for (int set = 0; set < shape.sets; set++) {
        core_t *core = &p->core[set];
        torque_Nm += evaluate_core(m, s, set, tangent, core);
        dq_t i = {core->i_A.d + s->eddy_A[2 * set], core->i_A.q + s->eddy_A[2 * set + 1]};
        ab_t terminal = frame_to_ab(i, s->rotor);
        p->i_A[2 * set] = terminal.alpha;
        p->i_A[2 * set + 1] = terminal.beta;
        torque_Nm += machine_torque_Nm(m, core->psi_Wb, i);
    }
    for (int a = 2 * shape.sets; a < n; a++) {
        p->i_A[a] = s->u[a];
    }
    double virtual_Nm = 0.0;
    for (int a = 0; a < n && w->flux_series_terms > 0; a++) {
        virtual_Nm += w->weight[a] * p->i_A[a] * p->series.psi_theta[a];
    }
    for (int a = 0; a < n && w->turning; a++) {
        double slope = 0.0;
        for (int b = 0; b < n; b++) {
            slope += p->series.L_theta[a][b] * p->i_A[b];
        }
        virtual_Nm += 0.5 * w->weight[a] * p->i_A[a] * slope;
    }
    p->torque_Nm = torque_Nm + m->pole_pairs * virtual_Nm;
    if (w->cogging_terms > 0) {
        p->torque_Nm += winding_cogging_Nm(w, s->rotor);
    }
}

INLINE void machine_drop_n(const machine_t *m, const double i_A[ACTIVE], double v_V[ACTIVE], int n)
{
    const winding_t *w = &m->winding;
    for (int a = 0; a < n; a++) {
        v_V[a] = w->even ? w->R_ohm[a][a] * i_A[a] : 0.0;
        for (int b = 0; b < n && !w->even; b++) {
            v_V[a] += w->R_ohm[a][b] * i_A[b];
        }
    }
}

/* Tangent inductance between active coordinates, with the core's in stationary coordinates */
INLINE void inductance_matrix(const machine_state_t *s, const machine_point_t *p, shape_t shape,
                              double L[ACTIVE][ACTIVE])
{
    for (int a = 0; a < shape.active; a++) {
        for (int b = 0; b < shape.active; b++) {
            L[a][b] = p->series.L[a][b];
        }
    }
    double c2 = s->rotor.c * s->rotor.c;
    double s2 = s->rotor.s * s->rotor.s;
    double cs = s->rotor.c * s->rotor.s;
    for (int set = 0; set < shape.sets; set++) {
        machine_tangent_t t = p->core[set].L_H;
        double cross = cs * (t.d - t.q) + (c2 - s2) * t.dq;
        int a = 2 * set;
        L[a][a] += c2 * t.d + s2 * t.q - 2.0 * cs * t.dq;
        L[a][a + 1] += cross;
        L[a + 1][a] += cross;
        L[a + 1][a + 1] += s2 * t.d + c2 * t.q + 2.0 * cs * t.dq;
    }
    if (shape.sets == 1 && shape.legs == 6) { /* an open winding: psi_0 of a table, reciprocal */
        ab_t zero = frame_to_ab(p->core[0].zero_H, s->rotor);
        L[2][0] += zero.alpha;
        L[2][1] += zero.beta;
        L[0][2] += 2.0 * zero.alpha;
        L[1][2] += 2.0 * zero.beta;
    }
}

/* L x = b of two sets, in blocks of two: L = [A B; B' C], with the inverse of A and of C - B' A^-1 B. */
INLINE void machine_eliminate_sets(double L[ACTIVE][ACTIVE], double x[ACTIVE])
{
    machine_tangent_t a = inverse((machine_tangent_t){L[0][0], L[0][1], L[1][1]});
    dq_t first = times(a, (dq_t){L[0][2], L[1][2]});
    dq_t second = times(a, (dq_t){L[0][3], L[1][3]});
    machine_tangent_t rest = {L[2][2] - L[0][2] * first.d - L[1][2] * first.q,
                              L[2][3] - L[0][2] * second.d - L[1][2] * second.q,
                              L[3][3] - L[0][3] * second.d - L[1][3] * second.q};
    dq_t y = {x[2] - first.d * x[0] - first.q * x[1], x[3] - second.d * x[0] - second.q * x[1]};
    dq_t lower = times(inverse(rest), y);
    dq_t upper = times(a, (dq_t){x[0], x[1]});
    x[0] = upper.d - first.d * lower.d - second.d * lower.q;
    x[1] = upper.q - first.q * lower.d - second.q * lower.q;
    x[2] = lower.d;
    x[3] = lower.q;
}

/* L x = b by elimination; positive definite, so without pivoting. */
INLINE void machine_eliminate(int n, double L[ACTIVE][ACTIVE], double x[ACTIVE])
{
    double inv[ACTIVE];
    for (int k = 0; k < n; k++) {
        inv[k] = 1.0 / L[k][k];
        for (int row = k + 1; row < n; row++) {
            double factor = L[row][k] * inv[k];
            for (int column = k + 1; column < n; column++) {
                L[row][column] -= factor * L[k][column];
            }
            x[row] -= factor * x[k];
        }
    }
    for (int row = n - 1; row >= 0; row--) {
        for (int column = row + 1; column < n; column++) {
            x[row] -= L[row][column] * x[column];
        }
        x[row] *= inv[row];
    }
}

/* With a the rotor's view of dpsi_core/dt and b that of di/dt at the terminals, core and eddy circuits give
 * a = L_H b + bias. */
INLINE dq_t core_bias_V(const machine_t *m, const machine_state_t *s, const core_t *core, double omega,
                        int set)
{
    if (!m->biased) {
        return (dq_t){0.0, 0.0};
    }
    dq_t own = times(core->gamma_1_H, core->psi_theta_Wb);
    own.d = omega * own.d + m->R_eddy_ohm * m->gamma_eddy_d_1_H * s->eddy_A[2 * set];
    own.q = omega * own.q + m->R_eddy_ohm * m->gamma_eddy_q_1_H * s->eddy_A[2 * set + 1];
    return times(core->L_H, own);
}

/* L b = v - R i - bias - omega (J psi_core + L J i + L' i + psi_x') */
INLINE void right_side(const machine_t *m, const machine_state_t *s, const machine_point_t *p, double omega,
                       const double v_V[ACTIVE], shape_t shape, double x[ACTIVE])
{
    int n = shape.active;
    double ohmic_V[ACTIVE];
    double emf_V[ACTIVE] = {0.0};
    double turning_A[ACTIVE] = {0.0};
    machine_drop_n(m, p->i_A, ohmic_V, n);
    for (int set = 0; set < shape.sets; set++) {
        const core_t *core = &p->core[set];
        dq_t bias = core_bias_V(m, s, core, omega, set);
        ab_t emf =
            frame_to_ab((dq_t){bias.d - omega * core->psi_Wb.q, bias.q + omega * core->psi_Wb.d}, s->rotor);
        emf_V[2 * set] = emf.alpha;
        emf_V[2 * set + 1] = emf.beta;
        turning_A[2 * set] = -p->i_A[2 * set + 1];
        turning_A[2 * set + 1] = p->i_A[2 * set];
    }
    if (shape.sets == 1 && shape.legs == 6) {
        emf_V[2] = omega * p->core[0].zero_theta_Wb;
    }
    for (int a = 0; a < n; a++) {
        double motion = p->series.psi_theta[a];
        for (int b = 0; b < n; b++) {
            motion += p->series.L[a][b] * turning_A[b];
        }
        for (int b = 0; b < n && m->winding.turning; b++) {
            motion += p->series.L_theta[a][b] * p->i_A[b];
        }
        x[a] = v_V[a] - ohmic_V[a] - emf_V[a] - omega * motion;
    }
}

INLINE void set_rates(const machine_t *m, const machine_state_t *s, const machine_point_t *p, double omega,
                      int set, ab_t b_A_s, machine_rate_t *rate)
{
    const core_t *core = &p->core[set];
    dq_t bias = core_bias_V(m, s, core, omega, set);
    dq_t a = times(core->L_H, frame_to_dq(b_A_s, s->rotor));
    a.d += bias.d;
    a.q += bias.q;
    rate->eddy_A_s[2 * set] = m->gamma_eddy_d_1_H * (a.d - m->R_eddy_ohm * s->eddy_A[2 * set]);
    rate->eddy_A_s[2 * set + 1] = m->gamma_eddy_q_1_H * (a.q - m->R_eddy_ohm * s->eddy_A[2 * set + 1]);
    if (m->map != NULL) {
        a = times(core->gamma_1_H,
                  (dq_t){a.d - omega * core->psi_theta_Wb.d, a.q - omega * core->psi_theta_Wb.q});
    }
    ab_t moved = frame_to_ab(a, s->rotor);
    rate->u[2 * set] = moved.alpha - omega * s->u[2 * set + 1];
    rate->u[2 * set + 1] = moved.beta + omega * s->u[2 * set];
    rate->i_A_s[2 * set] = b_A_s.alpha - omega * p->i_A[2 * set + 1];
    rate->i_A_s[2 * set + 1] = b_A_s.beta + omega * p->i_A[2 * set];
}

INLINE void machine_rates_n(const machine_t *m, const machine_state_t *s, const machine_point_t *p,
                            double omega_e_rad_s, const double v_V[ACTIVE], shape_t shape,
                            machine_rate_t *rate)
{
    double L[ACTIVE][ACTIVE];
    double x[ACTIVE];
    right_side(m, s, p, omega_e_rad_s, v_V, shape, x);
    inductance_matrix(s, p, shape, L);
    if (shape.active == 4 && shape.sets == 2) {
        machine_eliminate_sets(L, x);
    } else {
        machine_eliminate(shape.active, L, x);
    }
    for (int set = 0; set < shape.sets; set++) {
        set_rates(m, s, p, omega_e_rad_s, set, of_set(x, set), rate);
    }
    for (int a = 2 * shape.sets; a < shape.active; a++) {
        rate->u[a] = x[a];
        rate->i_A_s[a] = x[a];
    }
}

/* The rates of u of a loose machine: dpsi_core/dt = v - R i - omega psi_x', and L di/dt for the rest. */
INLINE void machine_loose_rates_n(const machine_t *m, const machine_point_t *p, double omega_e_rad_s,
                                  const double v_V[ACTIVE], shape_t shape, double u[ACTIVE])
{
    double ohmic_V[ACTIVE];
    machine_drop_n(m, p->i_A, ohmic_V, shape.active);
    for (int a = 0; a < shape.active; a++) {
        u[a] = v_V[a] - ohmic_V[a];
        if (m->winding.flux_series_terms > 0) {
            u[a] -= omega_e_rad_s * p->series.psi_theta[a];
        }
    }
    for (int a = 2 * shape.sets; a < shape.active; a++) {
        u[a] *= m->loose_gamma_1_H[a];
    }
}

#endif
