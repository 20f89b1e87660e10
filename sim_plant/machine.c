#include "sim_plant/machine_rates.h"

#include <math.h>
#include <string.h>

#define PI             3.14159265358979323846
#define REFERENCE_DEGC 25.0
#define ANGLES         97 /* a prime: no harmonic looks constant on it */

static double inverse_or_zero(double x)
{
    return x > 0.0 ? 1.0 / x : 0.0;
}

static void set_core(machine_t *machine, const plant_machine_t *p, double psi_m_Wb)
{
    double psi2 = psi_m_Wb * psi_m_Wb;
    machine->gamma_d_1_H = inverse_or_zero(p->L_d0_H);
    machine->gamma_q_1_H = inverse_or_zero(p->L_q0_H);
    machine->c_A_Wb5 = p->c_A_Wb5;
    machine->i_f_A = psi_m_Wb * (machine->gamma_d_1_H + p->c_A_Wb5 * psi2 * psi2);
    machine->psi_m_Wb = psi_m_Wb;
}

/* Whether nothing links the cores' currents but the cores: then their flux integrates the voltage straight.
 */
static void find_loose(machine_t *machine)
{
    const winding_t *w = &machine->winding;
    bool loose = machine->map == NULL && machine->gamma_eddy_d_1_H == 0.0 &&
                 machine->gamma_eddy_q_1_H == 0.0 && w->cogging_terms == 0;
    loose = loose && !w->turning;
    for (int a = 0; a < w->active; a++) {
        for (int b = 0; b < w->active; b++) {
            bool own = a == b && a >= 2 * w->sets;
            loose = loose && (own || w->L_constant_H[a][b] == 0.0);
        }
        machine->loose_gamma_1_H[a] = inverse_or_zero(w->L_constant_H[a][a]);
    }
    machine->loose = loose;
    machine->plain = loose && w->active == 2 && w->even;
}

/* The trace of a positive matrix bounds its eigenvalues. */
static void set_bounds(machine_t *m)
{
    machine_state_t s = {.rotor = {1.0, 0.0}};
    machine_point_t p;
    double Y[ACTIVE][ACTIVE];
    double R_ohm = 0.0;
    for (int set = 0; set < m->winding.sets; set++) {
        machine_idle(m, &s, set);
    }
    machine_evaluate(m, &s, &p);
    machine_admittance(m, &s, &p, Y);
    m->gamma_sum_1_H = 0.0;
    for (int a = 0; a < m->winding.active; a++) {
        m->gamma_sum_1_H += Y[a][a];
        R_ohm = fmax(R_ohm, m->R_eddy_ohm + m->winding.R_ohm[a][a]);
    }
    m->fastest_1_s = m->gamma_sum_1_H * R_ohm;
    m->gamma_leg_1_H = 0.0;
    for (int k = 0; k < m->winding.legs; k++) {
        double gamma_1_H = 0.0;
        for (int a = 0; a < m->winding.active; a++) {
            for (int b = 0; b < m->winding.active; b++) {
                gamma_1_H += m->winding.axis[k][a] * Y[a][b] * m->winding.share[k][b];
            }
        }
        m->gamma_leg_1_H = fmax(m->gamma_leg_1_H, gamma_1_H);
    }
}

void machine_set_branch(machine_t *machine, const double axis[PLANT_LEGS], double R_ohm)
{
    winding_branch(&machine->winding, axis, R_ohm);
    find_loose(machine);
    set_bounds(machine);
}

/* The fundamental: mean over angle of what a table has without current. */
static double map_magnet_Wb(const map_table_t *map)
{
    double sum_Wb = 0.0;
    for (int n = 0; n < ANGLES; n++) {
        map_point_t at;
        map_table_eval(map, (dq_t){0.0, 0.0}, 2.0 * PI * n / ANGLES, &at);
        sum_Wb += at.psi_Wb.d;
    }
    return sum_Wb / ANGLES;
}

