#include "sim_plant/winding_terms.h"

#include <math.h>
#include <stdlib.h>

#define L_SHORT_H  1e-6
#define NOTHING_WB 1e-15 /* what rounding leaves of a harmonic that cancels */

static void connect(winding_t *w, const plant_winding_t *p)
{
    bool open = p->connection == PLANT_OPEN;
    w->sets = p->sets > 1 ? 2 : 1;
    w->phases = 3 * w->sets;
    w->legs = open ? 6 : w->phases;
    w->zero = open ? 2 : -1;
    w->branch = -1;
    for (int c = 0; c < w->phases; c++) {
        if (open || c % 3 != 2) {
            w->coordinate[w->active++] = c;
        }
    }
}

/* By ascending order, which winding_next() wants */
static int by_order(const void *x, const void *y)
{
    return ((const flux_series_t *)x)->order - ((const flux_series_t *)y)->order;
}

static void pack_flux(winding_t *w)
{
    w->flux_series_terms = 0;
    for (int t = 0; t < w->flux_terms; t++) {
        const flux_term_t *term = &w->flux[t];
        flux_series_t *series = &w->flux_series[w->flux_series_terms];
        bool shows = false;
        for (int a = 0; a < w->active; a++) {
            series->cosine[a] = term->cosine[w->coordinate[a]];
            series->sine[a] = term->sine[w->coordinate[a]];
            shows = shows || fabs(series->cosine[a]) + fabs(series->sine[a]) > NOTHING_WB;
        }
        series->order = term->order;
        w->flux_series_terms += shows;
    }
    qsort(w->flux_series, (size_t)w->flux_series_terms, sizeof w->flux_series[0], by_order);
}

static void pack_inductance(winding_t *w)
{
    w->series_terms = 0;
    for (int t = 0; t < w->inductance_terms; t++) {
        const inductance_term_t *term = &w->inductance[t];
        inductance_series_t *series = &w->inductance_series[w->series_terms];
        bool shows = false; /* a link to the zero sequence of a star does not */
        for (int a = 0; a < w->active; a++) {
            for (int b = 0; b < w->active; b++) {
                series->cosine[a][b] = term->cosine[w->coordinate[a]][w->coordinate[b]];
                series->sine[a][b] = term->sine[w->coordinate[a]][w->coordinate[b]];
                shows = shows || series->cosine[a][b] != 0.0 || series->sine[a][b] != 0.0;
                if (term->order == 0) {
                    w->L_constant_H[a][b] = series->cosine[a][b];
                }
            }
        }
        series->order = term->order;
        w->series_terms += term->order > 0 && shows;
    }
    w->turning = w->series_terms > 0;
}

static void sum_sides(winding_t *w)
{
    for (int side = 0; side < w->legs / 3; side++) {
        for (unsigned mask = 0; mask < 8; mask++) {
            for (int a = 0; a < ACTIVE; a++) {
                double sum = 0.0;
                for (int n = 0; n < 3; n++) {
                    sum += (mask >> n & 1u) != 0u ? w->share[3 * side + n][a] : 0.0;
                }
                w->side[side][mask][a] = sum;
            }
        }
    }
}

static void order_by_leg(winding_t *w)
{
    for (int leg = 0; leg < w->legs; leg++) {
        for (int a = 0; a < ACTIVE; a++) {
            w->by_leg[leg / 3][a][leg % 3] = w->axis[leg][a];
        }
    }
}

/* Takes the active part of everything. */
static void pack(winding_t *w)
{
    for (int leg = 0; leg < w->legs; leg++) { /* what is not active has no part: the branch may have gone */
        for (int a = w->active; a < ACTIVE; a++) {
            w->axis[leg][a] = 0.0;
            w->share[leg][a] = 0.0;
        }
    }
    for (int a = 0; a < w->active; a++) {
        int c = w->coordinate[a];
        w->weight[a] = winding_weight(c);
        for (int leg = 0; leg < w->legs; leg++) {
            if (c != WINDING_SHORT) {
                w->axis[leg][a] = leg < w->phases ? winding_axis(leg, c) : -winding_axis(leg - 3, c);
            }
            w->share[leg][a] = w->axis[leg][a] / w->weight[a];
        }
        for (int b = 0; b < w->active; b++) {
            w->R_ohm[a][b] = w->all_R_ohm[c][w->coordinate[b]];
        }
    }
    sum_sides(w);
    order_by_leg(w);
    pack_flux(w);
    pack_inductance(w);
}

static bool all_alike(const plant_winding_t *p)
{
    bool alike = p->connection == PLANT_STAR || (p->dL_0_H == 0.0 && p->L_c0_H == 0.0);
    for (int k = 0; k < PLANT_LEGS; k++) {
        alike = alike && p->dR_ohm[k] == 0.0 && p->dL_H[k] == 0.0 && p->dM_H[k / 3][k % 3] == 0.0;
    }
    for (int n = 0; n < PLANT_HARMONICS; n++) {
        alike = alike && p->saliency[n].order == 0;
        alike = alike && (p->connection == PLANT_STAR || p->zero_saliency[n].order == 0);
    }
    return alike;
}

void winding_init(winding_t *winding, const plant_winding_t *parameters, double R_s_ohm, double psi_m_Wb,
                  double psi_core_Wb, double magnet_scale)
{
    *winding = (winding_t){0};
    connect(winding, parameters);
    winding->symmetrical = all_alike(parameters);
    winding->M_d_H = parameters->M_d_H;
    winding->M_q_H = parameters->M_q_H;
    winding_terms(winding, parameters, R_s_ohm, psi_m_Wb, psi_core_Wb, magnet_scale);
    winding->dL_0_d_H_A = parameters->dL_0_H * parameters->dL_0_d_1_A;
    winding->dL_0_q_H_A2 = parameters->dL_0_H * parameters->dL_0_q_1_A2;
    winding->L_c0_q_H_A = parameters->L_c0_q_H_A;
    winding->zero_moves =
        winding->dL_0_d_H_A != 0.0 || winding->dL_0_q_H_A2 != 0.0 || winding->L_c0_q_H_A != 0.0;
    for (int n = 0; n < PLANT_HARMONICS; n++) {
        if (parameters->cogging[n].order > 0) {
            winding->cogging[winding->cogging_terms++] = parameters->cogging[n];
        }
    }
    pack(winding);
}

