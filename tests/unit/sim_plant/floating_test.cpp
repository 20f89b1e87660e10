// floating.h: legs without current take the voltage that keeps them so, in every connection, and the
// projection onto zero current moves only the flux that those legs can move.
extern "C" {
#include "sim_plant/floating.h"
}

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace
{

constexpr double v_dc = 300.0, omega_e = 400.0;
// An elimination of six equations of some 1e4 A/s: rounding.
constexpr double slope_A_s = 1e-7;
constexpr double small_A = 1e-11;

enum Machine { plain_star, salient_star, eddy_star, two_sets, two_linked_sets, open_winding };

struct Case {
    const char *name;
    Machine machine;
    std::vector<int> floating;
};

plant_config_t config_of(Machine kind)
{
    plant_config_t c{};
    c.machine = {6.0, 46.3e-3, 76.9e-3, 105.0, 0.236, 3};
    c.inverter.v_diode_V = 0.8;
    c.sensor.i_full_scale_A = 10.0;
    if (kind != plain_star) {
        c.winding.dR_ohm[1] = 0.7;
        c.winding.dL_H[0] = 2e-3;
        c.winding.saliency[0] = {-4, 3e-3, -0.4};
        c.winding.emf[0] = {5, 5e-3, 0.0};
    }
    if (kind == eddy_star) {
        c.winding.L_eddy_d_H = 60e-3;
        c.winding.L_eddy_q_H = 90e-3;
        c.winding.R_eddy_ohm = 30.0;
    }
    if (kind == two_sets || kind == two_linked_sets) {
        c.winding.sets = 2;
    }
    if (kind == two_linked_sets) {
        c.winding.M_d_H = 15e-3;
        c.winding.M_q_H = 25e-3;
    }
    if (kind == open_winding) {
        c.winding.connection = PLANT_OPEN;
        c.winding.L_0_H = 12e-3;
        c.winding.dL_0_H = 6e-3;
        c.winding.emf[1] = {3, 10e-3, 0.0};
    }
    return c;
}

class Floating : public testing::TestWithParam<Case>
{
  protected:
    Floating()
    {
        plant_config_t config = config_of(GetParam().machine);
        machine_set(&machine, &config, 25.0, 25.0);
        w = &machine.winding;
        bridge_init(&bridge, &config, w->legs);
        for (int k = 0; k < w->legs; k++) {
            bridge.leg[k] = k % 2 == 0 ? LEG_HIGH : LEG_LOW;
        }
        for (int k : GetParam().floating) {
            bridge.leg[k] = LEG_FLOATING;
        }
        bridge_summarise(&bridge, w);
        at_random();
    }

    void at_random()
    {
        std::uniform_real_distribution<double> any(-1.0, 1.0);
        double theta = 3.0 * any(random);
        state.theta_e_rad = theta;
        state.rotor = rotor_t{std::cos(theta), std::sin(theta)};
        for (int set = 0; set < w->sets; set++) {
            ab_t u = frame_to_ab(dq_t{0.236 + 0.1 * any(random), 0.2 * any(random)}, state.rotor);
            state.u[2 * set] = u.alpha;
            state.u[2 * set + 1] = u.beta;
        }
        if (w->zero >= 0) {
            state.u[w->zero] = 2.0 * any(random);
        }
        machine_evaluate(&machine, &state, &point);
    }

    double along(int leg, const double x[ACTIVE]) const
    {
        double sum = 0.0;
        for (int a = 0; a < w->active; a++) {
            sum += w->axis[leg][a] * x[a];
        }
        return sum;
    }

    void act(const double v_leg_V[PLANT_LEGS], bool tied_only, double v_V[ACTIVE]) const
    {
        for (int a = 0; a < ACTIVE; a++) {
            v_V[a] = 0.0;
            for (int k = 0; k < w->legs && a < w->active; k++) {
                bool counts = !tied_only || bridge.leg[k] != LEG_FLOATING;
                v_V[a] += counts ? w->share[k][a] * v_leg_V[k] : 0.0;
            }
        }
    }

    // Voltages of all legs, and the rates with them
    void solve()
    {
        for (int k = 0; k < w->legs; k++) {
            v_leg[k] = bridge.leg[k] == LEG_HIGH ? v_dc : 0.0;
        }
        double v_V[ACTIVE];
        act(v_leg, true, v_V);
        floating_voltages(&bridge, &machine, &state, &point, omega_e, v_dc, v_V, v_leg, &rate);
    }

    void make_linear()
    {
        plant_config_t config = config_of(GetParam().machine);
        config.machine.c_A_Wb5 = 0.0;
        machine_set(&machine, &config, 25.0, 25.0);
    }

    // Total flux linkage by coordinates; behind them that of the eddy circuits, which no leg moves: the
    // core's less L_eddy i_e
    Eigen::VectorXd flux() const
    {
        bool eddy = GetParam().machine == eddy_star;
        Eigen::VectorXd psi(w->active + (eddy ? 2 : 0));
        if (eddy) {
            psi(2) = point.core[0].psi_Wb.d - 60e-3 * state.eddy_A[0];
            psi(3) = point.core[0].psi_Wb.q - 90e-3 * state.eddy_A[1];
        }
        winding_point_t added{};
        winding_at(w, state.rotor, w->active, &added);
        for (int a = 0; a < w->active; a++) {
            psi(a) = (a < 2 * w->sets ? state.u[a] : 0.0) + added.psi[a];
            for (int b = 0; b < w->active; b++) {
                psi(a) += added.L[a][b] * point.i_A[b];
            }
        }
        return psi;
    }

    void expect_projected(const Eigen::VectorXd &before_Wb, double bound_Wb) const
    {
        const std::vector<int> &floating = GetParam().floating;
        Eigen::VectorXd moved = flux() - before_Wb;
        Eigen::MatrixXd legs =
            Eigen::MatrixXd::Zero(moved.size(), static_cast<Eigen::Index>(floating.size()));
        for (Eigen::Index column = 0; column < legs.cols(); column++) {
            int leg = floating[static_cast<size_t>(column)];
            EXPECT_NEAR(along(leg, point.i_A), 0.0, small_A) << leg;
            for (int a = 0; a < w->active; a++) {
                legs(a, column) = w->share[leg][a];
            }
        }
        Eigen::VectorXd by = legs.completeOrthogonalDecomposition().solve(moved);
        EXPECT_LT((legs * by - moved).norm(), bound_Wb);
        EXPECT_GT(moved.norm(), 1e-9);
        machine_point_t again;
        machine_evaluate(&machine, &state, &again);
        EXPECT_EQ(again.i_A[0], point.i_A[0]) << "the point is that of the state";
    }

    bool group_is_tied(int leg) const
    {
        for (int k = 0; k < w->legs; k++) {
            bool same = GetParam().machine == open_winding ? k % 3 == leg % 3 : k / 3 == leg / 3;
            if (same && bridge.leg[k] != LEG_FLOATING) {
                return true;
            }
        }
        return false;
    }

    std::mt19937 random{1};
    machine_t machine{};
    const winding_t *w = nullptr;
    bridge_t bridge{};
    machine_state_t state{};
    machine_point_t point{};
    machine_rate_t rate{};
    double v_leg[PLANT_LEGS]{};
};

// Both switches closed: the divider of two r_on, seen from the terminal.
TEST(Bridge, ShootThroughIsADivider)
{
    plant_config_t config{};
    config.inverter.r_on_ohm = 0.1;
    config.sensor.i_full_scale_A = 10.0;
    bridge_t bridge;
    bridge_init(&bridge, &config, 3);
    bridge.leg[1] = LEG_BOTH;
    bridge.upper[1] = 0.5;
    EXPECT_NEAR(bridge_tied_V(&bridge, 1, 4.0, 20.0), (20.0 / 0.1 - 4.0) / (2.0 / 0.1), 1e-12);
}

TEST_P(Floating, VoltagesKeepTheCurrentAsItIs)
{
    double fastest = 0.0;
    for (int n = 0; n < 20; n++) {
        at_random();
        solve();
        double v_V[ACTIVE];
        act(v_leg, false, v_V); // anew from all legs
        machine_rate_t with{};
        machine_rates(&machine, &state, &point, omega_e, v_V, &with);
        for (int k = 0; k < w->legs; k++) {
            fastest = std::fmax(fastest, std::fabs(along(k, with.i_A_s)));
            if (bridge.leg[k] == LEG_FLOATING) {
                EXPECT_NEAR(along(k, with.i_A_s), 0.0, slope_A_s) << k;
            }
        }
        for (int a = 0; a < w->active; a++) {
            EXPECT_NEAR(rate.u[a], with.u[a], slope_A_s) << "the rates are those of the voltages";
            EXPECT_NEAR(rate.i_A_s[a], with.i_A_s[a], slope_A_s);
        }
    }
    EXPECT_TRUE(fastest > 100.0 || GetParam().floating.size() > 1);
}

TEST_P(Floating, FreeGroupsLieEvenlyBetweenTheRails)
{
    solve();
    for (int leg : GetParam().floating) {
        if (group_is_tied(leg)) {
            continue;
        }
        double high = -1e9, low = 1e9;
        for (int k = 0; k < w->legs; k++) {
            bool same = GetParam().machine == open_winding ? k % 3 == leg % 3 : k / 3 == leg / 3;
            high = same ? std::fmax(high, v_leg[k]) : high;
            low = same ? std::fmin(low, v_leg[k]) : low;
        }
        EXPECT_NEAR(high + low, v_dc, 1e-9) << leg;
        EXPECT_GT(high - low, 1e-3) << "an EMF must show";
    }
}

TEST_P(Floating, TiedLegsKeepTheirVoltage)
{
    solve();
    for (int k = 0; k < w->legs; k++) {
        if (bridge.leg[k] != LEG_FLOATING) {
            EXPECT_EQ(v_leg[k], bridge.leg[k] == LEG_HIGH ? v_dc : 0.0);
        }
    }
}

// What moves the currents of the floating legs to zero can only have been those legs' own voltages.
TEST_P(Floating, ProjectionTakesTheCurrentAndOnlyTheFluxOfThoseLegs)
{
    make_linear(); // so that a large jump can be told from an error of second order
    for (int n = 0; n < 20; n++) {
        at_random();
        Eigen::VectorXd before = flux();
        floating_project(&bridge, &machine, small_A, &state, &point);
        expect_projected(before, 1e-13);
    }
}

// After a step of the integrator the currents are small, and what saturation adds is of second order.
TEST_P(Floating, ProjectionOfASmallCurrentInASaturatedMachine)
{
    for (int n = 0; n < 20; n++) {
        at_random();
        floating_project(&bridge, &machine, small_A, &state, &point);
        for (int a = 0; a < 2 * w->sets; a++) {
            state.u[a] += 1e-6;
        }
        machine_evaluate(&machine, &state, &point);
        Eigen::VectorXd before = flux();
        floating_project(&bridge, &machine, small_A, &state, &point);
        expect_projected(before, 1e-11);
    }
}

TEST_P(Floating, ProjectionLeavesNothingToDo)
{
    floating_project(&bridge, &machine, small_A, &state, &point);
    machine_state_t once = state;
    floating_project(&bridge, &machine, small_A, &state, &point);
    for (int a = 0; a < w->active; a++) {
        EXPECT_NEAR(state.u[a], once.u[a], 1e-15);
    }
}

INSTANTIATE_TEST_SUITE_P(
    Connections, Floating,
    testing::Values(
        Case{"plain_star_1", plain_star, {2}}, Case{"plain_star_2", plain_star, {0, 2}},
        Case{"plain_star_3", plain_star, {0, 1, 2}}, Case{"salient_star_1", salient_star, {1}},
        Case{"salient_star_2", salient_star, {0, 1}}, Case{"salient_star_3", salient_star, {0, 1, 2}},
        Case{"eddy_star_1", eddy_star, {1}}, Case{"eddy_star_3", eddy_star, {0, 1, 2}},
        Case{"two_sets_of_different_kind", two_sets, {0, 4, 5}},
        Case{"two_sets_one_free", two_sets, {3, 4, 5}}, Case{"two_linked_sets_1", two_linked_sets, {5}},
        Case{"two_linked_sets_2", two_linked_sets, {1, 3}},
        Case{"two_linked_sets_one_free", two_linked_sets, {0, 1, 2}},
        Case{"two_linked_sets_all", two_linked_sets, {0, 1, 2, 3, 4, 5}}, Case{"open_1", open_winding, {4}},
        Case{"open_both_ends", open_winding, {1, 4}}, Case{"open_two_phases", open_winding, {0, 4, 5}},
        Case{"open_one_side", open_winding, {3, 4, 5}}, Case{"open_all", open_winding, {0, 1, 2, 3, 4, 5}}),
    [](const testing::TestParamInfo<Case> &test) { return test.param.name; });

// A linear round machine: the open terminal is at the star point plus its EMF.
TEST(FloatingVoltage, OfALinearStarIsStarPointAndEmf)
{
    plant_config_t config = config_of(plain_star);
    config.machine = {0.373, 3.24e-3, 3.24e-3, 0.0, 77.6e-3, 5};
    machine_t machine;
    bridge_t bridge;
    machine_set(&machine, &config, 25.0, 25.0);
    bridge_init(&bridge, &config, 3);
    bridge.leg[0] = LEG_HIGH;
    bridge.leg[1] = LEG_LOW;
    bridge_summarise(&bridge, &machine.winding);
    double theta = 0.9;
    machine_state_t state{};
    state.rotor = rotor_t{std::cos(theta), std::sin(theta)};
    machine_idle(&machine, &state, 0);
    machine_point_t point;
    machine_evaluate(&machine, &state, &point);
    double v_V[ACTIVE] = {machine.winding.share[0][0] * 36.0, machine.winding.share[0][1] * 36.0};
    double v_leg[PLANT_LEGS] = {36.0, 0.0};
    machine_rate_t rate;
    floating_voltages(&bridge, &machine, &state, &point, 150.0, 36.0, v_V, v_leg, &rate);
    double e_C = -150.0 * 77.6e-3 * std::sin(theta + 2.0943951023931953);
    EXPECT_NEAR(v_leg[2], 18.0 + 1.5 * e_C, 1e-12);
}

} // namespace
