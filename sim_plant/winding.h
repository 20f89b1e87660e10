/* What the windings add to the core: connection, resistance, and flux linkage that is linear in the currents
 * and periodic in the rotor angle (METHODS.md 0.2 E3, E4, E5, E16, E17; rows 1, 8, 10, 33, 70, 79, 80 and
 * 89).
 *
 * All quantities are in coordinates: alpha, beta and zero of each set, alpha along phase A of the first set
 * for both, amplitude invariant; then the branch of a short circuit.
 *
 *   i_leg = axis . i
 *   v     = (axis' v_leg) / weight            so that weight v i is power
 *   psi   = psi_core(i) + L(theta) i + psi_x(theta)
 *
 * A star connection is the constraint that its zero coordinate carries no current: it is not among the active
 * coordinates, and its voltage is that of the neutral. An open winding keeps it.
 *
 * L and psi_x are Fourier series; L is symmetric in the weighted sense. A saliency of order n, which may be
 * negative, with x = n theta + phase and i = i_alpha + j i_beta, is
 *
 *   psi   = L e^{jx} conj(i)      saliency
 *   psi_0 = L/2 Re(e^{jx} i)      zero_saliency, with
 *   psi   = L e^{-jx} i_0
 *
 * dL_0 and L_c0 are a zero_saliency of order 2 with L e^{j phase} = -dL_0 + j L_c0. What of them moves with
 * the currents of a star, c = dL_0_d i_d + dL_0_q i_q^2 - j L_c0_q i_q, adds
 *
 *   psi_0 = -1/2 Re(c (i_d + j i_q) e^{j 3 theta})
 *
 * which meets no current: it is in the voltage of the neutral alone. Of three equal phases
 * only n = 2, 5, 8, 11 ... and -1, -4, -7, -10 ... are possible; config.c refuses others. A harmonic of phase
 * inductances
 *
 *   L_AA = L_m cos(m theta + phase)
 *   M_BC = M_m cos(m theta + phase)
 *
 * with those of the other phases a third of a turn on, is saliency L_m/2 + M_m and zero_saliency L_m - M_m of
 * order m and the same phase where m = 2 mod 3, of order -m and -phase where m = 1 mod 3; of m = 3, 6, 9
 * nothing is left. Tests: winding_test.cpp, validation_hf_test.cpp. */
#ifndef PLANT_WINDING_H
#define PLANT_WINDING_H

#include "sim_plant/frame.h"
#include "sim_plant/plant_config.h"

#define COORDS 7 /* of all: three of each set, and the fault branch */
#define ACTIVE 5 /* most that carry current: two stars and the fault branch */

#define FLUX_TERMS       (PLANT_HARMONICS + 1)
#define INDUCTANCE_TERMS (2 * PLANT_HARMONICS + 2)

typedef struct {
    int order;
    double cosine[COORDS], sine[COORDS];
} flux_term_t;

typedef struct {
    int order;
    double cosine[COORDS][COORDS], sine[COORDS][COORDS];
} inductance_term_t;

/* The active part of a term */
typedef struct {
    int order;
    double cosine[ACTIVE], sine[ACTIVE];
} flux_series_t;

typedef struct {
    int order;
    double cosine[ACTIVE][ACTIVE], sine[ACTIVE][ACTIVE];
} inductance_series_t;

typedef struct {
    int legs, sets, phases;
    int active;             /* coordinates that carry current, the first two of each set in order, */
    int coordinate[ACTIVE]; /* and which */
    int zero;               /* active index of the zero sequence of an open winding, or -1 */
    int branch;             /* and of the fault branch, or -1 */
    double weight[ACTIVE];
    double axis[PLANT_LEGS][ACTIVE];  /* i_leg = axis . i */
    double share[PLANT_LEGS][ACTIVE]; /* v = share' v_leg */
    /* axis by coordinate, of legs 3 g + n; the fourth is nothing */
    double by_leg[PLANT_SETS][ACTIVE][4];
    double R_ohm[ACTIVE][ACTIVE];
    bool even;        /* R is a multiple of one */
    bool symmetrical; /* all phases are alike but for their magnets, and sets linked by these alone: */
    double M_d_H, M_q_H;
    /* Sum of the shares of legs 3 g + n, n of a mask */
    double side[PLANT_SETS][8][ACTIVE];
    bool turning; /* some inductance depends on the angle */
    int flux_terms, inductance_terms, cogging_terms;
    int flux_series_terms,
        series_terms; /* those that show in the active coordinates, and turn; the others are */
    double L_constant_H[ACTIVE][ACTIVE];
    flux_series_t flux_series[FLUX_TERMS];
    inductance_series_t inductance_series[INDUCTANCE_TERMS];
    plant_harmonic_t cogging[PLANT_HARMONICS];
    /* all coordinates, from which the above are taken */
    double all_R_ohm[COORDS][COORDS];
    flux_term_t flux[FLUX_TERMS];
    inductance_term_t inductance[INDUCTANCE_TERMS];
    bool zero_moves; /* with the currents: */
    double dL_0_d_H_A, dL_0_q_H_A2, L_c0_q_H_A;
} winding_t;