void winding_branch(winding_t *w, const double axis[PLANT_LEGS], double R_ohm)
{
    if (w->branch >= 0) {
        w->active--;
        w->branch = -1;
        pack(w);
    }
    if (R_ohm < 0.0) {
        return;
    }
    w->branch = w->active++;
    w->coordinate[w->branch] = WINDING_SHORT;
    for (int leg = 0; leg < w->legs; leg++) {
        w->axis[leg][w->branch] = axis[leg];
    }
    w->all_R_ohm[WINDING_SHORT][WINDING_SHORT] = R_ohm;
    winding_inductance(w, 0)->cosine[WINDING_SHORT][WINDING_SHORT] = L_SHORT_H;
    pack(w);
}

/* dpsi_0/dt of what moves with the currents of a star */
static double moving_zero_V(const winding_t *w, rotor_t rotor, double omega_e_rad_s, const double i_A[ACTIVE],
                            const double i_A_s[ACTIVE], int set)
{
    ab_t i_ab = {i_A[2 * set], i_A[2 * set + 1]}, i_ab_s = {i_A_s[2 * set], i_A_s[2 * set + 1]};
    dq_t i = frame_to_dq(i_ab, rotor);
    dq_t i_s = frame_to_dq(i_ab_s, rotor);
    i_s.d += omega_e_rad_s * i.q;
    i_s.q -= omega_e_rad_s * i.d;
    rotor_t triple = winding_multiple(rotor, 3);
    if (set > 0) { /* whose phase X is 30 degrees further on */
        triple = (rotor_t){triple.s, -triple.c};
    }
    double dL_0_H = w->dL_0_d_H_A * i.d + w->dL_0_q_H_A2 * i.q * i.q;
    double dL_0_H_s = w->dL_0_d_H_A * i_s.d + 2.0 * w->dL_0_q_H_A2 * i.q * i_s.q;
    double L_c0_H = w->L_c0_q_H_A * i.q;
    double L_c0_H_s = w->L_c0_q_H_A * i_s.q;
    double re = dL_0_H * i.d + L_c0_H * i.q; /* of c (i_d + j i_q) */
    double im = dL_0_H * i.q - L_c0_H * i.d;
    double re_s = dL_0_H_s * i.d + dL_0_H * i_s.d + L_c0_H_s * i.q + L_c0_H * i_s.q;
    double im_s = dL_0_H_s * i.q + dL_0_H * i_s.q - L_c0_H_s * i.d - L_c0_H * i_s.d;
    return -0.5 * (re_s * triple.c - im_s * triple.s) + 1.5 * omega_e_rad_s * (re * triple.s + im * triple.c);
}

double winding_zero_V(const winding_t *w, rotor_t rotor, double omega_e_rad_s, const double i_A[ACTIVE],
                      const double i_A_s[ACTIVE], int set)
{
    int zero = 3 * set + 2;
    double v_V = 0.0;
    for (int t = 0; t < w->flux_terms; t++) {
        const flux_term_t *term = &w->flux[t];
        rotor_t turn = term->order > 0 ? winding_multiple(rotor, term->order) : (rotor_t){1.0, 0.0};
        v_V += omega_e_rad_s * term->order * (term->sine[zero] * turn.c - term->cosine[zero] * turn.s);
    }
    for (int t = 0; t < w->inductance_terms; t++) {
        const inductance_term_t *term = &w->inductance[t];
        rotor_t turn = term->order > 0 ? winding_multiple(rotor, term->order) : (rotor_t){1.0, 0.0};
        for (int a = 0; a < w->active; a++) {
            double cosine = term->cosine[zero][w->coordinate[a]];
            double sine = term->sine[zero][w->coordinate[a]];
            v_V += (cosine * turn.c + sine * turn.s) * i_A_s[a];
            v_V += omega_e_rad_s * term->order * (sine * turn.c - cosine * turn.s) * i_A[a];
        }
    }
    for (int a = 0; a < w->active; a++) {
        v_V += w->all_R_ohm[zero][w->coordinate[a]] * i_A[a];
    }
    if (w->zero_moves) {
        v_V += moving_zero_V(w, rotor, omega_e_rad_s, i_A, i_A_s, set);
    }
    return v_V;
}

double winding_cogging_Nm(const winding_t *w, rotor_t rotor)
{
    double torque_Nm = 0.0;
    double theta = w->cogging_terms > 0 ? atan2(rotor.s, rotor.c) : 0.0;
    for (int n = 0; n < w->cogging_terms; n++) {
        torque_Nm += w->cogging[n].amplitude * sin(w->cogging[n].order * theta + w->cogging[n].phase_rad);
    }
    return torque_Nm;
}

/* Minus the integral of the torque over the electrical angle */
double winding_cogging_J(const winding_t *w, rotor_t rotor)
{
    double energy = 0.0;
    double theta = w->cogging_terms > 0 ? atan2(rotor.s, rotor.c) : 0.0;
    for (int n = 0; n < w->cogging_terms; n++) {
        energy += w->cogging[n].amplitude / w->cogging[n].order *
                  cos(w->cogging[n].order * theta + w->cogging[n].phase_rad);
    }
    return energy;
}
