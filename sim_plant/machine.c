#include "sim_plant/machine.h"

void machine_set(machine_t *machine, const plant_machine_t *parameters)
{
    double psi_m = parameters->psi_m_Wb;
    machine->R_s_ohm = parameters->R_s_ohm;
    machine->gamma_d_1_H = 1.0 / parameters->L_d0_H;
    machine->gamma_q_1_H = 1.0 / parameters->L_q0_H;
    machine->c_A_Wb5 = parameters->c_A_Wb5;
    machine->i_f_A = psi_m / parameters->L_d0_H + parameters->c_A_Wb5 * psi_m * psi_m * psi_m * psi_m * psi_m;
    machine->psi_m_Wb = psi_m;
    machine->torque_gain = 1.5 * parameters->pole_pairs;
    machine->pole_pairs = parameters->pole_pairs;
}

double machine_energy_J(const machine_t *machine, dq_t psi_Wb)
{
    double psi2 = psi_Wb.d * psi_Wb.d + psi_Wb.q * psi_Wb.q;
    return 1.5 * (0.5 * psi_Wb.d * psi_Wb.d * machine->gamma_d_1_H +
                  0.5 * psi_Wb.q * psi_Wb.q * machine->gamma_q_1_H +
                  machine->c_A_Wb5 * psi2 * psi2 * psi2 / 6.0 - machine->i_f_A * psi_Wb.d);
}
