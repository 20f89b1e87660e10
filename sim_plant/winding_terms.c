#include "sim_plant/winding_terms.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

static double phase_angle(int phase)
{
    int set = phase / 3;
    return 2.0 * PI / 3.0 * (phase % 3) + PI / 6.0 * set;
}

double winding_axis(int phase, int c)
{
    if (c / 3 != phase / 3 || c == WINDING_SHORT) {
        return 0.0;
    }
    double angle = phase_angle(phase);
    return c % 3 == 0 ? cos(angle) : (c % 3 == 1 ? sin(angle) : 1.0);
}

double winding_weight(int c)
{
    return c == WINDING_SHORT ? 1.0 : (c % 3 == 2 ? 3.0 : 1.5);
}

/* matrix += of a matrix between phases, seen in coordinates */
static void add_phase_matrix(const winding_t *w, double matrix[COORDS][COORDS], int row, int column, double x)
{
    for (int r = 0; r < w->phases; r++) {
        for (int c = 0; c < w->phases; c++) {
            matrix[r][c] += winding_axis(row, r) / winding_weight(r) * x * winding_axis(column, c);
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

inductance_term_t *winding_inductance(winding_t *w, int order)
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
    inductance_term_t *term = winding_inductance(w, 0);
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

/* L cos x and L sin x, x = order theta + phase, by the cosine and the sine of |order| theta */
typedef struct {
    inductance_term_t *term;
    double cos_by_cos, cos_by_sin, sin_by_cos, sin_by_sin;
} wave_t;

static wave_t wave_of(winding_t *w, int order, double L_H, double phase_rad)
{
    double c = L_H * cos(phase_rad);
    double s = L_H * sin(phase_rad);
    double turn = order < 0 ? -1.0 : 1.0;
    return (wave_t){winding_inductance(w, abs(order)), c, -turn * s, s, turn * c};
}

static void add_cosine(const wave_t *wave, int row, int column, double share)
{
    wave->term->cosine[row][column] += share * wave->cos_by_cos;
    wave->term->sine[row][column] += share * wave->cos_by_sin;
}

static void add_sine(const wave_t *wave, int row, int column, double share)
{
    wave->term->cosine[row][column] += share * wave->sin_by_cos;
    wave->term->sine[row][column] += share * wave->sin_by_sin;
}

/* psi_row += L e^{jx} conj(i_column) */
static void add_salient(winding_t *w, int order, int row, int column, double L_H, double phase_rad)
{
    wave_t wave = wave_of(w, order, L_H, phase_rad);
    add_cosine(&wave, row, column, 1.0);
    add_sine(&wave, row, column + 1, 1.0);
    add_sine(&wave, row + 1, column, 1.0);
    add_cosine(&wave, row + 1, column + 1, -1.0);
}

/* psi_0 += L/2 Re(e^{jx} i) of a set, and psi += L e^{-jx} i_0: reciprocal, as the zero sequence weighs twice
 */
static void add_zero_salient(winding_t *w, int order, int set, double L_H, double phase_rad)
{
    wave_t wave = wave_of(w, order, L_H, phase_rad);
    int alpha = 3 * set, beta = alpha + 1, zero = alpha + 2;
    add_cosine(&wave, zero, alpha, 0.5);
    add_sine(&wave, zero, beta, -0.5);
    add_cosine(&wave, alpha, zero, 1.0);
    add_sine(&wave, beta, zero, -1.0);
}

/* x [cos; sin] of (2 theta - 3 gamma) between alpha (or beta) and zero of a set, reciprocal */
static void add_zero_link(winding_t *w, int set, int c, double cosine, double sine)
{
    inductance_term_t *term = winding_inductance(w, 2);
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
            if (h->order != 0) {
                double phase_rad = h->phase_rad + (2.0 - h->order) * gamma;
                add_salient(w, h->order, 3 * set, 3 * set, h->amplitude, phase_rad);
            }
            h = &p->zero_saliency[n];
            if (h->order != 0) {
                double phase_rad = h->phase_rad - (1.0 + h->order) * gamma;
                add_zero_salient(w, h->order, set, h->amplitude, phase_rad);
            }
        }
        if (p->dL_0_H != 0.0 || p->L_c0_H != 0.0) {
            add_zero_link(w, set, 3 * set, -0.5 * p->dL_0_H, -0.5 * p->L_c0_H);
            add_zero_link(w, set, 3 * set + 1, -0.5 * p->L_c0_H, 0.5 * p->dL_0_H);
        }
    }
    if (w->sets == 2 && (p->M_d_H != 0.0 || p->M_q_H != 0.0)) {
        inductance_term_t *term = winding_inductance(w, 0);
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
            double share = winding_axis(phase, c) / winding_weight(c);
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

void winding_terms(winding_t *w, const plant_winding_t *p, double R_s_ohm, double psi_m_Wb,
                   double psi_core_Wb, double magnet_scale)
{
    add_resistance(w, p, R_s_ohm);
    add_constant(w, p);
    add_turning(w, p);
    add_magnet(w, p, psi_m_Wb, psi_core_Wb, magnet_scale);
}
