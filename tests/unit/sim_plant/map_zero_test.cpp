// map_zero.h: psi_0 of a table against the formula it was sampled from, in the neutral of a star, and in an
// open winding against the same zero sequence made by the windings.
#include "sim_plant/map_zero.h"
#include "tests/unit/sim_plant/validation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <vector>

namespace validation
{
namespace
{

// The spline is exact for quadratics along each axis, the series for its harmonics: rounding.
constexpr double rounding = 1e-12;

struct MapDestroy {
    void operator()(map_table_t *map) const
    {
        map_table_destroy(map);
    }
};

using Flux = std::function<double(double i_d_A, double i_q_A, double theta)>;

// The flux over -12 ... 12 A and one period of `order` in a turn.
class ZeroTable
{
  public:
    ZeroTable(const Flux &psi_d, const Flux &psi_q, const Flux &psi_0, int order, int angles)
    {
        for (int k = 0; k < count; k++) {
            grid_[k] = 24.0 * k / (count - 1) - 12.0;
        }
        for (int k = 0; k < count * count * angles; k++) {
            double i_d = grid_[k / angles / count], i_q = grid_[k / angles % count];
            double theta = 2.0 * rig::pi / order * (k % angles) / angles;
            d_.push_back(psi_d(i_d, i_q, theta));
            q_.push_back(psi_q(i_d, i_q, theta));
            zero_.push_back(psi_0(i_d, i_q, theta));
        }
        data_ = {count, count, angles, order, grid_, grid_, d_.data(), q_.data()};
        const char *error = nullptr;
        map_.reset(map_table_create(&data_, &report_, &error));
        EXPECT_NE(map_, nullptr) << error;
        EXPECT_FALSE(map_zero_given(map_.get()));
        EXPECT_TRUE(map_zero_add(map_.get(), &data_, zero_.data(), &error)) << error;
        EXPECT_TRUE(map_zero_given(map_.get()));
    }

    const map_table_t *get() const
    {
        return map_.get();
    }

