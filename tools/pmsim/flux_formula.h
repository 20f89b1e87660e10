// A flux map written as formulas, sampled over a square of currents -i_max ... i_max.
//
// The samples become nodes with derivatives by differences of nine points, on a grid as fine as it takes for
// the map to follow the formula to 1e-8 of its largest flux; that is measured between the nodes. Kinks at a
// constant current get nodes of their own (flux_kinks.h); across a step of the inductance the map is within
// 1e-5. A formula with other kinks, or one that is not quite reciprocal, goes through the fit of
// map_table_create() instead. Tests: flux_map_test.cpp.
#ifndef PMSIM_FLUX_FORMULA_H
#define PMSIM_FLUX_FORMULA_H

#include <functional>

#include "tools/pmsim/expression.h"
#include "tools/pmsim/flux_map.h"

namespace pmsim
{

// Flux of a current; the guess is a flux of a current nearby. Throws InputError where there is none.
using FluxOfCurrent = std::function<dq_t(dq_t i_A, dq_t guess_Wb)>;

// The formulas must outlive what is made of them.
FluxOfCurrent flux_of_current(const Expression &psi_d, const Expression &psi_q);

// From formulas for the currents, by Newton's method.
FluxOfCurrent flux_by_inversion(const Expression &i_d, const Expression &i_q, double i_max_A);

struct FluxFormulaMap {
    FluxMapPointer map; // empty: refused
    map_table_report_t report{};
    const char *error = nullptr;
    double deviation = 0.0;      // largest found, relative to the largest flux
    double even_deviation = 0.0; // the same without the cells that pass a step of the inductance
    double largest_Wb = 0.0;
};

FluxFormulaMap map_of_formula(const FluxOfCurrent &flux, double i_max_A);

} // namespace pmsim

#endif
