// Tables of the closed form reference::RootMap.
#ifndef TESTS_UNIT_SIM_PLANT_ROOT_TABLE_H
#define TESTS_UNIT_SIM_PLANT_ROOT_TABLE_H

#include "rig.h"
#include "sim_plant/map_table.h"
#include "tests/reference/flux_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

namespace validation
{

// The closed form RootMap as the plant takes it: as data, or node by node.
constexpr double grid_step_A = 0.4;
constexpr int grid_count = 41; // -8 to 8 A, twice the rated current

inline std::vector<double> grid()
{
    std::vector<double> i_A;
    for (int k = 0; k < grid_count; k++) {
        i_A.push_back(grid_step_A * (k - grid_count / 2));
    }
    return i_A;
}

using Table = std::unique_ptr<map_table_t, void (*)(map_table_t *)>;

// Flux alone, as a table read from a file; with angles, over so many of them in a sixth of a turn.
inline Table table_of(const reference::FluxMap &map, int angles = 1)
{
    std::vector<double> i_A = grid();
    std::vector<double> psi_d, psi_q;
    for (double d : i_A) {
        for (double q : i_A) {
            for (int n = 0; n < angles; n++) {
                reference::FluxPoint p = map({d, q}, n * (rig::pi / 3.0) / angles);
                psi_d.push_back(p.psi_Wb(0));
                psi_q.push_back(p.psi_Wb(1));
            }
        }
    }
    map_table_data_t data{};
    data.count_d = data.count_q = grid_count;
    data.count_theta = angles;
    data.theta_order = 6;
    data.i_d_A = data.i_q_A = i_A.data();
    data.psi_d_Wb = psi_d.data();
    data.psi_q_Wb = psi_q.data();
    map_table_report_t deviation;
    const char *error = nullptr;
    Table table(map_table_create(&data, &deviation, &error), &map_table_destroy);
    EXPECT_NE(table, nullptr) << error;
    return table;
}

// Third and fourth derivatives of U, which FluxPoint does not carry.
inline map_node_t node_of(const reference::RootMap &map, double d, double q)
{
    reference::FluxPoint p = map({d, q}, 0.0);
    double u = (d + map.i_f_A) / map.I_d_A;
    double w = q / map.I_q_A;
    double s = std::sqrt(1.0 + u * u + w * w);
    double s3 = 1.0 / (s * s * s), s5 = s3 / (s * s), s7 = s5 / (s * s);
    double unit_ddq = map.K_J / (map.I_d_A * map.I_d_A * map.I_q_A);
    map_node_t node{};
    node.W = map.coenergy_J({d, q});
    node.d = p.psi_Wb(0);
    node.q = p.psi_Wb(1);
    node.dd = p.L_H(0, 0);
    node.dq = p.L_H(0, 1);
    node.qq = p.L_H(1, 1);
    node.ddq = unit_ddq * w * (2.0 * s3 - 3.0 * (1.0 + w * w) * s5);
    node.dqq = unit_ddq * map.I_d_A / map.I_q_A * u * (2.0 * s3 - 3.0 * (1.0 + u * u) * s5);
    node.ddqq =
        unit_ddq / map.I_q_A *
        (2.0 * s3 - 6.0 * w * w * s5 - 3.0 * (1.0 + 3.0 * w * w) * s5 + 15.0 * w * w * (1.0 + w * w) * s7);
    return node;
}

inline Table nodes_of(const reference::RootMap &map)
{
    std::vector<double> i_A = grid();
    std::vector<map_node_t> nodes;
    for (double d : i_A) {
        for (double q : i_A) {
            nodes.push_back(node_of(map, d, q));
        }
    }
    map_table_report_t deviation;
    const char *error = nullptr;
    Table table(map_table_from_nodes(grid_count, grid_count, i_A.data(), i_A.data(), nodes.data(), &deviation,
                                     &error),
                &map_table_destroy);
    EXPECT_NE(table, nullptr) << error;
    return table;
}

} // namespace validation

#endif