/* psi_core_Wb: magnet flux that the core has already; psi_m_Wb: what it is to be before gain errors. */
void winding_init(winding_t *winding, const plant_winding_t *parameters, double R_s_ohm, double psi_m_Wb,
                  double psi_core_Wb, double magnet_scale);

/* The fault branch: its current flows out of legs with axis 1 and back into one with -1, or into the negative
 * rail. R < 0 removes it. */
void winding_branch(winding_t *winding, const double axis[PLANT_LEGS], double R_ohm);

/* The series at one angle: psi_x and its slope, L and its slope, the last only of a winding that is turning.
 */
typedef struct {
    double psi[ACTIVE], psi_theta[ACTIVE];
    double L[ACTIVE][ACTIVE], L_theta[ACTIVE][ACTIVE];
} winding_point_t;

/* Zero-sequence voltage of a star's phases: R i + dpsi/dt of the coordinate that carries no current. */
double winding_zero_V(const winding_t *winding, rotor_t rotor, double omega_e_rad_s, const double i_A[ACTIVE],
                      const double i_A_s[ACTIVE], int set);

double winding_cogging_Nm(const winding_t *winding, rotor_t rotor);
double winding_cogging_J(const winding_t *winding, rotor_t rotor); /* times pole pairs */

static inline rotor_t winding_sum(rotor_t x, rotor_t y)
{
    rotor_t sum = {x.c * y.c - x.s * y.s, x.c * y.s + x.s * y.c};
    return sum;
}

/* cos and sin of n times the angle, n > 0 */
static inline rotor_t winding_multiple(rotor_t rotor, int n)
{
    rotor_t square = rotor;
    for (; (n & 1) == 0; n >>= 1) {
        square = winding_sum(square, square);
    }
    rotor_t power = square;
    for (n >>= 1; n > 0; n >>= 1) {
        square = winding_sum(square, square);
        if (n & 1) {
            power = winding_sum(power, square);
        }
    }
    return power;
}

/* Of a list of ascending orders: the next from the one before, at first order 0. */
static inline rotor_t winding_next(rotor_t rotor, rotor_t turn, int *order, int next)
{
    int step = next - *order;
    bool first = *order == 0;
    *order = next;
    if (step == 0) {
        return turn;
    }
    rotor_t further = winding_multiple(rotor, step);
    return first ? further : winding_sum(turn, further);
}

/* n: the active coordinates, a constant where the caller can make it one */
static inline __attribute__((always_inline)) void winding_at(const winding_t *w, rotor_t rotor, int n,
                                                             winding_point_t *point)
{
    for (int a = 0; a < n; a++) {
        point->psi[a] = 0.0;
        point->psi_theta[a] = 0.0;
        for (int b = 0; b < n; b++) {
            point->L[a][b] = w->L_constant_H[a][b];
        }
    }
    rotor_t turn = {1.0, 0.0};
    int order = 0;
    for (int t = 0; t < w->flux_series_terms; t++) {
        const flux_series_t *term = &w->flux_series[t];
        turn = winding_next(rotor, turn, &order, term->order);
        for (int a = 0; a < n; a++) {
            point->psi[a] += term->cosine[a] * turn.c + term->sine[a] * turn.s;
            point->psi_theta[a] += term->order * (term->sine[a] * turn.c - term->cosine[a] * turn.s);
        }
    }
    if (w->series_terms == 0) {
        return;
    }
    for (int a = 0; a < n; a++) {
        for (int b = 0; b < n; b++) {
            point->L_theta[a][b] = 0.0;
        }
    }
    for (int t = 0; t < w->series_terms; t++) {
        const inductance_series_t *term = &w->inductance_series[t];
        turn = winding_multiple(rotor, term->order);
        for (int a = 0; a < n; a++) {
            for (int b = 0; b < n; b++) {
                double cosine = term->cosine[a][b];
                double sine = term->sine[a][b];
                point->L[a][b] += cosine * turn.c + sine * turn.s;
                point->L_theta[a][b] += term->order * (sine * turn.c - cosine * turn.s);
            }
        }
    }
}

#endif