void machine_set(machine_t *machine, const plant_config_t *config, double winding_degC, double magnet_degC)
{
    const plant_machine_t *p = &config->machine;
    const plant_winding_t *w = &config->winding;
    double warm = 1.0 + w->alpha_R_1_K * (winding_degC - REFERENCE_DEGC);
    double magnet = 1.0 + w->alpha_psi_1_K * (magnet_degC - REFERENCE_DEGC);
    double psi_m_Wb = magnet * p->psi_m_Wb;
    double psi_core_Wb = psi_m_Wb;
    *machine = (machine_t){.map = config->map};
    if (machine->map != NULL) {
        psi_core_Wb = map_magnet_Wb(machine->map);
        psi_m_Wb = magnet * psi_core_Wb;
        machine->psi_m_Wb = psi_m_Wb;
    } else {
        set_core(machine, p, psi_m_Wb);
    }
    machine->R_s_ohm = warm * p->R_s_ohm;
    machine->torque_gain = 1.5 * p->pole_pairs;
    machine->pole_pairs = p->pole_pairs;
    machine->gamma_eddy_d_1_H = inverse_or_zero(w->L_eddy_d_H);
    machine->gamma_eddy_q_1_H = inverse_or_zero(w->L_eddy_q_H);
    machine->R_eddy_ohm = w->R_eddy_ohm;
    winding_init(&machine->winding, w, machine->R_s_ohm, psi_m_Wb, psi_core_Wb, magnet);
    machine->biased = machine->map != NULL || machine->gamma_eddy_d_1_H + machine->gamma_eddy_q_1_H > 0.0;
    machine->zero_map = machine->winding.zero >= 0 && map_zero_given(machine->map);
    find_loose(machine);
    machine->symmetrical =
        machine->winding.symmetrical && !machine->biased && machine->winding.cogging_terms == 0;
    machine->scale_Wb = fmax(psi_m_Wb, 0.1 * p->L_d0_H * config->sensor.i_full_scale_A);
    set_bounds(machine);
}

WIDER void machine_evaluate(const machine_t *m, const machine_state_t *s, machine_point_t *p)
{
    if (m->winding.active == 2) {
        machine_evaluate_n(m, s, (shape_t){2, 1, 3}, true, p);
    } else {
        machine_evaluate_n(m, s, machine_shape(m), true, p);
    }
}

/* Of a plain machine: the core's, in stationary coordinates. */
static void plain_admittance(const machine_state_t *s, const core_t *core,
                             double admittance_1_H[ACTIVE][ACTIVE])
{
    machine_tangent_t g = core->gamma_1_H;
    double c2 = s->rotor.c * s->rotor.c;
    double s2 = s->rotor.s * s->rotor.s;
    double cs = s->rotor.c * s->rotor.s;
    double cross = cs * (g.d - g.q) + (c2 - s2) * g.dq;
    admittance_1_H[0][0] = c2 * g.d + s2 * g.q - 2.0 * cs * g.dq;
    admittance_1_H[0][1] = cross;
    admittance_1_H[1][0] = cross;
    admittance_1_H[1][1] = s2 * g.d + c2 * g.q + 2.0 * cs * g.dq;
}

void machine_admittance(const machine_t *m, const machine_state_t *s, const machine_point_t *p,
                        double admittance_1_H[ACTIVE][ACTIVE])
{
    int n = m->winding.active;
    if (m->plain) {
        plain_admittance(s, &p->core[0], admittance_1_H);
        return;
    }
    for (int column = 0; column < n; column++) {
        double L[ACTIVE][ACTIVE];
        double x[ACTIVE] = {0.0};
        x[column] = 1.0;
        inductance_matrix(s, p, machine_shape(m), L);
        machine_eliminate(n, L, x);
        for (int row = 0; row < n; row++) {
            admittance_1_H[row][column] = x[row];
        }
    }
}

