#include "tools/pmsim/flux_formula.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "tools/pmsim/flux_samples.h"
#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

const int first_count = 33, fit_count = 129, most_count = 193,
          kinked_count = 385;   // nodes a side, without those of kinks; odd: one at 0
const double accuracy = 1e-8;   // of the largest flux: then a finer grid is not tried
const double kinked = 1e-5;     // more than this on the finest grid has another cause than its step
const double reciprocal = 1e-6; // less is rounding and the error of the differences
const double between = 0.2764;  // part of a cell where the error of a quintic's slope is largest
const size_t points = difference_points;

// Weights of the values at 0, 1, ..., 8 in the value and the first two derivatives at x (Fornberg 1988).
std::array<std::array<double, points>, 3> difference_weights(double x)
{
    std::array<std::array<double, points>, 3> c{};
    c[0][0] = 1.0;
    double product = 1.0;
    for (size_t i = 1; i < points; ++i) {
        const double here = double(i) - x, before = here - 1.0;
        double distances = 1.0;
        for (size_t j = 0; j < i; ++j) {
            distances *= double(i - j);
        }
        for (size_t k = 3; k-- > 0;) {
            const double lower = k > 0 ? double(k) * c[k - 1][i - 1] : 0.0;
            c[k][i] = product / distances * (lower - before * c[k][i - 1]);
        }
        for (size_t j = 0; j < i; ++j) {
            for (size_t k = 3; k-- > 0;) {
                const double lower = k > 0 ? double(k) * c[k - 1][j] : 0.0;
                c[k][j] = (here * c[k][j] - lower) / double(i - j);
            }
        }
        product = distances;
    }
    return c;
}

enum class Along { d, q };

// Difference quotient of one node by nine points of its stretch of a line.
double difference(const std::vector<double> &f, size_t node, size_t stride, size_t place, const Stretch &in,
                  size_t order)
{
    static const auto weights = [] {
        std::array<std::array<std::array<double, points>, 3>, points> w;
        for (size_t k = 0; k < points; ++k) {
            w[k] = difference_weights(double(k));
        }
        return w;
    }();
    const size_t first =
        std::clamp(place > points / 2 ? place - points / 2 : 0, in.first, in.last + 1 - points);
    const double *from = &f[node - (place - first) * stride];
    double sum = 0.0;
    for (size_t k = 0; k < points; ++k) {
        sum += weights[place - first][order][k] * from[k * stride];
    }
    return (order == 1 ? 1.0 / in.step_A : 1.0 / (in.step_A * in.step_A)) * sum;
}

// A derivative of node values; at the end of a stretch, where formulas have kinks, that of either side.
struct Slope {
    std::vector<double> below, above;
    double mean(size_t k) const
    {
        return 0.5 * (below[k] + above[k]);
    }
};

Slope sides(const Samples &s, const std::vector<double> &f, Along along, size_t order)
{
    const size_t n = s.d.i_A.size(), m = s.q.i_A.size(), stride = along == Along::d ? m : 1;
    const SampleAxis &axis = along == Along::d ? s.d : s.q;
    Slope slope{std::vector<double>(n * m), std::vector<double>(n * m)};
    for (size_t node = 0; node < n * m; ++node) {
        const size_t place = along == Along::d ? node / m : node % m;
        const Stretch *up = axis.above(place), *down = axis.below(place);
        const double above = up != nullptr ? difference(f, node, stride, place, *up, order) : 0.0;
        const double below = down != nullptr ? difference(f, node, stride, place, *down, order) : above;
        slope.below[node] = below;
        slope.above[node] = up != nullptr ? above : below;
    }
    return slope;
}

std::vector<double> derivative(const Samples &s, const std::vector<double> &f, Along along, size_t order)
{
    Slope slope = sides(s, f, along, order);
    for (size_t k = 0; k < slope.below.size(); ++k) {
        slope.below[k] = slope.mean(k);
    }
    return slope.below;
}

std::vector<double> mean(const std::vector<double> &a, const std::vector<double> &b)
{
    std::vector<double> m(a.size());
    std::transform(a.begin(), a.end(), b.begin(), m.begin(),
                   [](double x, double y) { return 0.5 * (x + y); });
    return m;
}

