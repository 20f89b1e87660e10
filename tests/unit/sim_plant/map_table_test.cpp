// map_table.h: a flux map from data is one smooth co-energy, keeps to the data and says where it could not.
extern "C" {
#include "sim_plant/map_table.h"
}

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

namespace
{

using testing::HasSubstr;

constexpr double pi = 3.14159265358979323846;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
// Central differences of smooth functions: about eps^(2/3) of the value, with a factor for the scale of W.
constexpr double difference_tolerance = 1e-8;
// Cubic splines: what is left of the flux falls with the fourth power of the step.
constexpr double flux_tolerance = 1e-5; // of the magnet's flux, on 31 x 31 nodes up to twice rated current
constexpr double order_gain = 12.0;     // from 31 to 61 nodes; 16 in the limit

struct Destroy {
    void operator()(map_table_t *map) const
    {
        map_table_destroy(map);
    }
};
using Map = std::unique_ptr<map_table_t, Destroy>;
using Flux = std::function<dq_t(double i_d, double i_q, double theta)>;

struct Table {
    std::vector<double> i_d, i_q, psi_d, psi_q, torque;
    int count_theta = 1, theta_order = 1;

    map_table_data_t data() const
    {
        return {int(i_d.size()), int(i_q.size()), count_theta,  theta_order,
                i_d.data(),      i_q.data(),      psi_d.data(), psi_q.data()};
    }

    double angle(int n) const
    {
        return 2 * pi * n / (count_theta * theta_order);
    }