/* Of a plain machine: dpsi_core/dt = v - R i - omega psi_x', and the currents move by the tangent. */
static void plain_rates(const machine_t *m, const machine_state_t *s, const machine_point_t *p, double omega,
                        const double v_V[ACTIVE], machine_rate_t *rate)
{
    machine_loose_rates_n(m, p, omega, v_V, (shape_t){2, 1, 3}, rate->u);
    dq_t core_V = frame_to_dq((ab_t){rate->u[0] + omega * s->u[1], rate->u[1] - omega * s->u[0]}, s->rotor);
    ab_t moved = frame_to_ab(times(p->core[0].gamma_1_H, core_V), s->rotor);
    rate->i_A_s[0] = moved.alpha - omega * p->i_A[1];
    rate->i_A_s[1] = moved.beta + omega * p->i_A[0];
    rate->eddy_A_s[0] = 0.0;
    rate->eddy_A_s[1] = 0.0;
}

WIDER void machine_rates(const machine_t *m, const machine_state_t *s, const machine_point_t *p,
                         double omega_e_rad_s, const double v_V[ACTIVE], machine_rate_t *rate)
{
    if (m->plain) {
        plain_rates(m, s, p, omega_e_rad_s, v_V, rate);
    } else if (m->winding.active == 2) {
        machine_rates_n(m, s, p, omega_e_rad_s, v_V, (shape_t){2, 1, 3}, rate);
    } else {
        machine_rates_n(m, s, p, omega_e_rad_s, v_V, machine_shape(m), rate);
    }
}

void machine_kick(const machine_t *m, machine_state_t *s, const machine_point_t *p,
                  const double kick_Wb[ACTIVE])
{
    const winding_t *w = &m->winding;
    double L[ACTIVE][ACTIVE];
    double x[ACTIVE];
    memcpy(x, kick_Wb, sizeof x);
    inductance_matrix(s, p, machine_shape(m), L);
    machine_eliminate(w->active, L, x);
    for (int set = 0; set < w->sets; set++) {
        const core_t *core = &p->core[set];
        dq_t a = times(core->L_H, frame_to_dq(of_set(x, set), s->rotor));
        s->eddy_A[2 * set] += m->gamma_eddy_d_1_H * a.d;
        s->eddy_A[2 * set + 1] += m->gamma_eddy_q_1_H * a.q;
        ab_t moved = frame_to_ab(m->map != NULL ? times(core->gamma_1_H, a) : a, s->rotor);
        s->u[2 * set] += moved.alpha;
        s->u[2 * set + 1] += moved.beta;
    }
    for (int a = 2 * w->sets; a < w->active; a++) {
        s->u[a] += x[a];
    }
}

void machine_idle(const machine_t *m, machine_state_t *s, int set)
{
    dq_t i = {-s->eddy_A[2 * set], -s->eddy_A[2 * set + 1]};
    dq_t u = i;
    if (m->map == NULL) {
        u = (dq_t){m->psi_m_Wb, 0.0};
        for (int step = 0; step < 8 && (i.d != 0.0 || i.q != 0.0); step++) {
            dq_t now = machine_current_A(m, u);
            dq_t move = times(inverse(machine_tangent_1_H(m, u)), (dq_t){i.d - now.d, i.q - now.q});
            u.d += move.d;
            u.q += move.q;
        }
    }
    ab_t stationary = frame_to_ab(u, s->rotor);
    s->u[2 * set] = stationary.alpha;
    s->u[2 * set + 1] = stationary.beta;
    if (m->winding.zero >= 0) {
        s->u[m->winding.zero] = 0.0;
    }
}

