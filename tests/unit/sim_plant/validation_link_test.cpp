// The DC link under a running PWM: ripple, lost supply, chopper, energy (E13).
#include "validation.h"

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace validation
{
namespace
{

using reference::measured;

// The formulas take the PWM for its mean: the ripple that it makes on the link is below 0.5 %.
constexpr double bound_mean = 0.01;
constexpr double bound_energy = 1e-3; // issue: 0.1 %

// Locked, with a PWM that never changes and a load that the link feels: a short time constant.
plant_config_t loaded_link()
{
    plant_config_t c = ideal(1.0, 5e-3, 5e-3, 0.0, 4, 36.0);
    c.mech.locked = true;
    c.inverter.f_pwm_Hz = 20e3;
    c.dclink = rig::dclink(36.0, 1.0, 470e-6);
    return c;
}

const plant_pwm_t steady = rig::pwm(0.75, 0.25, 0.25);
constexpr double steady_duty = 1.0 / 3.0; // of v_alpha

double capacitor_J(const plant_config_t &config, const plant_truth_t &t)
{
    return 0.5 * config.dclink.c_F * t.v_dc_V * t.v_dc_V;
}

// The legs draw 1.5 m i, i = m v/(R + j w L): v = v_source/(1 + r (j w C + 1.5 m^2/(R + j w L))).
double ripple_deviation(double f_Hz, double tolerance)
{
    plant_config_t config = loaded_link();
    config.dclink.ripple_V = 3.0;
    config.dclink.ripple_Hz = f_Hz;
    config.tolerance = tolerance;
    rig::Plant plant(config);
    plant.run(steady, 2000); // 20 time constants
    Fourier ripple;
    double omega = 2.0 * rig::pi * f_Hz;
    for (int n = 0; n < 2000; n++) { // whole turns of the ripple: 0.1 s
        plant.run(steady);
        plant_truth_t t = plant.truth();
        ripple.add(2.0 * t.v_dc_V, omega * t.t_s);
    }
    Complex load_S = 1.5 * steady_duty * steady_duty / (1.0 + j * omega * 5e-3);
    Complex v_V = -j * 3.0 / (1.0 + 1.0 * (j * omega * 470e-6 + load_S)); // sine: -j
    return std::abs(ripple.value() / v_V - 1.0);
}

TEST(RunningLink, Ripple)
{
    for (double f_Hz : {20.0, 100.0, 300.0}) {
        measured("link_ripple_" + std::to_string(std::lround(f_Hz)) + "Hz", ripple_deviation(f_Hz, 0.0),
                 bound_mean, "relative", "E13");
    }
}

TEST(RunningLink, RippleIsIndependentOfTolerance)
{
    double figure = ripple_deviation(100.0, 1e-6);
    measured("tolerance_link_ripple", std::fabs(ripple_deviation(100.0, 0.5e-6) - figure), 0.1 * bound_mean,
             "relative", "step size");
}

// Without source the capacitor feeds the winding: L di/dt = m v - R i, C dv/dt = - 1.5 m i.
TEST(RunningLink, LostSupply)
{
    plant_config_t config = loaded_link();
    rig::Plant plant(config);
    plant.run(steady, 2000);
    plant_truth_t start = plant.truth();
    plant_set_supply(plant, false);
    Eigen::Matrix2d rate;
    rate << -1.0 / 5e-3, steady_duty / 5e-3, -1.5 * steady_duty / 470e-6, 0.0;
    Eigen::Vector2d x(start.i_A[0], start.v_dc_V);
    double step_s = plant.period_s(), worst_V = 0.0;
    Eigen::Matrix2d h = rate * step_s;
    Eigen::Matrix2d turn = (Eigen::Matrix2d::Identity() - 0.5 * h + h * h / 12.0).inverse() *
                           (Eigen::Matrix2d::Identity() + 0.5 * h + h * h / 12.0); // exp to 1e-9
    for (int n = 0; n < 60; n++) {
        plant.run(steady);
        x = turn * x;
        worst_V = std::max(worst_V, std::fabs(plant.truth().v_dc_V - x(1)));
    }
    plant_truth_t end = plant.truth();
    EXPECT_LT(end.v_dc_V, 0.5 * start.v_dc_V);
    measured("lost_supply_voltage", worst_V / start.v_dc_V, bound_mean, "of_start", "E13");
    double in_J = end.e_in_J - start.e_in_J;
    double given_J = capacitor_J(config, start) - capacitor_J(config, end);
    measured("lost_supply_energy", std::fabs(given_J / in_J - 1.0), bound_energy, "relative", "E13");
}

// What the legs have taken is what the source has given less what the capacitor has kept: currents through a
// resistor are sums over 200 instants of each period.
TEST(RunningLink, EnergyOfSource)
{
    plant_config_t config = loaded_link();
    rig::Plant plant(config);
    plant_truth_t before = plant.truth();
    double source_J = 0.0;
    for (int n = 0; n < 400; n++) {
        for (int k = 1; k <= 200; k++) {
            plant_truth_t t =
                k < 200 ? plant.at(k * plant.period_s() / 200.0) : (plant.run(steady), plant.truth());
            auto given_W = [](const plant_truth_t &at) { return at.v_dc_V * (36.0 - at.v_dc_V) / 1.0; };
            source_J += 0.5 * (given_W(before) + given_W(t)) * plant.period_s() / 200.0;
            before = t;
        }
    }
    double kept_J = capacitor_J(config, before) - 0.5 * 470e-6 * 36.0 * 36.0;
    EXPECT_LT(before.v_dc_V, 34.0); // the link sags
    measured("link_energy", std::fabs((source_J - kept_J) / before.e_in_J - 1.0), bound_energy, "relative",
             "E13");
}

struct LinkState {
    double t_s, v_V, in_J;
};

// A motor braked with 4 A on a rectifier-fed link.
std::vector<LinkState> braked(const plant_config_t &config)
{
    rig::Plant plant(config);
    rig::CurrentControl control(config);
    plant_set_speed(plant, 40.0);
    std::vector<LinkState> states;
    for (int n = 0; n < 3000; n++) {
        plant.run(control.step(plant.truth(), 0.0, -4.0));
        plant_truth_t t = plant.truth();
        if (n >= 500) { // the control has settled
            states.push_back({t.t_s, t.v_dc_V, t.e_in_J});
        }
    }
    return states;
}

// First and last sample of each rise or fall that lies within the record. The chopper toggles at either side
// of the highest or lowest one.
std::vector<std::pair<LinkState, LinkState>> strokes(const std::vector<LinkState> &states)
{
    std::vector<size_t> turns;
    for (size_t n = 1; n + 1 < states.size(); n++) {
        if ((states[n].v_V > states[n - 1].v_V) != (states[n + 1].v_V > states[n].v_V)) {
            turns.push_back(n);
        }
    }
    std::vector<std::pair<LinkState, LinkState>> found;
    for (size_t n = 1; n < turns.size(); n++) {
        found.emplace_back(states[turns[n - 1] + 1], states[turns[n] - 1]);
    }
    return found;
}

// Chopper off, the capacitor takes what the legs return; on, d(v^2)/dt = 2 (P - v^2/R)/C and so v^2 = P R +
// (v_0^2 - P R) e^{-2t/RC}.
TEST(RunningLink, ChopperOfABrakedMotor)
{
    constexpr double R_ohm = 8.0, C_F = 10e-3, on_V = 48.0, off_V = 40.0;
    plant_config_t config = spm_linear();
    config.dclink = rig::dclink(36.0, 0.5, C_F, true);
    config.dclink.r_chopper_ohm = R_ohm;
    config.dclink.v_chopper_on_V = on_V;
    config.dclink.v_chopper_off_V = off_V;
    double rise = 0.0, fall = 0.0;
    auto cycle = strokes(braked(config));
    ASSERT_GE(cycle.size(), 5u);
    for (const auto &[first, last] : cycle) {
        bool falls = last.v_V < first.v_V;
        EXPECT_NEAR(last.v_V, falls ? off_V : on_V, 0.1); // a period is 0.03 V
        double returned_J = first.in_J - last.in_J, lasted_s = last.t_s - first.t_s;
        double kept_J = 0.5 * C_F * (std::pow(last.v_V, 2) - std::pow(first.v_V, 2));
        if (!falls) {
            rise = std::max(rise, std::fabs(kept_J / returned_J - 1.0));
            continue;
        }
        double end_V2 = returned_J / lasted_s * R_ohm;
        double v_V2 = end_V2 + (std::pow(first.v_V, 2) - end_V2) * std::exp(-2.0 * lasted_s / (R_ohm * C_F));
        fall = std::max(fall, std::fabs(last.v_V - std::sqrt(v_V2)) / (on_V - off_V));
    }
    measured("chopper_rise_energy", rise, bound_energy, "relative", "E13");
    measured("chopper_fall", fall, bound_mean, "of_hysteresis", "E13");
}

} // namespace
} // namespace validation
