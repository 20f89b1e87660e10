/* The motor: one or two sets of three phases around a common rotor (METHODS.md 0.2 E1 to E5, E14, E16, E17,
 * E19; row 36).
 *
 * The core of each set is a flux map in rotor coordinates, either the energy form
 *
 *   i_d = psi_d/L_d0 + c psi_d |psi|^4 - i_f
 *   i_q = psi_q/L_q0 + c psi_q |psi|^4
 *
 * which is the gradient of the stored energy
 *
 *   W = 1.5 (psi_d^2/(2 L_d0) + psi_q^2/(2 L_q0) + c |psi|^6/6 - i_f psi_d)
 *
 * so that saturation, cross-coupling and polarity belong together and energy is conserved; or a table
 * (map_table.h), which may say what reaches the zero sequence (map_zero.h). i_f is the magnet's equivalent
 * current. winding.h adds what is linear in the currents.
 *
 * State of a coordinate: core flux with the energy form, core current with a table, and the current itself
 * for a zero sequence or the fault branch. A plain machine, one star set of the energy form with harmonics of
 * the magnet at most, has
 *
 *   dpsi_core/dt = v - R i - omega psi_x'
 *
 * machine_rates() covers every machine; those whose phases are alike have a shorter way, field.h.
 *
 * E19: a shorted circuit (L_eddy, R_eddy) on each rotor axis carries, beside the core current,
 *
 *   L_eddy di_e/dt = dpsi_core/dt - R_eddy i_e
 *
 * Tests: machine_test.cpp. */
#ifndef PLANT_MACHINE_H
#define PLANT_MACHINE_H

#include "sim_plant/map_table.h"
#include "sim_plant/map_zero.h"
#include "sim_plant/winding.h"

typedef struct {
    double R_s_ohm;
    double gamma_d_1_H; /* 1/L_d0 */
    double gamma_q_1_H; /* 1/L_q0 */
    double c_A_Wb5;
    double i_f_A;
    double psi_m_Wb;
    double torque_gain; /* 1.5 P */
    double pole_pairs;
    double scale_Wb; /* of its fluxes */
    bool plain;
    bool symmetrical; /* see field.h */
    bool loose;       /* nothing links the cores but the magnet: see machine_rates.h */
    bool biased;      /* has eddy circuits or a map */
    double loose_gamma_1_H[ACTIVE];
    double gamma_sum_1_H; /* bounds, without current: of any current's response, */
    double fastest_1_s;   /* and of the rate of decay of any; */
    double gamma_leg_1_H; /* largest response of a leg's current to its own voltage */
    const map_table_t *map;
    bool zero_map; /* whose psi_0 meets a current: in an open winding */
    double gamma_eddy_d_1_H, gamma_eddy_q_1_H, R_eddy_ohm; /* zero: no eddy circuits */
    winding_t winding;
} machine_t;

/* Tangent inverse inductances: di_d = d dpsi_d + dq dpsi_q, di_q = dq dpsi_d + q dpsi_q. 1/H */
typedef struct {
    double d, dq, q;
} machine_tangent_t;

/* Electrical state of all windings at one instant. Eddy currents are in rotor coordinates, two a set. */
typedef struct {
    double u[ACTIVE]; /* by active coordinate; see above */
    double eddy_A[2 * PLANT_SETS];
    rotor_t rotor;
    double theta_e_rad;
} machine_state_t;

/* What follows from it. */
typedef struct {
    dq_t i_A, psi_Wb; /* of the core, without its eddy circuits */
    machine_tangent_t gamma_1_H;
    machine_tangent_t L_H; /* with them */
    dq_t psi_theta_Wb;
    dq_t zero_H;          /* dpsi_0/di_dq and ... */
    double zero_theta_Wb; /* ... dpsi_0/dtheta of a table in an open winding, which carries i_0 */
} core_t;

typedef struct {
    double i_A[ACTIVE]; /* terminal currents, active coordinates */
    double torque_Nm;
    core_t core[PLANT_SETS];
    winding_point_t series;
} machine_point_t;

/* Rates under given voltages of the active coordinates. */
typedef struct {
    double u[ACTIVE];
    double i_A_s[ACTIVE];
    double eddy_A_s[2 * PLANT_SETS];
} machine_rate_t;

/* See winding_branch(). */
void machine_set_branch(machine_t *machine, const double axis[PLANT_LEGS], double R_ohm);

/* False when what the winding adds leaves an inductance that is not positive. */
bool machine_is_sound(const machine_t *machine);

void machine_set(machine_t *machine, const plant_config_t *config, double winding_degC, double magnet_degC);

void machine_evaluate(const machine_t *machine, const machine_state_t *state, machine_point_t *point);
void machine_rates(const machine_t *machine, const machine_state_t *state, const machine_point_t *point,
                   double omega_e_rad_s, const double v_V[ACTIVE], machine_rate_t *rate);

/* Response of the currents to voltages: di = admittance v dt, 1/H, by active coordinate. */
void machine_admittance(const machine_t *machine, const machine_state_t *state, const machine_point_t *point,
                        double admittance_1_H[ACTIVE][ACTIVE]);

/* The state after flux linkage has been added to the windings in no time. */
void machine_kick(const machine_t *machine, machine_state_t *state, const machine_point_t *point,
                  const double kick_Wb[ACTIVE]);

/* State of a set whose legs carry nothing. */
void machine_idle(const machine_t *machine, machine_state_t *state, int set);

/* dpsi_0/dt of a table, beside winding_zero_V(); 0 without psi_0. */
double machine_map_zero_V(const machine_t *machine, const machine_state_t *state,
                          const machine_point_t *point, double omega_e_rad_s, const machine_rate_t *rate,
                          int set);

/* Total flux linkage of the first set, with that of the winding. */
dq_t machine_flux_Wb(const machine_t *machine, const machine_state_t *state, const machine_point_t *point);

double machine_energy_J(const machine_t *machine, const machine_state_t *state, const machine_point_t *point);

/* Of the d axis from phase A or X: what the harmonics of a table turn by */
static inline double machine_own_angle_rad(const machine_state_t *state, int set)
{
    return state->theta_e_rad - 0.52359877559829887308 * set;
}

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