double machine_map_zero_V(const machine_t *m, const machine_state_t *s, const machine_point_t *p,
                          double omega_e_rad_s, const machine_rate_t *rate, int set)
{
    if (!map_zero_given(m->map)) {
        return 0.0;
    }
    map_zero_t zero;
    dq_t i_A = p->core[set].i_A;
    dq_t moved_A_s = frame_to_dq(of_set(rate->u, set), s->rotor);
    map_zero_eval(m->map, i_A, machine_own_angle_rad(s, set), &zero);
    return zero.d_H * (moved_A_s.d + omega_e_rad_s * i_A.q) +
           zero.q_H * (moved_A_s.q - omega_e_rad_s * i_A.d) + omega_e_rad_s * zero.theta_Wb;
}

dq_t machine_flux_Wb(const machine_t *m, const machine_state_t *s, const machine_point_t *p)
{
    const winding_t *w = &m->winding;
    ab_t added = {p->series.psi[0], p->series.psi[1]};
    for (int a = 0; a < w->active; a++) {
        added.alpha += p->series.L[0][a] * p->i_A[a];
        added.beta += p->series.L[1][a] * p->i_A[a];
    }
    dq_t psi = frame_to_dq(added, s->rotor);
    return (dq_t){p->core[0].psi_Wb.d + psi.d, p->core[0].psi_Wb.q + psi.q};
}

static double core_energy_J(const machine_t *m, const machine_state_t *s, const core_t *core, int set)
{
    dq_t psi = core->psi_Wb;
    if (m->map != NULL) {
        map_point_t at;
        map_table_eval(m->map, core->i_A, machine_own_angle_rad(s, set), &at);
        return 1.5 * (psi.d * core->i_A.d + psi.q * core->i_A.q) - at.coenergy_J;
    }
    double psi2 = psi.d * psi.d + psi.q * psi.q;
    return 1.5 * (0.5 * psi.d * psi.d * m->gamma_d_1_H + 0.5 * psi.q * psi.q * m->gamma_q_1_H +
                  m->c_A_Wb5 * psi2 * psi2 * psi2 / 6.0 - m->i_f_A * psi.d);
}

double machine_energy_J(const machine_t *m, const machine_state_t *s, const machine_point_t *p)
{
    const winding_t *w = &m->winding;
    double energy_J = winding_cogging_J(w, s->rotor) / m->pole_pairs;
    for (int set = 0; set < w->sets; set++) {
        energy_J += core_energy_J(m, s, &p->core[set], set);
        for (int axis = 0; axis < 2; axis++) {
            double gamma_1_H = axis == 0 ? m->gamma_eddy_d_1_H : m->gamma_eddy_q_1_H;
            double i_A = s->eddy_A[2 * set + axis];
            energy_J += gamma_1_H > 0.0 ? 0.75 * i_A * i_A / gamma_1_H : 0.0;
        }
    }
    for (int a = 0; a < w->active; a++) {
        for (int b = 0; b < w->active; b++) {
            energy_J += 0.5 * w->weight[a] * p->i_A[a] * p->series.L[a][b] * p->i_A[b];
        }
    }
    return energy_J;
}

/* At no current and a grid of angles, the tangent inductance is positive definite. */
bool machine_is_sound(const machine_t *m)
{
    for (int n = 0; n < ANGLES; n++) {
        double theta = 2.0 * PI * n / ANGLES;
        machine_state_t s = {.rotor = {cos(theta), sin(theta)}, .theta_e_rad = theta};
        machine_point_t p;
        double L[ACTIVE][ACTIVE];
        for (int set = 0; set < m->winding.sets; set++) {
            machine_idle(m, &s, set);
        }
        machine_evaluate(m, &s, &p);
        inductance_matrix(&s, &p, machine_shape(m), L);
        for (int k = 0; k < m->winding.active; k++) {
            if (!(L[k][k] > 0.0)) {
                return false;
            }
            for (int row = k + 1; row < m->winding.active; row++) {
                double factor = L[row][k] / L[k][k];
                for (int column = k; column < m->winding.active; column++) {
                    L[row][column] -= factor * L[k][column];
                }
            }
        }
    }
    return true;
}
