#include "sim_plant/winding.h"

#include <math.h>
#include <stdlib.h>

#define PI         3.14159265358979323846
#define SHORT      6 /* coordinate of the fault branch */
#define L_SHORT_H  1e-6
#define NOTHING_WB 1e-15 /* what rounding leaves of a harmonic that cancels */

static double phase_angle(int phase)
{
    int set = phase / 3;
    return 2.0 * PI / 3.0 * (phase % 3) + PI / 6.0 * set;
}

/* Component of coordinate c of its set along a phase */
static double phase_axis(int phase, int c)
{
    if (c / 3 != phase / 3 || c == SHORT) {
        return 0.0;
    }
    double angle = phase_angle(phase);
    return c % 3 == 0 ? cos(angle) : (c % 3 == 1 ? sin(angle) : 1.0);
}

static double weight(int c)
{
    return c == SHORT ? 1.0 : (c % 3 == 2 ? 3.0 : 1.5);
}

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
        w->weight[a] = weight(c);
        for (int leg = 0; leg < w->legs; leg++) {
            if (c != SHORT) {
                w->axis[leg][a] = leg < w->phases ? phase_axis(leg, c) : -phase_axis(leg - 3, c);
            }
            w->share[leg][a] = w->axis[leg][a] / w->weight[a];
        }
        for (int b = 0; b < w->active; b++) {
            w->R_ohm[a][b] = w->all_R_ohm[c][w->coordinate[b]];
        }
    }
    sum_sides(w);
    pack_flux(w);
    pack_inductance(w);
}

/* matrix += of a matrix between phases, seen in coordinates */
static void add_phase_matrix(const winding_t *w, double matrix[COORDS][COORDS], int row, int column, double x)
{
    for (int r = 0; r < w->phases; r++) {
        for (int c = 0; c < w->phases; c++) {
            matrix[r][c] += phase_axis(row, r) / weight(r) * x * phase_axis(column, c);
        }
    }
}

static void add_resistance(winding_t *w, const plant_winding_t *p, double R_s_ohm)
{
    w->even = true;
    for (int c = 0; c < w->phases; c++) {
        w->all_R_ohm[c][c] = R_s_ohm;
    }
    for (int phase = 0; phase < w->phases; phase++) {
        w->even = w->even && p->dR_ohm[phase] == 0.0;
        add_phase_matrix(w, w->all_R_ohm, phase, phase, p->dR_ohm[phase]);
    }
}

static inductance_term_t *inductance_term(winding_t *w, int order)
{
    for (int t = 0; t < w->inductance_terms; t++) {
        if (w->inductance[t].order == order) {
            return &w->inductance[t];
        }
    }
    inductance_term_t *term = &w->inductance[w->inductance_terms++];
    *term = (inductance_term_t){.order = order};
    return term;
}

static void add_constant(winding_t *w, const plant_winding_t *p)
{
    double any = fabs(p->L_0_H);
    for (int k = 0; k < PLANT_LEGS; k++) {
        any += fabs(p->dL_H[k]) + fabs(p->dM_H[k / 3][k % 3]);
    }
    if (any == 0.0) {
        return;
    }
    inductance_term_t *term = inductance_term(w, 0);
    for (int set = 0; set < w->sets; set++) {
        term->cosine[3 * set + 2][3 * set + 2] += p->L_0_H;
        for (int k = 0; k < 3; k++) {
            int a = 3 * set + k;
            int b = 3 * set + (k + 1) % 3;
            add_phase_matrix(w, term->cosine, a, a, p->dL_H[a]);
            add_phase_matrix(w, term->cosine, a, b, p->dM_H[set][k]);
            add_phase_matrix(w, term->cosine, b, a, p->dM_H[set][k]);
        }
    }
}

/* psi_row += L e^{jx} conj(i_column), x = order theta + phase */
static void add_salient(winding_t *w, int order, int row, int column, double L_H, double phase_rad)
{
    inductance_term_t *term = inductance_term(w, order);
    double c = L_H * cos(phase_rad);
    double s = L_H * sin(phase_rad);
    term->cosine[row][column] += c;
    term->cosine[row][column + 1] += s;
    term->cosine[row + 1][column] += s;
    term->cosine[row + 1][column + 1] -= c;
    term->sine[row][column] -= s;
    term->sine[row][column + 1] += c;
    term->sine[row + 1][column] += c;
    term->sine[row + 1][column + 1] += s;
}

/* x [cos; sin] of (2 theta - 3 gamma) between alpha (or beta) and zero of a set, reciprocal */
static void add_zero_link(winding_t *w, int set, int c, double cosine, double sine)
{
    inductance_term_t *term = inductance_term(w, 2);
    int zero = 3 * set + 2;
    double turn = 3.0 * phase_angle(3 * set);
    double cos_part = cosine * cos(turn) - sine * sin(turn);
    double sin_part = cosine * sin(turn) + sine * cos(turn);
    term->cosine[zero][c] += cos_part;
    term->sine[zero][c] += sin_part;
    term->cosine[c][zero] += 2.0 * cos_part;
    term->sine[c][zero] += 2.0 * sin_part;
}