    size_t row(size_t i, size_t j, int n = 0) const
    {
        return (i * i_q.size() + j) * size_t(count_theta) + size_t(n);
    }
};

std::vector<double> grid(double low, double high, int count)
{
    std::vector<double> x;
    for (int k = 0; k < count; ++k) {
        x.push_back(low + (high - low) * k / (count - 1));
    }
    return x;
}

Table sample(std::vector<double> i_d, std::vector<double> i_q, const Flux &flux, int count_theta = 1,
             int theta_order = 1)
{
    Table t{std::move(i_d), std::move(i_q), {}, {}, {}, count_theta, theta_order};
    for (const double d : t.i_d) {
        for (const double q : t.i_q) {
            for (int n = 0; n < count_theta; ++n) {
                const dq_t psi = flux(d, q, t.angle(n));
                t.psi_d.push_back(psi.d);
                t.psi_q.push_back(psi.q);
            }
        }
    }
    return t;
}

Map create(const Table &table, map_table_report_t *report = nullptr, std::string *message = nullptr)
{
    map_table_report_t ignored;
    const char *error = nullptr;
    const map_table_data_t data = table.data();
    Map map(map_table_create(&data, report != nullptr ? report : &ignored, &error));
    if (message != nullptr) {
        *message = error != nullptr ? error : "no error";
    } else if (!map) {
        throw std::runtime_error(error);
    }
    return map;
}

map_point_t at(const Map &map, double i_d, double i_q, double theta = 0.0)
{
    map_point_t point;
    map_table_eval(map.get(), dq_t{i_d, i_q}, theta, &point);
    return point;
}

// IPM-1000 of METHODS 14 by the energy form of E1, inverted by Newton's method.
constexpr double psi_m = 0.236;

dq_t ipm_flux(double i_d, double i_q, double = 0.0)
{
    const double L_d = 46.3e-3, L_q = 76.9e-3, c = 105.0, i_f = psi_m / L_d + c * std::pow(psi_m, 5);
    dq_t psi{psi_m, 0.0};
    for (int k = 0; k < 60; ++k) {
        const double p2 = psi.d * psi.d + psi.q * psi.q;
        const double d = psi.d * (1 / L_d + c * p2 * p2) - i_f - i_d;
        const double q = psi.q * (1 / L_q + c * p2 * p2) - i_q;
        const double dd = 1 / L_d + c * p2 * (p2 + 4 * psi.d * psi.d);
        const double qq = 1 / L_q + c * p2 * (p2 + 4 * psi.q * psi.q);
        const double dq = 4 * c * p2 * psi.d * psi.q, det = dd * qq - dq * dq;
        psi.d -= (qq * d - dq * q) / det;
        psi.q -= (dd * q - dq * d) / det;
    }
    return psi;
}

Table ipm_table(int count, double i_max = 8.0)
{
    return sample(grid(-i_max, i_max, count), grid(-i_max, i_max, count), ipm_flux);
}

// Largest difference of the flux from a closed form, between nodes as well.
double flux_error(const Map &map, const Table &table, const Flux &flux)
{
    double worst = 0.0;
    const double d0 = table.i_d.front(), d1 = table.i_d.back(), q0 = table.i_q.front(), q1 = table.i_q.back();
    for (int k = 0; k <= 97; ++k) {
        for (int n = 0; n <= 101; ++n) {
            const double i_d = d0 + (d1 - d0) * k / 97, i_q = q0 + (q1 - q0) * n / 101;
            const dq_t psi = flux(i_d, i_q, 0.0), found = at(map, i_d, i_q).psi_Wb;
            worst = std::max({worst, std::fabs(found.d - psi.d), std::fabs(found.q - psi.q)});
        }
    }
    return worst;
}

// psi and L against differences of the co-energy and of psi; scale: of the currents.
void expect_consistent(const Map &map, double i_d, double i_q, double theta, double scale)
{
    const double h = 1e-5 * scale;
    const auto m = at(map, i_d, i_q, theta);
    const auto dp = at(map, i_d + h, i_q, theta), dm = at(map, i_d - h, i_q, theta);
    const auto qp = at(map, i_d, i_q + h, theta), qm = at(map, i_d, i_q - h, theta);
    const double psi_full = std::hypot(m.psi_Wb.d, m.psi_Wb.q) + 0.1;
    const double tolerance = 10 * difference_tolerance * psi_full;
    EXPECT_NEAR(m.psi_Wb.d, (dp.coenergy_J - dm.coenergy_J) / (3 * h), tolerance) << i_d << " " << i_q;
    EXPECT_NEAR(m.psi_Wb.q, (qp.coenergy_J - qm.coenergy_J) / (3 * h), tolerance) << i_d << " " << i_q;
    const double L_tolerance = 1e-5 * (m.L_d_H + m.L_q_H); // L bends from cell to cell
    EXPECT_NEAR(m.L_d_H, (dp.psi_Wb.d - dm.psi_Wb.d) / (2 * h), L_tolerance) << i_d << " " << i_q;
    EXPECT_NEAR(m.L_q_H, (qp.psi_Wb.q - qm.psi_Wb.q) / (2 * h), L_tolerance) << i_d << " " << i_q;
    EXPECT_NEAR(m.L_dq_H, (qp.psi_Wb.d - qm.psi_Wb.d) / (2 * h), L_tolerance) << i_d << " " << i_q;
    EXPECT_NEAR(m.L_dq_H, (dp.psi_Wb.q - dm.psi_Wb.q) / (2 * h), L_tolerance) << i_d << " " << i_q;
}

double tangent_min(const map_point_t &m)
{
    return 0.5 * (m.L_d_H + m.L_q_H) - std::hypot(0.5 * (m.L_d_H - m.L_q_H), m.L_dq_H);
}

TEST(MapTable, FollowsAClosedFormWithFourthOrder)
{
    const Table coarse = ipm_table(31), fine = ipm_table(61);
    map_table_report_t report;
    const double error_31 = flux_error(create(coarse, &report), coarse, ipm_flux);
    EXPECT_LT(error_31, flux_tolerance * psi_m);
    EXPECT_LT(report.reciprocity, 3e-5); // of the differences, the data are reciprocal
    EXPECT_LT(report.moved_Wb, 1e-6 * psi_m);
    const double error_61 = flux_error(create(fine), fine, ipm_flux);
    EXPECT_LT(error_61 * order_gain, error_31);
    std::printf("flux error %.2g and %.2g of the magnet's flux\n", error_31 / psi_m, error_61 / psi_m);
}

TEST(MapTable, TakesUnevenGrids)
{
    std::vector<double> x;
    for (const double k : grid(-1.0, 1.0, 41)) {
        x.push_back(8.0 * (0.4 * k + 0.6 * k * k * k)); // steps from 0.16 to 0.82 A
    }
    const Table table = sample(x, x, ipm_flux);
    EXPECT_LT(flux_error(create(table), table, ipm_flux), 4 * flux_tolerance * psi_m);
}

TEST(MapTable, IsTheGradientOfItsCoenergy)
{
    const Map map = create(ipm_table(17));
    for (double i_d = -7.9; i_d < 8.0; i_d += 1.13) {
        for (double i_q = -7.8; i_q < 8.0; i_q += 1.07) {
            expect_consistent(map, i_d, i_q, 0.0, 8.0);
        }
    }
    EXPECT_NEAR(at(map, 0.0, 0.0).coenergy_J, 0.0, 1e-15);
}

TEST(MapTable, CoenergyIsTheIntegralOfTheFlux)
{
    // Simpson's rule over the closed form from zero current along both axes
    double sum = 0.0;
    const double i_d = -3.3, i_q = 5.1;
    const int steps = 200;
    for (int k = 0; k <= steps; ++k) {
        const double weight = (k == 0 || k == steps ? 1.0 : k % 2 == 1 ? 4.0 : 2.0) / (3.0 * steps);
        const double x = double(k) / steps;
        sum += weight * (ipm_flux(x * i_d, 0.0).d * i_d + ipm_flux(i_d, x * i_q).q * i_q);
    }
    EXPECT_NEAR(at(create(ipm_table(31)), i_d, i_q).coenergy_J, 1.5 * sum, 1e-6);
}

TEST(MapTable, IsSmoothAcrossCells)
{
    const Table table = ipm_table(9);
    const Map map = create(table);
    const double step = 1e-9;
    for (const double x : {table.i_d[0], table.i_d[3], table.i_d[8]}) { // the edges of the grid too
        for (double y = -10.0; y < 10.0; y += 0.7) {
            const map_point_t a = at(map, x - step, y), b = at(map, x + step, y);
            EXPECT_NEAR(a.psi_Wb.d, b.psi_Wb.d, 1e-9);
            EXPECT_NEAR(a.L_d_H, b.L_d_H, 1e-9);
            EXPECT_NEAR(a.L_dq_H, b.L_dq_H, 1e-9);
            EXPECT_NEAR(a.L_q_H, b.L_q_H, 1e-9);
            const map_point_t c = at(map, y, x - step), d = at(map, y, x + step);
            EXPECT_NEAR(c.psi_Wb.q, d.psi_Wb.q, 1e-9);
            EXPECT_NEAR(c.L_d_H, d.L_d_H, 1e-9);
            EXPECT_NEAR(c.L_q_H, d.L_q_H, 1e-9);
        }
    }
}

// W' = L i^2/2 + P w ln cosh((i_d + k i_q - i_0)/w) + ...: a knee of width w across the plane.
Flux knee(double width, double slant)
{
    return [=](double i_d, double i_q, double) {
        const double t = 0.3 * std::tanh((i_d + slant * i_q - 0.37) / width);
        return dq_t{5e-3 * i_d + t, 5e-3 * i_q + slant * t + 0.2 * std::tanh(i_q / 2.0)};
    };
}

TEST(MapTable, StaysMonotoneAtAKneeSharperThanTheGrid)
{
    const Table table = sample(grid(-10, 10, 21), grid(-10, 10, 21), knee(0.05, 0.0));
    const Map map = create(table);
    for (size_t k = 0; k < 21; ++k) {
        for (double i = -10.0; i <= 10.0; i += 0.01) {
            EXPECT_GT(at(map, i, table.i_q[k]).L_d_H, 0.9e-3) << i; // a fifth of the smallest secant: 1 mH
            EXPECT_GT(at(map, table.i_d[k], i).L_q_H, 0.9e-3) << i;
        }
    }
}

TEST(MapTable, CrossFluxesStayMonotoneAlongGridLines)
{
    // Cross fluxes that rise everywhere, but most of it in three steps: their splines swing. On the second
    // grid the slopes at the nodes are good and only the quintics between them would swing.
    for (const auto &[count, width, slant] : {std::tuple{16, 2.0, 0.1}, std::tuple{10, 2.5, 0.05}}) {
        const Table table = sample(grid(-10, 10, count), grid(-10, 10, count), knee(width, slant));
        const Map map = create(table);
        for (size_t k = 0; k < size_t(count); ++k) {
            for (double i = -10.0; i <= 10.0; i += 0.01) { // 15 and 6 mH in the knee
                EXPECT_GT(at(map, i, table.i_q[k]).L_dq_H, -1e-6) << count << ": " << i;
                EXPECT_GT(at(map, table.i_d[k], i).L_dq_H, -1e-6) << count << ": " << i;
            }
        }
    }
}

TEST(MapTable, MakesDataReciprocalAndReportsTheDeviation)
{
    // A turning part of known size: psi = grad W' + (-a i_q, a i_d), with dpsi_d/di_q - dpsi_q/di_d = -2a
    const double a = 1e-3, L_d = 40e-3, L_q = 60e-3, i_max = 5.0;
    const Flux turning = [=](double i_d, double i_q, double) {
        return dq_t{0.2 + L_d * i_d - a * i_q, L_q * i_q + a * i_d};
    };
    const Table table = sample(grid(-i_max, i_max, 21), grid(-i_max, i_max, 21), turning);
    map_table_report_t report;
    const Map map = create(table, &report);
    EXPECT_NEAR(report.reciprocity, 2 * a / std::sqrt((L_d * L_d + L_q * L_q) / 2), 1e-9);
    // What is left out is the field of a stream function with zero on the border; on a square it has
    // 1.35 a i_max (torsion of a square bar: largest shear) in the middle of the sides.
    EXPECT_NEAR(report.moved_Wb, 1.35 * a * i_max, 0.03 * a * i_max);
    double found = 0.0;
    for (size_t i = 0; i < 21; ++i) {
        for (size_t j = 0; j < 21; ++j) {
            const dq_t psi = at(map, table.i_d[i], table.i_q[j]).psi_Wb;
            found = std::max({found, std::fabs(psi.d - table.psi_d[table.row(i, j)]),
                              std::fabs(psi.q - table.psi_q[table.row(i, j)])});
        }
    }
    EXPECT_NEAR(found, report.moved_Wb, 1e-12);
    for (double i = -4.7; i < 5.0; i += 0.83) { // slopes of the stream function; no ripple
        EXPECT_NEAR(at(map, i, 0.3 - i).L_d_H, L_d, 3 * a);
        EXPECT_NEAR(at(map, i, 0.3 - i).L_q_H, L_q, 3 * a);
        expect_consistent(map, i, 0.3 - i, 0.0, i_max);
    }
}

// psi = grad of W'_0 + b i_d i_q cos(6 theta) + e (i_q - i_q^3/300) sin(12 theta) + e i_d cos(18 theta) ...
Flux rippling(double b, double e)
{
    return [=](double i_d, double i_q, double theta) {
        const dq_t mean = ipm_flux(i_d, i_q);
        return dq_t{mean.d + b * i_q * std::cos(6 * theta) + e * std::cos(18 * theta),
                    mean.q + b * i_d * std::cos(6 * theta) +
                        e * (1 - i_q * i_q / 100) * std::sin(12 * theta)};
    };
}

TEST(MapTable, AngleHarmonicsAreAnalytic)
{
    const double b = 1e-3, e = 5e-3;
    const Flux flux = rippling(b, e);
    map_table_report_t report;
    const Map map = create(sample(grid(-8, 8, 31), grid(-8, 8, 31), flux, 8, 6), &report);
    EXPECT_LT(report.neglected_Wb, 1e-12);
    for (double theta = -4.0; theta < 9.0; theta += 0.37) {
        const double i_d = 3.0 * std::cos(theta) - 2.0, i_q = 7.0 * std::sin(3 * theta);
        const map_point_t m = at(map, i_d, i_q, theta);
        const dq_t psi = flux(i_d, i_q, theta);
        EXPECT_NEAR(m.psi_Wb.d, psi.d, flux_tolerance * psi_m);
        EXPECT_NEAR(m.psi_Wb.q, psi.q, flux_tolerance * psi_m);
        // by hand from the series; polynomials up to the third degree are exact in a spline
        EXPECT_NEAR(m.psi_theta_Wb.d, -6 * b * i_q * std::sin(6 * theta) - 18 * e * std::sin(18 * theta),
                    1e-9);
        const double coenergy_theta = -6 * b * i_d * i_q * std::sin(6 * theta) +
                                      12 * e * (i_q - std::pow(i_q, 3) / 300) * std::cos(12 * theta) -
                                      18 * e * i_d * std::sin(18 * theta);
        EXPECT_NEAR(m.coenergy_theta_J, 1.5 * coenergy_theta, 1e-9);
        const double h = 1e-5;
        const map_point_t p = at(map, i_d, i_q, theta + h), n = at(map, i_d, i_q, theta - h);
        EXPECT_NEAR(m.psi_theta_Wb.q, (p.psi_Wb.q - n.psi_Wb.q) / (2 * h), 1e-7);
        EXPECT_NEAR(m.coenergy_theta_J, (p.coenergy_J - n.coenergy_J) / (2 * h), 1e-6);
        expect_consistent(map, i_d, i_q, theta, 8.0);
        EXPECT_NEAR(at(map, 0.0, 0.0, theta).coenergy_J, 0.0, 1e-14);
        EXPECT_NEAR(at(map, 0.0, 0.0, theta).coenergy_theta_J, 0.0, 1e-12);
    }
}

TEST(MapTable, ReportsHarmonicsThatItLeavesOut)
{
    const double amplitude = 2e-4;
    const Flux flux = [&](double i_d, double i_q, double theta) {
        dq_t psi = ipm_flux(i_d, i_q);
        psi.d += amplitude * std::cos((MAP_HARMONICS + 1) * 6 * theta);
        return psi;
    };
    map_table_report_t report;
    create(sample(grid(-8, 8, 7), grid(-8, 8, 7), flux, 4 * MAP_HARMONICS, 6), &report);
    EXPECT_NEAR(report.neglected_Wb, amplitude, 1e-9);
}

TEST(MapTable, ContinuesSmoothlyBeyondTheGrid)
{
    const Map mean = create(ipm_table(17)),
              ripple = create(sample(grid(-8, 8, 17), grid(-8, 8, 17), rippling(1e-3, 5e-3), 8, 6));
    for (const Map *map : {&mean, &ripple}) {
        for (double i_d = -16.0; i_d <= 16.0; i_d += 1.9) {
            for (double i_q = -16.0; i_q <= 16.0; i_q += 1.7) {
                EXPECT_GT(tangent_min(at(*map, i_d, i_q, 0.2 * i_d)), 5e-3) << i_d << " " << i_q;
                expect_consistent(*map, i_d, i_q, 0.2 * i_d, 8.0);
            }
        }
    }
    for (const double far : {1e3, 1e6, 1e12}) {
        for (double angle = 0.0; angle < 6.3; angle += 0.4) {
            const map_point_t m = at(mean, far * std::cos(angle), far * std::sin(angle));
            EXPECT_GT(tangent_min(m), 5e-3);
            EXPECT_LT(m.L_d_H + m.L_q_H, 0.2);
            EXPECT_TRUE(std::isfinite(m.coenergy_J));
        }
    }
    // just beyond, the map is still close to the machine; half the grid's range on it has an honest slope
    EXPECT_NEAR(at(mean, 8.5, 0.0).psi_Wb.d, ipm_flux(8.5, 0.0).d, 0.005 * psi_m);
    EXPECT_NEAR(at(mean, 0.0, 12.0).psi_Wb.q, ipm_flux(0.0, 12.0).q, 0.25 * psi_m);
}

TEST(MapTable, TakesNodesWithKnownDerivatives)
{
    // W' / 1.5 = 0.2 i_d + L_d i_d^2/2 + L_q i_q^2/2 - k i_d i_q^2/2 + m i_d^2 i_q^2/4: a patch is exact
    const double L_d = 0.02, L_q = 0.05, k = 2e-3, m = 4e-4;
    const std::vector<double> d = grid(-4, 3, 4), q = grid(-3, 5, 5);
    std::vector<map_node_t> nodes;
    for (const double x : d) {
        for (const double y : q) {
            nodes.push_back(
                {0.2 * x + L_d * x * x / 2 + L_q * y * y / 2 - k * x * y * y / 2 + m * x * x * y * y / 4,
                 0.2 + L_d * x - k * y * y / 2 + m * x * y * y / 2, L_q * y - k * x * y + m * x * x * y / 2,
                 L_d + m * y * y / 2, -k * y + m * x * y, L_q - k * x + m * x * x / 2, m * y, -k + m * x, m});
        }
    }
    map_table_report_t report;
    const char *error = nullptr;
    const Map map(map_table_from_nodes(4, 5, d.data(), q.data(), nodes.data(), &report, &error));
    ASSERT_TRUE(map) << error;
    for (double x = -3.9; x < 3.0; x += 0.6) {
        for (double y = -2.9; y < 5.0; y += 0.7) {
            const map_point_t p = at(map, x, y);
            EXPECT_NEAR(p.psi_Wb.d, 0.2 + L_d * x - k * y * y / 2 + m * x * y * y / 2, 1e-15);
            EXPECT_NEAR(p.psi_Wb.q, L_q * y - k * x * y + m * x * x * y / 2, 1e-15);
            EXPECT_NEAR(p.L_dq_H, -k * y + m * x * y, 1e-15);
        }
    }
    nodes[7].ddqq = not_a_number;
    EXPECT_FALSE(map_table_from_nodes(4, 5, d.data(), q.data(), nodes.data(), &report, &error));
    EXPECT_THAT(error, HasSubstr("a value of a node is not finite"));
}

std::string refusal(const Table &table)
{
    std::string message;
    EXPECT_FALSE(create(table, nullptr, &message));
    return message;
}

TEST(MapTable, RefusesWhatMakesNoSense)
{
    const Table good = ipm_table(5);
    const auto with = [&](auto change) {
        Table table = good;
        change(table);
        return refusal(table);
    };
    EXPECT_THAT(refusal(sample(grid(-8, 8, 3), grid(-8, 8, 5), ipm_flux)), HasSubstr("at least 4 values"));
    EXPECT_THAT(refusal(sample(grid(-8, 8, 5), grid(-8, 8, 3), ipm_flux)), HasSubstr("at least 4 values"));
    EXPECT_THAT(refusal(sample(grid(0, 8, 4097), grid(-8, 8, 4), [](auto...) { return dq_t{}; })),
                HasSubstr("at most 4096"));
    EXPECT_THAT(with([](Table &t) { t.i_d[2] = t.i_d[1]; }), HasSubstr("do not ascend"));
    EXPECT_THAT(with([](Table &t) { std::swap(t.i_q[2], t.i_q[1]); }), HasSubstr("do not ascend"));
    EXPECT_THAT(with([](Table &t) { t.i_q[4] = infinity; }), HasSubstr("current of the grid is not finite"));
    EXPECT_THAT(with([](Table &t) { t.psi_q[3] = not_a_number; }), HasSubstr("a flux is not finite"));
    EXPECT_THAT(with([](Table &t) { t.psi_d[24] = infinity; }), HasSubstr("a flux is not finite"));
    EXPECT_THAT(with([](Table &t) { t.count_theta = -1; }), HasSubstr("number of angles"));
    EXPECT_THAT(with([](Table &t) { t.count_theta = 5, t.theta_order = 0; }), HasSubstr("number of angles"));
    EXPECT_THAT(with([](Table &t) { t.psi_d.swap(t.psi_q); }), HasSubstr("not positive definite"));
    EXPECT_THAT(with([](Table &t) { t.psi_q[13] *= 1e300; }), HasSubstr("not positive definite"));
    EXPECT_THAT(with([](Table &t) { t.psi_d[12] = 1e308; }), HasSubstr("not positive definite"));
}

// --- data of real machines ---

std::string data_file(const std::string &name)
{
    const char *folder = std::getenv("PMDRIVE_DATA");
    const std::filesystem::path path =
        std::filesystem::path(folder != nullptr ? folder : "../shared/data") / name;
    return std::filesystem::exists(path) ? path.string() : "";
}

#define NEED(path)                                                                                           \
    if ((path).empty()) {                                                                                    \
        GTEST_SKIP() << "no data of real machines: set PMDRIVE_DATA to their folder";                        \
    }

Table read(const std::string &path, int theta_order)
{
    Table table;
    std::ifstream in(path);
    std::string line;
    std::getline(in, line);
    const bool has_theta = line.find("theta_e_deg") != std::string::npos;
    while (std::getline(in, line)) {
        std::replace(line.begin(), line.end(), ',', ' ');
        std::istringstream words(line);
        double i_d, i_q, theta, psi_d, psi_q, torque;
        words >> i_d >> i_q;
        if (has_theta) {
            words >> theta;
        }
        words >> psi_d >> psi_q >> torque;
        if (table.i_d.empty() || i_d > table.i_d.back()) {
            table.i_d.push_back(i_d);
        }
        if (table.i_d.size() == 1 && (table.i_q.empty() || i_q > table.i_q.back())) {
            table.i_q.push_back(i_q);
        }
        table.psi_d.push_back(psi_d);
        table.psi_q.push_back(psi_q);
        table.torque.push_back(torque);
    }
    table.count_theta = int(table.psi_d.size() / (table.i_d.size() * table.i_q.size()));
    table.theta_order = theta_order;
    return table;
}

struct Deviation {
    double flux_Wb = 0.0, torque_rms_Nm = 0.0, torque_max_Nm = 0.0;
};

// At the nodes: flux against the data, 1.5 P (psi x i + dW'/dtheta) against the torque column.
Deviation deviation(const Map &map, const Table &t, double pole_pairs)
{
    Deviation worst;
    double sum = 0.0;
    for (size_t i = 0; i < t.i_d.size(); ++i) {
        for (size_t j = 0; j < t.i_q.size(); ++j) {
            for (int n = 0; n < t.count_theta; ++n) {
                const map_point_t m = at(map, t.i_d[i], t.i_q[j], t.angle(n));
                const size_t row = t.row(i, j, n);
                worst.flux_Wb = std::max({worst.flux_Wb, std::fabs(m.psi_Wb.d - t.psi_d[row]),
                                          std::fabs(m.psi_Wb.q - t.psi_q[row])});
                const double torque =
                    pole_pairs * (1.5 * (m.psi_Wb.d * t.i_q[j] - m.psi_Wb.q * t.i_d[i]) + m.coenergy_theta_J);
                sum += std::pow(torque - t.torque[row], 2);
                worst.torque_max_Nm = std::max(worst.torque_max_Nm, std::fabs(torque - t.torque[row]));
            }
        }
    }
    worst.torque_rms_Nm = std::sqrt(sum / double(t.torque.size()));
    return worst;
}

void print(const char *name, const map_table_report_t &r, const Deviation &d)
{
    std::printf(
        "%s: reciprocity %.2f %%, moved %.3g mVs, L_min %.3g mH, neglected %.3g mVs; torque %.3g Nm rms, "
        "%.3g Nm\n",
        name, 100 * r.reciprocity, 1e3 * r.moved_Wb, 1e3 * r.L_min_H, 1e3 * r.neglected_Wb, d.torque_rms_Nm,
        d.torque_max_Nm);
}

TEST(MapTableData, Thor)
{
    const std::string path = data_file("thor_pmsyrm_fea_pm.csv");
    NEED(path);
    const Table table = read(path, 1);
    map_table_report_t report;
    const Map map = create(table, &report);
    const Deviation found = deviation(map, table, 2);
    print("THOR", report, found);
    EXPECT_NEAR(report.reciprocity, 0.010, 0.004);
    EXPECT_LE(found.flux_Wb, report.moved_Wb + 1e-12);
    EXPECT_LT(report.moved_Wb, 1.5e-3);   // 0.3 % of full flux
    EXPECT_LT(found.torque_max_Nm, 0.06); // of 117 Nm
    // Figures of the data's README; the saturation of the ribs falls between the first nodes beside zero
    // current, where the secants are 4.6 and 8.1 mH.
    EXPECT_NEAR(at(map, 0.0, 0.0).psi_Wb.d, 0.1334, report.moved_Wb);
    EXPECT_GT(at(map, 0.0, 0.0).L_d_H, 4.6e-3);
    EXPECT_LT(at(map, 0.0, 0.0).L_d_H, 8.1e-3);
    EXPECT_NEAR(at(map, 0.0, 0.0).L_q_H, 34.7e-3, 1.5e-3);
}

TEST(MapTableData, ThorOverTheAngle)
{
    const std::string path = data_file("thor_pmsyrm_fea_pm_theta60.csv");
    NEED(path);
    const Table table = read(path, 6);
    map_table_report_t report;
    const Map map = create(table, &report);
    const Deviation found = deviation(map, table, 2);
    print("THOR over the angle", report, found);
    EXPECT_LE(found.flux_Wb, report.moved_Wb + report.neglected_Wb);
    EXPECT_LT(report.neglected_Wb, 2e-4);
    EXPECT_LT(found.torque_rms_Nm, 0.3); // with its ripple of 13 Nm, from the co-energy alone
    EXPECT_LT(found.torque_max_Nm, 1.0);
}

TEST(MapTableData, Pm270)
{
    const std::string path = data_file("pm270l8_ipm_fea.csv");
    NEED(path);
    const Table table = read(path, 1);
    map_table_report_t report;
    const Map map = create(table, &report);
    const Deviation found = deviation(map, table, 4);
    print("PM270", report, found);
    EXPECT_LE(found.flux_Wb, report.moved_Wb + 1e-12);
    EXPECT_LT(found.torque_max_Nm, 2.5); // of 403 Nm, on six nodes a side
    EXPECT_NEAR(at(map, 0.0, 0.0).psi_Wb.d, 0.1618, 1e-3);
}

} // namespace