// All derivatives at the nodes.
struct Derivatives {
    explicit Derivatives(const Samples &s)
        : dd(derivative(s, s.psi_d, Along::d, 1)), qd(derivative(s, s.psi_q, Along::d, 1)),
          dq(derivative(s, s.psi_d, Along::q, 1)), qq(derivative(s, s.psi_q, Along::q, 1)),
          ddd(sides(s, s.psi_d, Along::d, 2)), qqq(sides(s, s.psi_q, Along::q, 2)),
          ddq(mean(derivative(s, dd, Along::q, 1), derivative(s, s.psi_q, Along::d, 2))),
          dqq(mean(derivative(s, s.psi_d, Along::q, 2), derivative(s, qq, Along::d, 1))),
          ddqq(mean(derivative(s, dqq, Along::d, 1), derivative(s, ddq, Along::q, 1)))
    {
    }

    double reciprocity() const
    {
        double cross = 0.0, self = 0.0;
        for (size_t k = 0; k < dd.size(); ++k) {
            cross += (dq[k] - qd[k]) * (dq[k] - qd[k]);
            self += 0.5 * (dd[k] * dd[k] + qq[k] * qq[k]);
        }
        return std::sqrt(cross / self);
    }

    std::vector<double> dd, qd, dq, qq;
    Slope ddd, qqq;
    std::vector<double> ddq, dqq, ddqq;
};

// Integral between two nodes of the quintic through f with its derivatives.
double rise(double h, const std::vector<double> &f, const std::vector<double> &f1, const Slope &f2, size_t a,
            size_t b)
{
    return h * (0.5 * (f[a] + f[b]) + h * (0.1 * (f1[a] - f1[b]) + h / 120.0 * (f2.above[a] + f2.below[b])));
}

std::vector<map_node_t> nodes_of(const Samples &s, const Derivatives &x)
{
    const size_t m = s.q.i_A.size();
    std::vector<map_node_t> nodes;
    for (size_t k = 0; k < s.psi_d.size(); ++k) {
        double W = 0.0;
        if (k % m > 0) {
            W = nodes[k - 1].W + rise(s.q.cell_A(k % m - 1), s.psi_q, x.qq, x.qqq, k - 1, k);
        } else if (k > 0) {
            W = nodes[k - m].W + rise(s.d.cell_A(k / m - 1), s.psi_d, x.dd, x.ddd, k - m, k);
        }
        nodes.push_back({W, s.psi_d[k], s.psi_q[k], x.dd[k], 0.5 * (x.dq[k] + x.qd[k]), x.qq[k], x.ddq[k],
                         x.dqq[k], x.ddqq[k]});
    }
    return nodes;
}

// Largest differences from the formula at points within the cells, relative to the largest flux: of all, and
// of those that do not pass a step of the inductance.
void compare(FluxFormulaMap &result, const map_table_t *map, const Samples &s, const FluxOfCurrent &flux)
{
    const size_t m = s.q.i_A.size();
    for (size_t i = 0; i + 1 < s.d.i_A.size(); ++i) {
        for (size_t j = 0; j + 1 < m; ++j) {
            const dq_t i_A{s.d.i_A[i] + between * s.d.cell_A(i), s.q.i_A[j + 1] - between * s.q.cell_A(j)};
            const dq_t psi = flux(i_A, {s.psi_d[i * m + j], s.psi_q[i * m + j]});
            map_point_t found;
            map_table_eval(map, i_A, 0.0, &found);
            const double part =
                std::max(std::fabs(found.psi_Wb.d - psi.d), std::fabs(found.psi_Wb.q - psi.q)) / s.largest_Wb;
            result.deviation = std::max(result.deviation, part);
            if (s.d.above(i) != nullptr && s.q.above(j) != nullptr) {
                result.even_deviation = std::max(result.even_deviation, part);
            }
        }
    }
}

void finish(FluxFormulaMap &result, map_table_t *map, const Samples &s, const FluxOfCurrent &flux)
{
    result.map.reset(map);
    result.largest_Wb = s.largest_Wb;
    if (map != nullptr) {
        compare(result, map, s, flux);
    }
}

