// Currents at which formulas for fluxes have a kink, as abs(psi_d) gives them one where the magnets' flux is
// compensated: lines of constant i_d or constant i_q.
//
// Sixth differences of a line of samples fall with the sixth power of the step where it is smooth, and with
// the p-th at a kink of the p-th derivative. Where a finer step says that it is a kink (p up to 4), one zooms
// in until rounding hides it. What lies at the same current on most of five lines counts; kinks that wander
// are not found. Cost: some 7000 fluxes. Tests: flux_map_test.cpp.
#ifndef PMSIM_FLUX_KINKS_H
#define PMSIM_FLUX_KINKS_H

#include <vector>

#include "tools/pmsim/flux_formula.h"

namespace pmsim
{

struct FluxKink {
    double i_A;
    double within_A; // how well it is known
    bool step;       // of the inductance itself
};

struct FluxKinks {
    std::vector<FluxKink> d, q; // ascending
};

FluxKinks find_flux_kinks(const FluxOfCurrent &flux, double i_max_A);

} // namespace pmsim

#endif
