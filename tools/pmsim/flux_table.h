// Fluxes over a grid of currents, and of angles, from a CSV file with the columns
//
//   i_d_A, i_q_A, psi_d_Vs, psi_q_Vs   (or psi_d_Wb, psi_q_Wb)
//   theta_e_deg                        optional: equally spaced from 0 over one period, without its end
//   torque_Nm                          optional: only compared with the torque of currents and fluxes
//   psi_0_Vs (or psi_0_Wb)             optional: zero-sequence flux linkage; not used without theta_e_deg
//
// in rows of any order, one for each point of the grid. Errors name file and line. Tests: flux_map_test.cpp.
#ifndef PMSIM_FLUX_TABLE_H
#define PMSIM_FLUX_TABLE_H

#include <string>
#include <vector>

extern "C" {
#include "sim_plant/map_table.h"
}

namespace pmsim
{

// As map_table_data_t: i_d slowest, theta fastest.
struct FluxTable {
    std::vector<double> i_d_A, i_q_A;
    int count_theta = 1, theta_order = 1;
    std::vector<double> psi_d_Wb, psi_q_Wb;
    std::vector<double> psi_0_Wb, torque_Nm; // empty: not given
    std::vector<int> lines;                  // of the file

    map_table_data_t data() const;
    size_t index(size_t i, size_t j, size_t angle = 0) const;
};

FluxTable read_flux_table(const std::string &path);

// Adds i_q < 0 to a table for i_q >= 0: psi_d(-i_q, -theta) = psi_d, psi_q(-i_q, -theta) = -psi_q, psi_0
// alike psi_d. Refuses one that has no such symmetry at i_q = 0.
FluxTable mirror_flux_table(const FluxTable &table, const std::string &path);

} // namespace pmsim

#endif
