// The section `flux_map` of a machine file: psi_d, psi_q as a table or as formulas. One of
//
//   table: map.csv                      CSV file (flux_table.h), found from the folder of the machine file
//   mirror_q: true                      the table is for i_q >= 0 only
//
//   psi_d_Vs: "0.1 + L_d*i_d"           formulas (expression.h) of i_d, i_q ...
//   psi_q_Vs: "L_q*i_q"
//   i_max_A: 12                         ... for currents of -i_max ... i_max on each axis
//   constants: {L_d: 4e-3, L_q: 6e-3}   optional
//
//   i_d_A: "(psi_d - 0.1)/L_d"          formulas of psi_d, psi_q, with i_max_A and constants
//   i_q_A: "psi_q/L_q"
//
// and reciprocity_max: 0.05, the rms difference of the two cross inductances, relative to the
// self-inductances, beyond which a map is refused; below, it is made reciprocal. Errors name file and line.
// Tests: tests/unit/pmsim/flux_map_test.cpp.
#ifndef PMSIM_FLUX_MAP_H
#define PMSIM_FLUX_MAP_H

#include <memory>
#include <string>

#include "tools/pmsim/yaml_reader.h"

extern "C" {
#include "sim_plant/map_table.h"
#include "sim_plant/map_zero.h"
}

namespace pmsim
{

struct FluxMapDestroy {
    void operator()(map_table_t *map) const
    {
        map_table_destroy(map);
    }
};

using FluxMapPointer = std::unique_ptr<map_table_t, FluxMapDestroy>;

// What a table says of itself, against slips of axes and units.
struct FluxTableFacts {
    std::string file;          // "": the map is not from a table
    dq_t magnet_Wb{};          // fluxes at zero current, mean over the angle
    double most_Wb = 0.0;      // largest flux
    double most_A = 0.0;       // largest current
    double torque_ratio = 0.0; // of the torque column to 1.5 (psi_d i_q - psi_q i_d); 0: there is none
};

struct FluxMap {
    FluxMapPointer table;
    map_table_report_t report{};
    double psi_m_Wb = 0.0;  // psi_d at zero current, mean over the angle
    dq_t low_A{}, high_A{}; // the currents of the data
    FluxTableFacts facts;
    std::string note; // what was changed or left out, for the user; "" when there is nothing to say
};

FluxMap read_flux_map(const Value &value);

// What is hardly meant of a table, for the user; "" when there is nothing to say:
//
//   magnets that do not lie on +d             fluxes at zero current more than 10 degrees from the d axis
//   fluxes or currents in another unit        torque column / (1.5 P (psi_d i_q - psi_q i_d)) beyond 1/2 ...
//   2, or
//                                             R i / psi at the largest values beyond 2 ... 2000 rad/s
//
// R i / psi is the electrical speed at which the EMF is as large as the drop: 14 to 410 rad/s of the machines
// here.
std::string flux_table_warning(const FluxMap &map, double R_s_ohm, int pole_pairs);

} // namespace pmsim

#endif
