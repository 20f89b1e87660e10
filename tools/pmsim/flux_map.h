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

struct FluxMap {
    FluxMapPointer table;
    map_table_report_t report{};
    double psi_m_Wb = 0.0;  // psi_d at zero current, mean over the angle
    dq_t low_A{}, high_A{}; // the currents of the data
    std::string note;       // what was changed or left out, for the user; "" when there is nothing to say
};

FluxMap read_flux_map(const Value &value);

} // namespace pmsim

#endif