  private:
    static constexpr int count = 9;
    double grid_[count];
    std::vector<double> d_, q_, zero_;
    map_table_data_t data_{};
    map_table_report_t report_{};
    std::unique_ptr<map_table_t, MapDestroy> map_;
};

// A salient machine without harmonics, of psi_m, L_d, L_q.
double linear_d(double i_d, double, double)
{
    return 0.1 + 4e-3 * i_d;
}

double linear_q(double, double i_q, double)
{
    return 6e-3 * i_q;
}

// Orders 3 and 9, as psi_0 has them: its sign changes after 60 degrees. Saturates.
double psi_0(double i_d, double i_q, double x)
{
    return (7e-3 + 2e-4 * i_d + 1e-5 * i_q * i_q) * std::cos(3 * x) +
           (3e-4 * i_q + 1e-5 * i_d * i_q) * std::sin(3 * x) +
           (1e-3 - 2e-5 * i_d * i_d) * std::cos(9 * x + 0.3);
}

TEST(MapZero, FollowsItsData)
{
    struct Case {
        int order, angles;
    };
    for (Case c : {Case{6, 8}, Case{3, 16}, Case{2, 24}, Case{1, 48}}) {
        ZeroTable table(linear_d, linear_q, psi_0, c.order, c.angles);
        for (double theta : {-2.0, 0.0, 0.4, 1.3, 3.0, 5.5}) {
            for (double i_d : {-11.0, -2.3, 0.0, 7.7}) {
                for (double i_q : {-8.1, 0.0, 4.4}) {
                    auto by = [&](int d, int q, int t) { // central differences, exact for quadratics
                        double h = 1e-3, w = 1e-5;
                        auto f = [&](double a, double b, double x) {
                            return psi_0(i_d + a, i_q + b, theta + x);
                        };
                        auto along_t = [&](double a, double b) {
                            return t == 0 ? f(a, b, 0) : (f(a, b, w) - f(a, b, -w)) / (2 * w);
                        };
                        auto along_q = [&](double a) {
                            return q == 0   ? along_t(a, 0)
                                   : q == 1 ? (along_t(a, h) - along_t(a, -h)) / (2 * h)
                                            : (along_t(a, h) - 2 * along_t(a, 0) + along_t(a, -h)) / (h * h);
                        };
                        return d == 0   ? along_q(0)
                               : d == 1 ? (along_q(h) - along_q(-h)) / (2 * h)
                                        : (along_q(h) - 2 * along_q(0) + along_q(-h)) / (h * h);
                    };
                    map_zero_t z;
                    map_zero_eval(table.get(), {i_d, i_q}, theta, &z);
                    EXPECT_NEAR(z.psi_Wb, psi_0(i_d, i_q, theta), rounding);
                    EXPECT_NEAR(z.d_H, by(1, 0, 0), rounding);
                    EXPECT_NEAR(z.q_H, by(0, 1, 0), rounding);
                    EXPECT_NEAR(z.dd_H_A, by(2, 0, 0), 1e-10);
                    EXPECT_NEAR(z.dq_H_A, by(1, 1, 0), 1e-10);
                    EXPECT_NEAR(z.qq_H_A, by(0, 2, 0), 1e-10);
                    EXPECT_NEAR(z.theta_Wb, by(0, 0, 1), 1e-9);
                    EXPECT_NEAR(z.d_theta_H, by(1, 0, 1), 1e-8);
                    EXPECT_NEAR(z.q_theta_H, by(0, 1, 1), 1e-8);
                }
            }
        }
    }
}

TEST(MapZero, RefusesWhatMakesNoSense)
{
    double grid[4] = {-1, 0, 1, 2}, d[16], q[16];
    for (int k = 0; k < 16; k++) {
        d[k] = grid[k / 4];
        q[k] = grid[k % 4];
    }
    map_table_data_t data = {4, 4, 1, 1, grid, grid, d, q};
    map_table_report_t report;
    const char *error = nullptr;
    std::unique_ptr<map_table_t, MapDestroy> map(map_table_create(&data, &report, &error));
    ASSERT_NE(map, nullptr) << error;
    EXPECT_FALSE(map_zero_add(map.get(), &data, d, &error));
    EXPECT_STREQ(error, "psi_0 needs angles: its mean over a turn is nothing");
    EXPECT_FALSE(map_zero_given(map.get()));
    EXPECT_FALSE(map_zero_given(nullptr));
}

plant_config_t machine_with(const map_table_t *map)
{
    plant_config_t c = ideal(0.5, 4e-3, 6e-3, 0.1, 4, 100.0);
    c.map = map;
    c.tolerance = 1e-9;
    return c;
}

// In a star psi_0 carries no current: v_0 = dpsi_0/dt along the way that currents and angle take.
TEST(MapZero, IsTheZeroSequenceVoltageOfAStar)
{
    ZeroTable table(linear_d, linear_q, psi_0, 6, 8);
    for (int sets : {1, 2}) {
        plant_config_t config = machine_with(table.get());
        config.winding.sets = sets;
        config.winding.emf[0] = {3, 2e-3, 0.0}; // beside it
        rig::Plant plant(config, 0.3);
        plant_set_speed(plant, 50.0);
        const double h = 1e-6;
        double worst_V = 0.0, most_V = 0.0;
        auto linkage = [&](const plant_truth_t &t, int set) {
            double own = t.theta_e_rad - rig::pi / 6 * set;
            Complex i = 0.0;
            for (int k = 0; k < 3; k++) {
                i += 2.0 / 3.0 * t.i_A[3 * set + k] * std::polar(1.0, 2.0 * rig::pi / 3.0 * k);
            }
            i *= std::polar(1.0, -own);
            EXPECT_LT(std::max(std::fabs(i.real()), std::fabs(i.imag())), 12.0) << "within the data";
            return psi_0(i.real(), i.imag(), own) + 2e-3 * std::cos(3 * own);
        };
        for (int n = 0; n < 75; n++) {
            Legs v = legs(std::polar(18.0, 0.05 * n));
            for (int k = 0; k < 3 && sets == 2; k++) {
                v[static_cast<size_t>(3 + k)] = 0.5 * v[static_cast<size_t>(k)];
            }
            hold(plant, v, 1e-4);
            plant_truth_t before = plant.truth();
            hold(plant, v, h);
            plant_truth_t here = plant.truth();
            hold(plant, v, h);
            plant_truth_t after = plant.truth();
            for (int set = 0; set < sets; set++) {
                double expected_V = (linkage(after, set) - linkage(before, set)) / (2 * h);
                worst_V = std::max(worst_V, std::fabs(here.v_zero_V[set] - expected_V));
                most_V = std::max(most_V, std::fabs(expected_V));
                double mean_V = (v[static_cast<size_t>(3 * set)] + v[static_cast<size_t>(3 * set + 1)] +
                                 v[static_cast<size_t>(3 * set + 2)]) /
                                3.0;
                EXPECT_NEAR(here.v_neutral_V[set], mean_V - here.v_zero_V[set], 1e-9);
            }
        }
        EXPECT_GT(most_V, 3.0);
        EXPECT_LT(worst_V, 1e-5 * most_V); // of differences over a microsecond
    }
}

// A table of a linear machine with the psi_0 of METHODS.md E3 is the winding with dL_0, L_c0 and a third
// harmonic.
TEST(MapZero, IsReciprocalInAnOpenWinding)
{
    constexpr double dL_0 = 1e-3, L_c0 = 0.3e-3, psi_3 = 5e-3;
    ZeroTable table(
        linear_d, linear_q,
        [](double i_d, double i_q, double x) {
            return psi_3 * std::cos(3 * x) - 0.5 * dL_0 * (i_d * std::cos(3 * x) - i_q * std::sin(3 * x)) -
                   0.5 * L_c0 * (i_d * std::sin(3 * x) + i_q * std::cos(3 * x));
        },
        6, 8);
    plant_config_t of_table = machine_with(table.get()), of_winding = machine_with(nullptr);
    of_winding.winding.dL_0_H = dL_0;
    of_winding.winding.L_c0_H = L_c0;
    of_winding.winding.emf[0] = {3, psi_3, 0.0};
    for (plant_config_t *c : {&of_table, &of_winding}) {
        c->winding.connection = PLANT_OPEN;
        c->winding.L_0_H = 2e-3;
        c->mech.J_kgm2 = 1e-4;
    }
    rig::Plant one(of_table, 0.3), other(of_winding, 0.3);
    double zero_A = 0.0;
    for (int n = 0; n < 2000; n++) {
        Legs v = legs(std::polar(8.0, 0.02 * n));
        for (size_t k = 0; k < 3; k++) {
            v[k] += 2.0 * std::sin(0.05 * n); // drives i_0 too
        }
        hold(one, v, 1e-4);
        hold(other, v, 1e-4);
        plant_truth_t a = one.truth(), b = other.truth();
        for (int k = 0; k < 6; k++) {
            ASSERT_NEAR(a.i_A[k], b.i_A[k], 1e-5) << n << " " << k;
        }
        ASSERT_NEAR(a.torque_Nm, b.torque_Nm, 1e-5) << n;
        ASSERT_NEAR(a.theta_e_rad, b.theta_e_rad, 1e-5) << n;
        zero_A = std::max(zero_A, std::fabs(a.i_A[0] + a.i_A[1] + a.i_A[2]) / 3.0);
    }
    EXPECT_GT(zero_A, 0.5);
}

// One that saturates: no energy comes from nowhere.
TEST(MapZero, BalancesEnergyWhenItSaturates)
{
    ZeroTable table(linear_d, linear_q, psi_0, 6, 8);
    plant_config_t config = machine_with(table.get());
    config.winding.connection = PLANT_OPEN;
    config.winding.L_0_H = 2e-3;
    config.mech.J_kgm2 = 1e-4;
    rig::Plant plant(config, 0.3);
    plant_truth_t start = plant.truth(), before = start;
    double zero_A = 0.0, in_J = 0.0, throughput_J = 0.0;
    for (int n = 0; n < 4000; n++) {
        Legs v = legs(std::polar(8.0, 0.01 * n));
        for (size_t k = 0; k < 3; k++) {
            v[k] += 2.0 * std::sin(0.03 * n);
        }
        hold(plant, v, 2e-5);
        plant_truth_t t = plant.truth();
        for (int k = 0; k < 3; k++) { // straight currents: 1e-6 of their change
            double by_phase_J = v[static_cast<size_t>(k)] * 0.5 * (before.i_A[k] + t.i_A[k]) * 2e-5;
            in_J += by_phase_J;
            throughput_J += std::fabs(by_phase_J);
        }
        before = t;
        zero_A = std::max(zero_A, std::fabs(t.i_A[0] + t.i_A[1] + t.i_A[2]) / 3.0);
    }
    double out_J = before.e_copper_J - start.e_copper_J + before.e_mech_J - start.e_mech_J +
                   before.e_field_J - start.e_field_J;
    EXPECT_GT(zero_A, 0.5);
    EXPECT_NEAR(in_J / throughput_J, out_J / throughput_J, 1e-5);
}

TEST(MapZero, EddyCircuitsOfAnOpenWindingAreRefused)
{
    ZeroTable table(linear_d, linear_q, psi_0, 6, 8);
    plant_config_t config = machine_with(table.get());
    config.winding.L_0_H = 2e-3;
    config.winding.L_eddy_d_H = 10e-3;
    config.winding.R_eddy_ohm = 5.0;
    const char *reason = nullptr;
    plant_destroy(plant_create(&config, 0.0, &reason));
    EXPECT_EQ(reason, nullptr);
    config.winding.connection = PLANT_OPEN;
    EXPECT_EQ(plant_create(&config, 0.0, &reason), nullptr);
    EXPECT_STREQ(reason,
                 "winding.L_eddy_d_H and L_eddy_q_H cannot stand beside psi_0 of a table in an open winding");
}

} // namespace
} // namespace validation
