#include "tools/pmsim/flux_formula.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "tools/pmsim/text.h"

namespace pmsim
{
namespace
{

const int first_count = 33, fit_count = 129, most_count = 193; // nodes a side; odd: one is at zero current
const double accuracy = 1e-8;   // of the largest flux: then a finer grid is not tried
const double kinked = 1e-5;     // more than this on the finest grid has another cause than its step
const double reciprocal = 1e-6; // less is rounding and the error of the differences
const double between = 0.2764;  // part of a cell where the error of a quintic's slope is largest
const size_t points = 9;        // of a difference

struct Samples {
    size_t count; // a side
    double step_A;
    std::vector<double> i_A, psi_d, psi_q; // the fluxes: i_d slowest
    double largest_Wb;
};

// Outwards from zero current, so that there is always a neighbour's flux to begin with.
Samples sample(const FluxOfCurrent &flux, double i_max_A, int count)
{
    const size_t n = size_t(count), middle = n / 2;
    Samples s{n,  2.0 * i_max_A / double(n - 1), {}, std::vector<double>(n * n), std::vector<double>(n * n),
              0.0};
    for (size_t k = 0; k < n; ++k) {
        s.i_A.push_back(i_max_A * (double(k) / double(middle) - 1.0));
    }
    const auto take = [&](size_t i, size_t j, size_t from) {
        const dq_t psi = flux({s.i_A[i], s.i_A[j]}, {s.psi_d[from], s.psi_q[from]});
        s.psi_d[i * n + j] = psi.d;
        s.psi_q[i * n + j] = psi.q;
        s.largest_Wb = std::max({s.largest_Wb, std::fabs(psi.d), std::fabs(psi.q)});
    };
    for (size_t a = 0; a <= middle; ++a) {
        for (const size_t i : {middle + a, middle - a}) {
            const size_t inner = i > middle ? i - 1 : i + (a > 0 ? 1 : 0);
            take(i, middle, inner * n + middle);
            for (size_t j = middle; j-- > 0;) {
                take(i, j, i * n + j + 1);
            }
            for (size_t j = middle + 1; j < n; ++j) {
                take(i, j, i * n + j - 1);
            }
        }
    }
    return s;
}

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

// Difference quotient of one node by nine points of a line, from low to high.
double difference(const std::vector<double> &f, size_t node, size_t stride, size_t place, size_t low,
                  size_t high, size_t order)
{
    static const auto weights = [] {
        std::array<std::array<std::array<double, points>, 3>, points> w;
        for (size_t k = 0; k < points; ++k) {
            w[k] = difference_weights(double(k));
        }
        return w;
    }();
    const size_t first = std::clamp(place > points / 2 ? place - points / 2 : 0, low, high + 1 - points);
    const double *from = &f[node - (place - first) * stride];
    double sum = 0.0;
    for (size_t k = 0; k < points; ++k) {
        sum += weights[place - first][order][k] * from[k * stride];
    }
    return sum;
}

// A derivative of node values; at zero current, where formulas with abs() have kinks, that of either side.
struct Slope {
    std::vector<double> below, above;
    double mean(size_t k) const
    {
        return 0.5 * (below[k] + above[k]);
    }
};

Slope sides(const Samples &s, const std::vector<double> &f, Along along, size_t order)
{
    const size_t n = s.count, middle = n / 2, stride = along == Along::d ? n : 1;
    const double scale = order == 1 ? 1.0 / s.step_A : 1.0 / (s.step_A * s.step_A);
    Slope slope{std::vector<double>(n * n), std::vector<double>(n * n)};
    for (size_t node = 0; node < n * n; ++node) {
        const size_t place = along == Along::d ? node / n : node % n;
        const bool up = place >= middle, down = place <= middle;
        const double above = up ? scale * difference(f, node, stride, place, middle, n - 1, order) : 0.0;
        const double below = down ? scale * difference(f, node, stride, place, 0, middle, order) : above;
        slope.below[node] = below;
        slope.above[node] = up ? above : below;
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
    const size_t n = s.count;
    std::vector<map_node_t> nodes;
    for (size_t k = 0; k < n * n; ++k) {
        double W = 0.0;
        if (k % n > 0) {
            W = nodes[k - 1].W + rise(s.step_A, s.psi_q, x.qq, x.qqq, k - 1, k);
        } else if (k > 0) {
            W = nodes[k - n].W + rise(s.step_A, s.psi_d, x.dd, x.ddd, k - n, k);
        }
        nodes.push_back({W, s.psi_d[k], s.psi_q[k], x.dd[k], 0.5 * (x.dq[k] + x.qd[k]), x.qq[k], x.ddq[k],
                         x.dqq[k], x.ddqq[k]});
    }
    return nodes;
}

// Largest difference from the formula at points within the cells, relative to the largest flux.
double deviation(const map_table_t *map, const Samples &s, const FluxOfCurrent &flux)
{
    double largest = 0.0;
    for (size_t i = 0; i + 1 < s.count; ++i) {
        for (size_t j = 0; j + 1 < s.count; ++j) {
            const dq_t i_A{s.i_A[i] + between * s.step_A, s.i_A[j + 1] - between * s.step_A};
            const dq_t psi = flux(i_A, {s.psi_d[i * s.count + j], s.psi_q[i * s.count + j]});
            map_point_t found;
            map_table_eval(map, i_A, 0.0, &found);
            largest =
                std::max({largest, std::fabs(found.psi_Wb.d - psi.d), std::fabs(found.psi_Wb.q - psi.q)});
        }
    }
    return largest / s.largest_Wb;
}

void finish(FluxFormulaMap &result, map_table_t *map, const Samples &s, const FluxOfCurrent &flux)
{
    result.map.reset(map);
    result.largest_Wb = s.largest_Wb;
    result.deviation = map != nullptr ? deviation(map, s, flux) : 0.0;
}

FluxFormulaMap map_of_nodes(const Samples &s, const Derivatives &x, const FluxOfCurrent &flux)
{
    FluxFormulaMap result;
    const int n = int(s.count);
    const std::vector<map_node_t> nodes = nodes_of(s, x);
    map_table_t *map =
        map_table_from_nodes(n, n, s.i_A.data(), s.i_A.data(), nodes.data(), &result.report, &result.error);
    result.report.reciprocity = x.reciprocity();
    finish(result, map, s, flux);
    return result;
}

FluxFormulaMap map_of_fit(const Samples &s, const FluxOfCurrent &flux)
{
    FluxFormulaMap result;
    const int n = int(s.count);
    const map_table_data_t data = {n, n, 1, 1, s.i_A.data(), s.i_A.data(), s.psi_d.data(), s.psi_q.data()};
    finish(result, map_table_create(&data, &result.report, &result.error), s, flux);
    return result;
}

// The deviation falls with the fifth power of the step.
int finer(int count, double deviation)
{
    const int halves =
        int(0.6 * count * std::pow(deviation / accuracy, 0.2)); // 1.2 times what it should take
    return std::clamp(2 * halves + 1, count + 16, most_count);
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
    int count = first_count;
    for (;;) {
        const Samples s = sample(flux, i_max_A, count);
        const Derivatives x(s);
        FluxFormulaMap map;
        if (x.reciprocity() < reciprocal) {
            map = map_of_nodes(s, x, flux);
        }
        if (map.map && (map.deviation < accuracy || (count == most_count && map.deviation < kinked))) {
            return map;
        }
        if (count == most_count) {
            FluxFormulaMap fit = map_of_fit(s, flux);
            return !map.map || (fit.map && fit.deviation < map.deviation) ? std::move(fit) : std::move(map);
        }
        count = map.map ? finer(count, map.deviation) : (count < fit_count ? fit_count : most_count);
    }
}

} // namespace pmsim
