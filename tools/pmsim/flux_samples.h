// Samples of a flux formula over a grid of currents that is even between kinks. For flux_formula.cpp; its
// tests are those of flux_map_test.cpp.
//
// Nodes stand at zero current, where formulas with abs() have kinks, and at every other kink. Where the
// inductance itself has a step, two nodes stand close to it instead: the map passes from one side to the
// other between them.
#ifndef PMSIM_FLUX_SAMPLES_H
#define PMSIM_FLUX_SAMPLES_H

#include <cstddef>
#include <vector>

#include "tools/pmsim/flux_kinks.h"

namespace pmsim
{

const size_t difference_points = 9; // of a difference: a stretch has as many nodes at least

// Nodes between two kinks, first to last.
struct Stretch {
    size_t first, last;
    double step_A;
};

struct SampleAxis {
    std::vector<double> i_A;
    std::vector<Stretch> stretches;
    size_t zero; // node at zero current, or the one nearest to it

    const Stretch *below(size_t node) const; // the stretch that ends here or goes on; null: there is none
    const Stretch *above(size_t node) const;
    double cell_A(size_t node) const; // to the next node
};

// An even axis has `count` nodes, odd; kinks add some.
SampleAxis sample_axis(double i_max_A, int count, const std::vector<FluxKink> &kinks);

struct Samples {
    SampleAxis d, q;
    std::vector<double> psi_d, psi_q; // i_d slowest
    double largest_Wb = 0.0;
};

Samples sample(const FluxOfCurrent &flux, SampleAxis d, SampleAxis q);

} // namespace pmsim

#endif