static void add_turning(winding_t *w, const plant_winding_t *p)
{
    for (int set = 0; set < w->sets; set++) {
        double gamma = phase_angle(3 * set);
        for (int n = 0; n < PLANT_HARMONICS; n++) {
            const plant_harmonic_t *h = &p->saliency[n];
            if (h->order > 0) {
                double phase_rad = h->phase_rad + (2.0 - h->order) * gamma;
                add_salient(w, h->order, 3 * set, 3 * set, h->amplitude, phase_rad);
            }
        }
        if (p->dL_0_H != 0.0 || p->L_c0_H != 0.0) {
            add_zero_link(w, set, 3 * set, -0.5 * p->dL_0_H, -0.5 * p->L_c0_H);
            add_zero_link(w, set, 3 * set + 1, -0.5 * p->L_c0_H, 0.5 * p->dL_0_H);
        }
    }
    if (w->sets == 2 && (p->M_d_H != 0.0 || p->M_q_H != 0.0)) {
        inductance_term_t *term = inductance_term(w, 0);
        for (int c = 0; c < 2; c++) {
            term->cosine[c][c + 3] += 0.5 * (p->M_d_H + p->M_q_H);
            term->cosine[c + 3][c] += 0.5 * (p->M_d_H + p->M_q_H);
        }
        if (p->M_d_H != p->M_q_H) {
            add_salient(w, 2, 0, 3, 0.5 * (p->M_d_H - p->M_q_H), 0.0);
            add_salient(w, 2, 3, 0, 0.5 * (p->M_d_H - p->M_q_H), 0.0);
        }
    }
}

/* Magnet flux of one order, phase by phase */
static void add_flux(winding_t *w, const plant_winding_t *p, int order, double psi_Wb, double phase_rad)
{
    flux_term_t *term = &w->flux[w->flux_terms++];
    *term = (flux_term_t){.order = order};
    for (int phase = 0; phase < w->phases; phase++) {
        double angle = phase_rad - order * (phase_angle(phase) + p->emf_shift_rad[phase]);
        double psi = psi_Wb * (1.0 + p->emf_gain[phase]);
        for (int c = 0; c < w->phases; c++) {
            double share = phase_axis(phase, c) / weight(c);
            term->cosine[c] += share * psi * cos(angle);
            term->sine[c] -= share * psi * sin(angle);
        }
    }
}

static void add_magnet(winding_t *w, const plant_winding_t *p, double psi_m_Wb, double psi_core_Wb,
                       double magnet_scale)
{
    bool uneven = psi_m_Wb != psi_core_Wb;
    for (int phase = 0; phase < w->phases; phase++) {
        uneven = uneven || p->emf_gain[phase] != 0.0 || p->emf_shift_rad[phase] != 0.0;
    }
    if (uneven) {
        add_flux(w, p, 1, psi_m_Wb, 0.0);
        for (int set = 0; set < w->sets; set++) {
            w->flux[0].cosine[3 * set] -= psi_core_Wb;
            w->flux[0].sine[3 * set + 1] -= psi_core_Wb;
        }
    }
    for (int n = 0; n < PLANT_HARMONICS; n++) {
        if (p->emf[n].order > 0) {
            add_flux(w, p, p->emf[n].order, magnet_scale * p->emf[n].amplitude, p->emf[n].phase_rad);
        }
    }
}

static bool all_alike(const plant_winding_t *p)
{
    bool alike = p->connection == PLANT_STAR || (p->dL_0_H == 0.0 && p->L_c0_H == 0.0);
    for (int k = 0; k < PLANT_LEGS; k++) {
        alike = alike && p->dR_ohm[k] == 0.0 && p->dL_H[k] == 0.0 && p->dM_H[k / 3][k % 3] == 0.0;
    }
    for (int n = 0; n < PLANT_HARMONICS; n++) {
        alike = alike && p->saliency[n].order == 0;
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
    add_resistance(winding, parameters, R_s_ohm);
    add_constant(winding, parameters);
    add_turning(winding, parameters);
    add_magnet(winding, parameters, psi_m_Wb, psi_core_Wb, magnet_scale);
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
    w->coordinate[w->branch] = SHORT;
    for (int leg = 0; leg < w->legs; leg++) {
        w->axis[leg][w->branch] = axis[leg];
    }
    w->all_R_ohm[SHORT][SHORT] = R_ohm;
    inductance_term(w, 0)->cosine[SHORT][SHORT] = L_SHORT_H;
    pack(w);
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