FluxFormulaMap map_of_nodes(const Samples &s, const FluxOfCurrent &flux)
{
    const Derivatives x(s);
    FluxFormulaMap result;
    if (x.reciprocity() < reciprocal) {
        const std::vector<map_node_t> nodes = nodes_of(s, x);
        map_table_t *map = map_table_from_nodes(int(s.d.i_A.size()), int(s.q.i_A.size()), s.d.i_A.data(),
                                                s.q.i_A.data(), nodes.data(), &result.report, &result.error);
        result.report.reciprocity = x.reciprocity();
        finish(result, map, s, flux);
    }
    return result;
}

FluxFormulaMap map_of_fit(const Samples &s, const FluxOfCurrent &flux)
{
    FluxFormulaMap result;
    const map_table_data_t data = {
        int(s.d.i_A.size()), int(s.q.i_A.size()), 1, 1, s.d.i_A.data(), s.q.i_A.data(),
        s.psi_d.data(),      s.psi_q.data()};
    finish(result, map_table_create(&data, &result.report, &result.error), s, flux);
    return result;
}

// The deviation falls with the fifth power of the step.
int finer(int count, double deviation, int most)
{
    const int halves =
        int(0.6 * count * std::pow(deviation / accuracy, 0.2)); // 1.2 times what it should take
    return std::clamp(2 * halves + 1, std::min(count + 16, most), most);
}

int next_count(int count, const FluxFormulaMap &map, int most)
{
    return map.map ? finer(count, map.even_deviation, most) : (count < fit_count ? fit_count : most);
}

bool good(int count, const FluxFormulaMap &map, int most)
{
    return map.map && (map.even_deviation < accuracy || (count == most && map.even_deviation < kinked));
}

// From a number of nodes on as many as it takes. The last one, if that is not enough; empty where the
// formulas make no map of nodes.
FluxFormulaMap refine(const FluxOfCurrent &flux, double i_max_A, const FluxKinks &kinks, int first, int most)
{
    for (int count = first;;) {
        FluxFormulaMap map = map_of_nodes(
            sample(flux, sample_axis(i_max_A, count, kinks.d), sample_axis(i_max_A, count, kinks.q)), flux);
        if (good(count, map, most) || count == most) {
            return map;
        }
        count = next_count(count, map, most);
    }
}

std::string at(dq_t i_A)
{
    return "i_d = " + format(i_A.d) + " A, i_q = " + format(i_A.q) + " A";
}

} // namespace

FluxOfCurrent flux_of_current(const Expression &psi_d, const Expression &psi_q)
{
    return [&](dq_t i_A, dq_t) {
        const dq_t psi{psi_d(i_A.d, i_A.q), psi_q(i_A.d, i_A.q)};
        for (const auto &[formula, flux] : {std::pair{&psi_d, psi.d}, std::pair{&psi_q, psi.q}}) {
            if (!std::isfinite(flux)) {
                formula->value().fail("the flux is not finite at " + at(i_A));
            }
        }
        return psi;
    };
}

FluxFormulaMap map_of_formula(const FluxOfCurrent &flux, double i_max_A)
{
    const SampleAxis even = sample_axis(i_max_A, first_count, {});
    FluxFormulaMap first = map_of_nodes(sample(flux, even, even), flux);
    if (good(first_count, first, most_count)) {
        return first;
    }
    const FluxKinks kinks = find_flux_kinks(flux, i_max_A);
    if (!kinks.d.empty() || !kinks.q.empty()) {
        FluxFormulaMap map = refine(flux, i_max_A, kinks, first_count, kinked_count);
        if (map.map && map.deviation < kinked) {
            return map;
        }
    }
    FluxFormulaMap map = refine(flux, i_max_A, {}, next_count(first_count, first, most_count), most_count);
    if (good(most_count, map, most_count)) {
        return map;
    }
    const SampleAxis finest = sample_axis(i_max_A, most_count, {});
    FluxFormulaMap fit = map_of_fit(sample(flux, finest, finest), flux);
    return !map.map || (fit.map && fit.deviation < map.deviation) ? std::move(fit) : std::move(map);
}

} // namespace pmsim
