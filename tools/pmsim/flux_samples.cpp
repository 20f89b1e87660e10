#include "tools/pmsim/flux_samples.h"

#include <algorithm>
#include <cmath>

namespace pmsim
{
namespace
{

const double gap = 1e-5; // of i_max: from a step of the inductance to the nodes beside it
const double least_stretch =
    1e-3; // of i_max: a kink nearer than this to the next one, or to an end, is left out

// Where stretches end: at both currents, one node if they are equal.
struct Border {
    double below_A, above_A;
};

std::vector<Border> borders(double i_max_A, const std::vector<FluxKink> &kinks)
{
    std::vector<Border> inner;
    for (const FluxKink &kink : kinks) {
        const double before_A = inner.empty() ? -i_max_A : inner.back().above_A;
        const double half_A = kink.step ? gap * i_max_A + kink.within_A : 0.0;
        // at zero but for what is not known of it: exactly there, as a formula with abs() has it
        const double i_A = std::fabs(kink.i_A) <= kink.within_A ? 0.0 : kink.i_A;
        if (i_A - before_A > least_stretch * i_max_A && i_max_A - i_A > least_stretch * i_max_A) {
            inner.push_back({i_A - half_A, i_A + half_A});
        }
    }
    const bool at_zero = std::any_of(inner.begin(), inner.end(), [&](const Border &b) {
        return std::fabs(0.5 * (b.below_A + b.above_A)) < least_stretch * i_max_A;
    });
    if (!at_zero) {
        inner.push_back({0.0, 0.0});
    }
    std::sort(inner.begin(), inner.end(),
              [](const Border &a, const Border &b) { return a.below_A < b.below_A; });
    return inner;
}

void add_stretch(SampleAxis &axis, double low_A, double high_A, double step_A)
{
    const size_t cells = std::max(size_t(std::lround((high_A - low_A) / step_A)), difference_points - 1);
    const bool joined = !axis.i_A.empty() && axis.i_A.back() == low_A;
    const size_t first = axis.i_A.size() - (joined ? 1 : 0);
    for (size_t k = joined ? 1 : 0; k <= cells; ++k) {
        axis.i_A.push_back(k == cells ? high_A : low_A + (high_A - low_A) * double(k) / double(cells));
    }
    axis.stretches.push_back({first, first + cells, (high_A - low_A) / double(cells)});
}

SampleAxis even_axis(double i_max_A, size_t count)
{
    const size_t middle = count / 2;
    const double step_A = 2.0 * i_max_A / double(count - 1);
    SampleAxis axis{{}, {{0, middle, step_A}, {middle, count - 1, step_A}}, middle};
    for (size_t k = 0; k < count; ++k) {
        axis.i_A.push_back(i_max_A * (double(k) / double(middle) - 1.0));
    }
    return axis;
}

} // namespace

const Stretch *SampleAxis::below(size_t node) const
{
    const auto found = std::find_if(stretches.begin(), stretches.end(),
                                    [&](const Stretch &s) { return s.first < node && node <= s.last; });
    return found == stretches.end() ? nullptr : &*found;
}

const Stretch *SampleAxis::above(size_t node) const
{
    const auto found = std::find_if(stretches.begin(), stretches.end(),
                                    [&](const Stretch &s) { return s.first <= node && node < s.last; });
    return found == stretches.end() ? nullptr : &*found;
}

double SampleAxis::cell_A(size_t node) const
{
    const Stretch *stretch = above(node);
    return stretch != nullptr ? stretch->step_A : i_A[node + 1] - i_A[node];
}

SampleAxis sample_axis(double i_max_A, int count, const std::vector<FluxKink> &kinks)
{
    if (kinks.empty()) {
        return even_axis(i_max_A, size_t(count));
    }
    SampleAxis axis{};
    double low_A = -i_max_A;
    for (const Border &border : borders(i_max_A, kinks)) {
        add_stretch(axis, low_A, border.below_A, 2.0 * i_max_A / (count - 1));
        low_A = border.above_A;
    }
    add_stretch(axis, low_A, i_max_A, 2.0 * i_max_A / (count - 1));
    const auto nearest = std::min_element(axis.i_A.begin(), axis.i_A.end(),
                                          [](double a, double b) { return std::fabs(a) < std::fabs(b); });
    axis.zero = size_t(nearest - axis.i_A.begin());
    return axis;
}

// Outwards from zero current, so that there is always a neighbour's flux to begin with.
Samples sample(const FluxOfCurrent &flux, SampleAxis d, SampleAxis q)
{
    const size_t n = d.i_A.size(), m = q.i_A.size(), middle = q.zero;
    Samples s{std::move(d), std::move(q), std::vector<double>(n * m), std::vector<double>(n * m), 0.0};
    const auto take = [&](size_t i, size_t j, size_t from) {
        const dq_t psi = flux({s.d.i_A[i], s.q.i_A[j]}, {s.psi_d[from], s.psi_q[from]});
        s.psi_d[i * m + j] = psi.d;
        s.psi_q[i * m + j] = psi.q;
        s.largest_Wb = std::max({s.largest_Wb, std::fabs(psi.d), std::fabs(psi.q)});
    };
    const auto take_line = [&](size_t i, size_t inner) {
        take(i, middle, inner * m + middle);
        for (size_t j = middle; j-- > 0;) {
            take(i, j, i * m + j + 1);
        }
        for (size_t j = middle + 1; j < m; ++j) {
            take(i, j, i * m + j - 1);
        }
    };
    take_line(s.d.zero, s.d.zero);
    for (size_t i = s.d.zero; i-- > 0;) {
        take_line(i, i + 1);
    }
    for (size_t i = s.d.zero + 1; i < n; ++i) {
        take_line(i, i - 1);
    }
    return s;
}

} // namespace pmsim
