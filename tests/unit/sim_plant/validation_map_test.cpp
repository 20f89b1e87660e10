// Flux maps: the plant with a table and with a closed form against independent machines, and its torque
// against virtual work.
#include "beside_reference.h"
#include "root_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace validation
{
namespace
{

using reference::measured;

class Map : public ::testing::TestWithParam<Speed>
{
};
INSTANTIATE_TEST_SUITE_P(Speeds, Map, ::testing::Values(Speed::imposed, Speed::free),
                         [](const auto &speed) { return std::string(name(speed.param)); });

// The interpolation taken as the machine: what is left is the solution of the equations.
reference::CurrentMap interpolation(const map_table_t *table)
{
    return reference::inverse(reference::FluxMap([table](const Eigen::Vector2d &i_A, double theta_e_rad) {
        map_point_t at;
        map_table_eval(table, {i_A(0), i_A(1)}, theta_e_rad, &at);
        reference::FluxPoint p;
        p.psi_Wb << at.psi_Wb.d, at.psi_Wb.q;
        p.L_H << at.L_d_H, at.L_dq_H, at.L_dq_H, at.L_q_H;
        p.psi_theta_Wb << at.psi_theta_Wb.d, at.psi_theta_Wb.q;
        p.coenergy_theta_J = at.coenergy_theta_J;
        return p;
    }));
}

plant_config_t with_map(const map_table_t *table)
{
    plant_config_t config = ipm_linear(); // the drive of the test uses its constants
    config.map = table;
    return config;
}

TEST_P(Map, Table)
{
    reference::RootMap map;
    Table table = table_of(map);
    double psi_m_Wb = map({0.0, 0.0}, 0.0).psi_Wb(0);
    report(std::string("ode_table_") + name(GetParam()),
           in_dq(with_map(table.get()), interpolation(table.get()), psi_m_Wb, GetParam()), ipm_rated_A, "E1");
}

// Against the closed form itself, so that the interpolation counts too.
TEST_P(Map, TableOfAClosedForm)
{
    reference::RootMap map;
    Table table = table_of(map);
    report(std::string("ode_table_closed_form_") + name(GetParam()),
           in_dq(with_map(table.get()), reference::inverse(reference::FluxMap(map)),
                 map({0.0, 0.0}, 0.0).psi_Wb(0), GetParam()),
           ipm_rated_A, "E1");
}

TEST_P(Map, ClosedForm)
{
    reference::RootMap map;
    Table table = nodes_of(map);
    report(std::string("ode_closed_form_") + name(GetParam()),
           in_dq(with_map(table.get()), reference::inverse(reference::FluxMap(map)),
                 map({0.0, 0.0}, 0.0).psi_Wb(0), GetParam()),
           ipm_rated_A, "E1");
}

// RootMap with a sixth harmonic in inductances and magnet flux: W'/1.5 = U + r(i) cos 6 theta.
struct RippleMap {
    reference::RootMap mean;
    double L_d_H = 2e-3, L_q_H = 4e-3, psi_Wb = 5e-3;

    double coenergy_J(const Eigen::Vector2d &i, double theta) const
    {
        double ripple = 0.5 * (L_d_H * i(0) * i(0) + L_q_H * i(1) * i(1)) + psi_Wb * i(0);
        return 1.5 * (mean.coenergy_J(i) + ripple * std::cos(6.0 * theta));
    }

    reference::FluxPoint operator()(const Eigen::Vector2d &i, double theta) const
    {
        reference::FluxPoint p = mean(i, theta);
        p.psi_Wb += Eigen::Vector2d(L_d_H * i(0) + psi_Wb, L_q_H * i(1)) * std::cos(6.0 * theta);
        return p;
    }
};

// Virtual work: derivative of the co-energy by the rotor angle while the phase currents stay.
template <class Coenergy> double virtual_work_Nm(const Coenergy &coenergy, const plant_truth_t &t)
{
    constexpr double h_rad = 1e-4;
    double W_J[2];
    for (int side = 0; side < 2; side++) {
        double theta = t.theta_e_rad + (side == 0 ? -h_rad : h_rad);
        Complex i_A = current(t) * std::polar(1.0, -theta);
        W_J[side] = coenergy(Eigen::Vector2d(i_A.real(), i_A.imag()), theta);
    }
    return 3.0 * (W_J[1] - W_J[0]) / (2.0 * h_rad); // three pole pairs
}

struct Torque {
    double work_Nm = 0.0, product_Nm = 0.0; // worst deviation from virtual work and from 1.5 P (psi x i)
};

template <class Coenergy> Torque torque_of(const map_table_t *table, const Coenergy &coenergy)
{
    plant_config_t config = with_map(table);
    rig::Plant plant(config, 0.2);
    plant_set_speed(plant, 50.0);
    Torque worst;
    for (int n = 0; n < 2000; n++) {
        Complex v_dq_V(-30.0 + 20.0 * std::sin(0.01 * n), 36.0 + 25.0 * std::cos(0.023 * n));
        hold(plant, legs(v_dq_V * std::polar(1.0, 0.2 + 150.0 * (n + 0.5) * 50e-6)), 50e-6);
        plant_truth_t t = plant.truth();
        double product_Nm = 4.5 * (t.psi_d_Wb * t.i_q_A - t.psi_q_Wb * t.i_d_A);
        worst.work_Nm = std::max(worst.work_Nm, std::fabs(t.torque_Nm - virtual_work_Nm(coenergy, t)));
        worst.product_Nm = std::max(worst.product_Nm, std::fabs(t.torque_Nm - product_Nm));
    }
    return worst;
}

constexpr double rated_Nm = 4.0;
constexpr double bound_torque = 5e-3; // issue: 0.5 %

TEST(Torque, TableAgainstVirtualWork)
{
    reference::RootMap map;
    Table table = table_of(map);
    Torque worst =
        torque_of(table.get(), [&](const Eigen::Vector2d &i_A, double) { return 1.5 * map.coenergy_J(i_A); });
    measured("torque_table_coenergy", worst.work_Nm / rated_Nm, bound_torque, "of_rated", "1.3.1.3");
    measured("torque_table_product", worst.product_Nm / rated_Nm, bound_torque, "of_rated", "1.3.1.3");
}

// Where the map depends on the angle the product alone is not the torque.
TEST(Torque, TableOverAngleAgainstVirtualWork)
{
    RippleMap map;
    Table table = table_of(map, 24);
    Torque worst = torque_of(
        table.get(), [&](const Eigen::Vector2d &i_A, double theta) { return map.coenergy_J(i_A, theta); });
    measured("torque_table_angle_coenergy", worst.work_Nm / rated_Nm, bound_torque, "of_rated", "1.3.1.3");
    EXPECT_GT(worst.product_Nm, 10.0 * bound_torque * rated_Nm);
}

} // namespace
} // namespace validation
