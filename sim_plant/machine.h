/* Saturating permanent-magnet machine as an energy-form flux map (METHODS.md 0.2 E1, E2).
 *
 *   i_d = psi_d/L_d0 + c psi_d |psi|^4 - i_f      i_q = psi_q/L_q0 + c psi_q |psi|^4
 *
 * are the gradient of one stored energy
 *
 *   W = 1.5 (psi_d^2/(2 L_d0) + psi_q^2/(2 L_q0) + c |psi|^6/6 - i_f psi_d),
 *
 * so the map is reciprocal, saturation, cross-coupling and polarity belong together, and no energy is
 * made or lost. i_f is the magnet's equivalent current: it makes psi_m the flux at zero current.
 * W, like the factor 1.5 of the torque, is of the three-phase machine. No leakage between sets, no
 * spatial harmonics, no zero sequence.
 *
 * Cost: about 15 multiplications each. Tests: machine_test.cpp. */
#ifndef PLANT_MACHINE_H
#define PLANT_MACHINE_H

#include "sim_plant/frame.h"
#include "sim_plant/plant.h"

typedef struct {
    double R_s_ohm;
    double gamma_d_1_H; /* 1/L_d0 */
    double gamma_q_1_H; /* 1/L_q0 */
    double c_A_Wb5;
    double i_f_A;
    double psi_m_Wb;
    double torque_gain; /* 1.5 P */
    double pole_pairs;
} machine_t;

/* Tangent inverse inductances: di_d = d dpsi_d + dq dpsi_q, di_q = dq dpsi_d + q dpsi_q. 1/H */
typedef struct {
    double d, dq, q;
} machine_tangent_t;

void machine_set(machine_t *machine, const plant_machine_t *parameters);
double machine_energy_J(const machine_t *machine, dq_t psi_Wb);

static inline dq_t machine_current_A(const machine_t *m, dq_t psi_Wb)
{
    double psi2 = psi_Wb.d * psi_Wb.d + psi_Wb.q * psi_Wb.q;
    double sat = m->c_A_Wb5 * psi2 * psi2;
    dq_t i_A = {psi_Wb.d * (m->gamma_d_1_H + sat) - m->i_f_A, psi_Wb.q * (m->gamma_q_1_H + sat)};
    return i_A;
}

static inline machine_tangent_t machine_tangent_1_H(const machine_t *m, dq_t psi_Wb)
{
    double psi2 = psi_Wb.d * psi_Wb.d + psi_Wb.q * psi_Wb.q;
    double c_psi2 = m->c_A_Wb5 * psi2;
    machine_tangent_t tangent = {
        m->gamma_d_1_H + c_psi2 * (psi2 + 4.0 * psi_Wb.d * psi_Wb.d),
        4.0 * c_psi2 * psi_Wb.d * psi_Wb.q,
        m->gamma_q_1_H + c_psi2 * (psi2 + 4.0 * psi_Wb.q * psi_Wb.q),
    };
    return tangent;
}

static inline double machine_torque_Nm(const machine_t *m, dq_t psi_Wb, dq_t i_A)
{
    return m->torque_gain * (psi_Wb.d * i_A.q - psi_Wb.q * i_A.d);
}

#endif
