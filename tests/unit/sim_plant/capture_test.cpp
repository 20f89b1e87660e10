// Edges of the terminal comparators of an undriven machine against the instants that follow from its EMF, for
// each reference, with an offset.
#include "rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

extern "C" {
#include "sim_plant/probe.h"
}

namespace
{

constexpr double omega_e = 150.0, theta_0 = 0.3, capture_s = 1e-7;
constexpr int periods = 1000; // 2.4 turns
// A chord in place of the arc of a period: the EMF by at most (omega T)^2 / 8 of its peak, which is the turn
// where the slope is omega times the peak. Here the slope is at least a third of that.
constexpr double chord_s = 3.0 * omega_e * 1e-4 * 1e-4 / 8.0;

struct Edge {
    double t_s;
    bool rising;
};

using Function = std::function<double(double theta_e)>;

plant_config_t machine(plant_reference_t reference, double offset_V)
{
    plant_config_t config = rig::ipm_1000();
    config.sensor.capture_s = capture_s;
    config.sensor.comparator_reference = reference;
    for (double &leg_V : config.sensor.comparator_offset_V) {
        leg_V = offset_V;
    }
    return config;
}

std::vector<Edge> edges_of_leg(int leg, const plant_config_t &config)
{
    rig::Plant plant(config, theta_0);
    plant_set_speed(plant, omega_e / config.machine.pole_pairs);
    std::vector<Edge> edges;
    for (int k = 0; k < periods; k++) {
        plant.run(rig::all_off());
        plant_capture_t seen[16];
        const int count = plant_captured(plant, seen, 16);
        EXPECT_LE(count, 16);
        for (int n = 0; n < count; n++) {
            const double t_s = k * plant.period_s() + seen[n].count * capture_s;
            if (seen[n].leg == leg && t_s > plant.period_s()) { // they start low
                edges.push_back({t_s, seen[n].rising});
            }
        }
    }
    return edges;
}

// Where the difference at the comparator changes its sign, by bisection.
std::vector<Edge> crossings(const Function &seen_V)
{
    const auto at = [&](double t_s) { return seen_V(theta_0 + omega_e * t_s); };
    std::vector<Edge> edges;
    constexpr double step_s = 1e-4;
    for (int k = 1; k < periods; k++) {
        double a = k * step_s, b = (k + 1) * step_s;
        const bool rising = at(b) > 0.0;
        if ((at(a) > 0.0) == rising) {
            continue;
        }
        for (int n = 0; n < 60; n++) {
            const double middle = 0.5 * (a + b);
            ((at(middle) > 0.0) == rising ? b : a) = middle;
        }
        edges.push_back({a, rising});
    }
    return edges;
}

void expect_same(const std::vector<Edge> &seen, const std::vector<Edge> &expected, size_t at_least)
{
    ASSERT_EQ(seen.size(), expected.size());
    EXPECT_GE(seen.size(), at_least);
    double worst_s = 0.0;
    for (size_t n = 0; n < seen.size(); n++) {
        EXPECT_EQ(seen[n].rising, expected[n].rising) << n;
        EXPECT_NEAR(seen[n].t_s, expected[n].t_s, chord_s + capture_s) << n;
        worst_s = std::max(worst_s, std::fabs(seen[n].t_s - expected[n].t_s));
    }
    testing::Test::RecordProperty("worst_ns", std::to_string(1e9 * worst_s));
}

double emf_V(const plant_config_t &c, int k, double theta_e)
{
    const double own = theta_e - 2.0 * rig::pi / 3.0 * k;
    const plant_harmonic_t &h = c.winding.emf[0];
    return -omega_e * (c.machine.psi_m_Wb * std::sin(own) + h.order * h.amplitude * std::sin(h.order * own));
}

// The potential of terminals that are tied to nothing is centred between the rails: terminal k lies at v_dc/2
// + e_k - (e_max + e_min)/2, which is v_dc/2 + 1.5 e_k while it is the middle one.
TEST(Capture, HalfLinkWithOffset)
{
    for (double offset_V : {0.0, 6.0, -9.0}) {
        const plant_config_t config = machine(PLANT_REFERENCE_HALF_LINK, offset_V);
        for (int leg = 0; leg < 3; leg++) {
            expect_same(edges_of_leg(leg, config),
                        crossings([&](double theta) { return 1.5 * emf_V(config, leg, theta) + offset_V; }),
                        4);
        }
    }
}

// Against the neutral a terminal shows the EMF of its phase with the third harmonic, which the mean hides.
TEST(Capture, NeutralSeesTheThirdHarmonicAndTheMeanDoesNot)
{
    constexpr double offset_V = 5.0;
    for (plant_reference_t reference : {PLANT_REFERENCE_NEUTRAL, PLANT_REFERENCE_MEAN}) {
        plant_config_t config = machine(reference, offset_V);
        config.winding.emf[0] = {3, 0.01, 0.0};
        const plant_config_t without = machine(reference, offset_V);
        const plant_config_t &seen = reference == PLANT_REFERENCE_NEUTRAL ? config : without;
        for (int leg = 0; leg < 3; leg++) {
            expect_same(edges_of_leg(leg, config),
                        crossings([&](double theta) { return emf_V(seen, leg, theta) + offset_V; }), 4);
        }
    }
}

// (1 + a) v_k - (1 + n) v_N with v_N at v_dc/2 - (e_max + e_min)/2, without third harmonic e_mid/2 there.
TEST(Capture, DividersOfTerminalAndNeutral)
{
    constexpr double a = 0.01, n = -0.015;
    plant_config_t config = machine(PLANT_REFERENCE_NEUTRAL, 0.0);
    config.sensor.divider_error[0] = a;
    config.sensor.divider_error[PLANT_LEGS] = n;
    const auto seen_V = [&](double theta) {
        const double e[3] = {emf_V(config, 0, theta), emf_V(config, 1, theta), emf_V(config, 2, theta)};
        const double neutral_V = 0.5 * (300.0 - std::max({e[0], e[1], e[2]}) - std::min({e[0], e[1], e[2]}));
        return (1.0 + a) * (neutral_V + e[0]) - (1.0 + n) * neutral_V;
    };
    expect_same(edges_of_leg(0, config), crossings(seen_V), 4);
}

// A terminal at 100 V while the link rises from 180 V by 8 V/us, both behind the RC: the reference is 90 V +
// 4 V/us (t - tau (1 - e^(-t/tau))).
TEST(Capture, HalfLinkMovesWithTheLink)
{
    constexpr double slope_V_s = 4e6, duration_s = 10e-6;
    for (double tau_s : {0.0, 1e-6, 4e-6}) {
        plant_sensor_t sensor{};
        sensor.capture_s = 1e-10;
        sensor.filter_s = tau_s;
        sensor.comparator_reference = PLANT_REFERENCE_HALF_LINK;
        probe_t probe{};
        probe_init(&probe, &sensor, 3, 1);
        double before_V[PROBE_CHANNELS] = {100.0}, after_V[PROBE_CHANNELS] = {100.0};
        before_V[PROBE_LINK] = 180.0;
        probe_advance(&probe, 0.0, 1.0, before_V, before_V);
        probe_start_period(&probe, 1.0);
        after_V[PROBE_LINK] = 180.0 + 2.0 * slope_V_s * duration_s;
        probe_advance(&probe, 0.0, duration_s, before_V, after_V);
        const auto beyond_V = [&](double t_s) {
            const double lag_s = tau_s > 0.0 ? -tau_s * std::expm1(-t_s / tau_s) : 0.0;
            return slope_V_s * (t_s - lag_s) - 10.0;
        };
        double a = 0.0, b = duration_s;
        for (int n = 0; n < 60; n++) {
            const double middle = 0.5 * (a + b);
            (beyond_V(middle) > 0.0 ? b : a) = middle;
        }
        ASSERT_EQ(probe.edges, 1) << tau_s;
        EXPECT_EQ(probe.edge[0].leg, 0);
        EXPECT_FALSE(probe.edge[0].rising);
        EXPECT_NEAR(probe.edge[0].count * 1e-10, a, 1.5e-10) << tau_s;
    }
}

} // namespace
