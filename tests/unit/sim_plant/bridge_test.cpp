// bridge.h through the plant: dead time, drops, diodes, floating legs.
#include "diode_bridge.h"
#include "rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace
{

using rig::DiodeBridge;
using rig::pi;

// METHODS.md 5.6.1.1 allows 3 % against the textbook formula; with the drops of each path written out it is
// exact but for the ripple of the current in r_on.
constexpr double formula_tolerance = 0.001;
// Closed forms: events found to 1e-9 of a step, integration to 1e-6.
constexpr double closed_form = 2e-6;
// The reference takes implicit Euler steps of 50 ns: an event is up to a step late, 36 V / 3.24 mH * 50 ns =
// 0.6 mA of some amperes.
constexpr double euler = 2e-4;

plant_config_t locked_spm()
{
    plant_config_t c = rig::spm_400_linear();
    c.mech.locked = true;
    return c;
}

// Mean voltage error of phase A (in alpha) when A carries about sign * 3 A and B, C the return.
double alpha_error_V(const plant_config_t &config, double sign, double *i_A)
{
    rig::Plant plant(config);
    double v_dc = config.dclink.v_source_V, R = config.machine.R_s_ohm + config.inverter.r_on_ohm;
    double v_alpha = sign * 3.0 * R;
    auto pwm_of = [&](double v) {
        return rig::pwm(0.5 + v / v_dc, 0.5 - 0.5 * v / v_dc, 0.5 - 0.5 * v / v_dc);
    };
    for (int pass = 0; pass < 6; pass++) { // to the current, whatever the error is
        plant.run(pwm_of(v_alpha), 2000);
        v_alpha += (sign * 3.0 - plant.truth().i_A[0]) * R;
    }
    plant_pwm_t pwm = pwm_of(v_alpha);
    plant.run(pwm, 3000);
    plant_truth_t t = plant.truth();
    *i_A = t.i_A[0];
    double d_A = 1.0 * pwm.compare[0][0] / rig::counts, d_B = 1.0 * pwm.compare[1][0] / rig::counts;
    return t.v_mean_alpha_V - 2.0 / 3.0 * (d_A - d_B) * v_dc;
}

TEST(DeadTime, MeanVoltageError)
{
    plant_config_t config = locked_spm();
    config.inverter = rig::inverter(10e3, 2e-6, 0.8, 0.6, 0.01);
    double lost = 2e-6 * 10e3;
    for (double sign : {1.0, -1.0}) {
        double i_A;
        double error = alpha_error_V(config, sign, &i_A);
        ASSERT_NEAR(i_A, sign * 3.0, 0.05);
        // each leg loses V_dc t_d f and its drops against its current: A by 1, B and C by 1 the other way
        double leg_V = 36.0 * lost + 0.8 * (1.0 - 2.0 * lost) + 0.6 * 2.0 * lost;
        double expected = -sign * 4.0 / 3.0 * leg_V - 0.01 * i_A;
        RecordProperty(sign > 0 ? "relative_error_plus" : "relative_error_minus",
                       std::to_string(error / expected - 1.0));
        EXPECT_NEAR(error, expected, formula_tolerance * std::fabs(expected));
    }
}

TEST(DeadTime, NoneNoError)
{
    plant_config_t config = locked_spm();
    double i_A;
    EXPECT_NEAR(alpha_error_V(config, 1.0, &i_A), 0.0, 1e-6);
}

// A current that dies within the dead time stays at zero until the next switch closes.
TEST(DeadTime, ClampsASmallCurrentToZero)
{
    plant_config_t config = locked_spm();
    config.machine.R_s_ohm = 0.0;
    config.inverter = rig::inverter(10e3, 4e-6, 0.0, 0.7, 0.0);
    rig::Plant plant(config);
    // A's upper switch is closed from 49 to 50 us against B and C low; there A turns low and B and C high,
    // each after 4 us in which A's lower and the others' upper diode put the link and two drops against the
    // current
    plant_pwm_t pwm = rig::pwm(0.0, 0.0, 0.0);
    pwm.compare[0][0] = rig::counts / 10;
    pwm.compare[1][1] = rig::counts / 2;
    pwm.compare[2][1] = rig::counts / 2;
    plant.run(pwm);
    double up_A_s = 2.0 / 3.0 * 36.0 / 3.24e-3, down_A_s = 2.0 / 3.0 * 37.4 / 3.24e-3;
    double zero_s = 50e-6 + 1e-6 * up_A_s / down_A_s;
    EXPECT_EQ(plant.at(48.9e-6).i_A[0], 0.0);
    EXPECT_NEAR(plant.at(50e-6).i_A[0], 1e-6 * up_A_s, 1e-9);
    EXPECT_NEAR(plant.at(50.5e-6).i_A[0], 1e-6 * up_A_s - 0.5e-6 * down_A_s, 1e-9);
    EXPECT_GT(plant.at(zero_s - 1e-9).i_A[0], 0.0);
    for (double t : {zero_s + 1e-9, 52e-6, 53.9e-6}) {
        for (double i : rig::currents(plant.at(t))) {
            EXPECT_EQ(i, 0.0) << t;
        }
    }
    EXPECT_NEAR(plant.at(55e-6).i_A[0], -1e-6 * up_A_s, 1e-9);
    // and back: A low against B and C, whose currents turn to their lower diodes at 75 us
    double low_A = 21e-6 * up_A_s, drop_A_s = 2.0 / 3.0 * 0.7 / 3.24e-3;
    EXPECT_NEAR(plant.at(75e-6).i_A[0], -low_A, 1e-9);
    EXPECT_NEAR(plant.at(78e-6).i_A[0], -low_A + 3e-6 * drop_A_s, 1e-9);
    EXPECT_NEAR(plant.truth().v_leg_V[1], -0.7, 1e-9);
}

TEST(BridgeOff, NoCurrentWhileTheEmfIsBelowTheLink)
{
    plant_config_t config = rig::ipm_1000_real();
    rig::Plant plant(config, 0.3);
    plant_set_speed(plant, 200.0); // line EMF 245 V of 300 V
    for (int k = 0; k < 1000; k++) {
        plant.run(rig::all_off());
        plant_truth_t t = plant.truth();
        for (double i : rig::currents(t)) {
            ASSERT_EQ(i, 0.0);
        }
        ASSERT_NEAR(t.torque_Nm, 0.0, 1e-11); // 1e-12 of full scale counts as no current
    }
    EXPECT_EQ(plant.truth().e_in_J, 0.0);
    EXPECT_NEAR(plant.truth().e_field_J, 0.0, 1e-15);
}

struct Comparison {
    double worst = 0.0, peak = 0.0;
    int idle = 0;
    int conducting = 0;

    void add(const plant_truth_t &t, const std::array<double, 3> &reference)
    {
        for (size_t k = 0; k < 3; k++) {
            worst = std::max(worst, std::fabs(t.i_A[k] - reference[k]));
            peak = std::max(peak, std::fabs(t.i_A[k]));
            idle += t.i_A[k] == 0.0;
            conducting += t.i_A[k] != 0.0;
        }
    }
};

class Rectifier : public testing::TestWithParam<double>
{
};

// From discontinuous conduction, where all three legs start and stop by themselves, to three diodes at a
// time.
TEST_P(Rectifier, FollowsAnEnumeratedDiodeBridge)
{
    plant_config_t config = rig::spm_400_linear();
    config.inverter.v_diode_V = 0.7;
    config.inverter.r_on_ohm = 0.02;
    double omega_mech = GetParam() * (36.0 + 1.4) / (std::sqrt(3.0) * 5 * 77.6e-3);
    rig::Plant plant(config);
    plant_set_speed(plant, omega_mech);
    DiodeBridge reference(config, omega_mech, 0.0);
    Comparison comparison;
    for (int k = 0; k < 150; k++) {
        plant.run(rig::all_off());
        for (int step = 0; step < 2000; step++) {
            reference.step({DiodeBridge::open, DiodeBridge::open, DiodeBridge::open});
        }
        comparison.add(plant.truth(), reference.i_A);
    }
    plant_truth_t t = plant.truth();
    RecordProperty("worst_over_peak", std::to_string(comparison.worst / comparison.peak));
    RecordProperty("peak_A", std::to_string(comparison.peak));
    EXPECT_GT(comparison.conducting, 100);
    EXPECT_GT(comparison.peak, 0.01);
    EXPECT_LT(comparison.worst, euler * comparison.peak);
    EXPECT_LT(t.e_in_J, 0.0); // into the link
    EXPECT_NEAR(t.e_in_J, reference.e_in_J, 5e-3 * std::fabs(t.e_in_J));
}

INSTANTIATE_TEST_SUITE_P(EmfOverLink, Rectifier, testing::Values(1.02, 1.1, 1.5, 3.0));

struct Pattern {
    const char *name;
    double omega_mech;
    double duty[3]; // negative: not driven
    double dead_time_s;
};

class Legs : public testing::TestWithParam<Pattern>
{
};

// Driven, undriven and dead legs together: six-step operation with an open leg, one driven leg alone, and
// currents small enough to die in the dead time.
TEST_P(Legs, FollowAnEnumeratedBridge)
{
    const Pattern &pattern = GetParam();
    plant_config_t config = rig::spm_400_linear();
    config.inverter.v_diode_V = 0.7;
    config.inverter.dead_time_s = pattern.dead_time_s;
    config.inverter.timer_counts = 1000;
    plant_pwm_t pwm = rig::pwm(std::fabs(pattern.duty[0]), std::fabs(pattern.duty[1]),
                               std::fabs(pattern.duty[2]), config.inverter.timer_counts);
    for (int k = 0; k < 3; k++) {
        pwm.driven[k] = pattern.duty[k] >= 0.0;
    }
    rig::Plant plant(config, 0.5);
    plant_set_speed(plant, pattern.omega_mech);
    plant.run(pwm);
    ASSERT_EQ(plant.truth().i_A[0], 0.0);
    DiodeBridge reference(config, pattern.omega_mech, plant.truth().theta_e_rad);
    Comparison comparison;
    constexpr int steps = 2000, look = 50; // of a period
    for (int k = 0; k < 100; k++) {
        for (int n = 0; n < steps; n++) {
            double t = (n + 0.5) * DiodeBridge::h;
            std::array<DiodeBridge::Leg, 3> gate{};
            for (size_t leg = 0; leg < 3; leg++) {
                // high, low, or within the dead time after either edge; a driven leg starts with one too
                double rise = 50e-6 * (1.0 - pattern.duty[leg]), fall = 50e-6 * (1.0 + pattern.duty[leg]);
                bool edges = pattern.duty[leg] > 0.0;
                bool dead = (edges && t > rise && t < rise + pattern.dead_time_s) ||
                            (edges && t > fall && t < fall + pattern.dead_time_s) ||
                            (k == 0 && t < pattern.dead_time_s);
                gate[leg] = pattern.duty[leg] < 0.0 || dead ? DiodeBridge::open
                            : t > rise && t < fall          ? DiodeBridge::driven_high
                                                            : DiodeBridge::driven_low;
            }
            reference.step(gate);
            if (n % look == look - 1 && n < steps - 1) {
                comparison.add(plant.at((n + 1) * DiodeBridge::h), reference.i_A);
            }
        }
        plant.run(pwm);
        comparison.add(plant.truth(), reference.i_A);
    }
    RecordProperty("worst_over_peak", std::to_string(comparison.worst / comparison.peak));
    RecordProperty("peak_A", std::to_string(comparison.peak));
    EXPECT_GT(comparison.conducting, 100);
    EXPECT_GT(comparison.idle, 100) << "no leg ever floated";
    EXPECT_LT(comparison.worst, euler * comparison.peak);
    plant_truth_t t = plant.truth();
    EXPECT_NEAR(t.e_in_J, reference.e_in_J,
                5e-3 * std::fabs(t.e_in_J) + euler * comparison.peak * 36.0 * 0.01);
}

INSTANTIATE_TEST_SUITE_P(Operation, Legs,
                         testing::Values(Pattern{"six_step", 40.0, {0.75, 0.0, -0.5}, 2e-6},
                                         Pattern{"six_step_backwards", -40.0, {-0.5, 0.8, 0.25}, 0.0},
                                         Pattern{"one_leg", 60.0, {0.5, -0.5, -0.5}, 2e-6},
                                         Pattern{"one_leg_fast", 53.0, {-0.5, -0.5, 0.5}, 0.0},
                                         Pattern{"dying_in_the_dead_time", 0.5, {0.6, 0.5, 0.4}, 4e-6},
                                         Pattern{"turning_through_zero", 9.0, {0.52, 0.5, 0.48}, 4e-6}),
                         [](const testing::TestParamInfo<Pattern> &test) { return test.param.name; });

// One leg open, two on switches: the open terminal shows the star point and its EMF (METHODS.md 10.3.2.1).
TEST(FloatingLeg, ShowsItsEmf)
{
    plant_config_t config = rig::spm_400_linear();
    rig::Plant plant(config);
    plant_set_speed(plant, 30.0);
    plant_pwm_t pwm = rig::pwm(0.8, 0.0, 0.5);
    pwm.driven[2] = false;
    plant.run(pwm, 50);
    for (int k = 0; k < 50; k++) {
        plant.run(pwm);
        plant_truth_t on = plant.at(50e-6), off;
        double e_C = -30.0 * 5 * 77.6e-3 * std::sin(on.theta_e_rad + 2 * pi / 3);
        ASSERT_GT(18.0 + 1.5 * e_C, 0.0);
        ASSERT_EQ(on.i_A[2], 0.0);
        ASSERT_NEAR(on.i_A[0] + on.i_A[1], 0.0, 1e-9);
        ASSERT_NEAR(on.v_leg_V[2], 18.0 + 1.5 * e_C, 1e-6);
        off = plant.at(99e-6);
        e_C = -30.0 * 5 * 77.6e-3 * std::sin(off.theta_e_rad + 2 * pi / 3);
        if (e_C > 0.0) {
            ASSERT_NEAR(off.v_leg_V[2], 1.5 * e_C, 1e-6);
            ASSERT_EQ(off.i_A[2], 0.0);
        } else if (e_C < -0.1) {
            ASSERT_EQ(off.v_leg_V[2], 0.0); // the lower diode holds it
            ASSERT_GT(off.i_A[2], 0.0);
        }
    }
}

// The same with saliency and saturation: no current, and the terminal voltage that Kirchhoff and Faraday
// ask for. The fluxes of the phases sum to zero, so v_C = (v_A + v_B)/2 + 1.5 dpsi_C/dt.
TEST(FloatingLeg, HasTheVoltageOfItsFluxInASaturatedSalientMachine)
{
    plant_config_t config = rig::ipm_1000();
    config.dclink.v_source_V = 80.0;
    config.inverter.r_on_ohm = 0.8;
    config.tolerance = 1e-9;
    rig::Plant plant(config, 0.5);
    plant_set_speed(plant, 5.0);
    plant_pwm_t pwm = rig::pwm(1.0, 0.0, 0.0);
    pwm.driven[2] = false;
    auto psi_C = [](const plant_truth_t &t) {
        double theta_C = t.theta_e_rad + 2 * pi / 3;
        return t.psi_d_Wb * std::cos(theta_C) - t.psi_q_Wb * std::sin(theta_C);
    };
    plant.run(pwm);
    for (int k = 0; k < 1000; k++) {
        plant_truth_t before = plant.at(0.0), t = plant.at(50e-6), after = plant.at(99.999999e-6);
        ASSERT_EQ(t.i_A[2], 0.0);
        ASSERT_NEAR(t.i_A[0] + t.i_A[1], 0.0, 1e-9);
        double slope = (psi_C(after) - psi_C(before)) / 99.999999e-6;
        ASSERT_NEAR(t.v_leg_V[2], 0.5 * (t.v_leg_V[0] + t.v_leg_V[1]) + 1.5 * slope, 1e-4) << k;
        plant.run(pwm);
    }
    plant_truth_t t = plant.truth();
    EXPECT_GT(std::fabs(t.i_A[0]), 4.0);
    EXPECT_GT(std::fabs(t.v_leg_V[2] - 40.0), 2.0) << "saliency and EMF must show";
    EXPECT_NEAR(t.e_in_J - t.e_copper_J - t.e_device_J - t.e_mech_J - t.e_field_J, 0.0, 1e-6 * t.e_in_J);
}

// A peak of EMF over the link that lasts 3 degrees: long steps must not jump over it.
TEST(BridgeOff, NarrowPeaksOverTheLinkConduct)
{
    plant_config_t config = rig::spm_400_linear();
    config.inverter.f_pwm_Hz = 1e3; // 0.28 rad a period
    config.tolerance = 1e-2;        // so that not the error shortens the steps
    double omega_mech = 1.0003 * 36.0 / (std::sqrt(3.0) * 5 * 77.6e-3);
    rig::Plant plant(config);
    plant_set_speed(plant, omega_mech);
    std::set<long> peaks; // by the multiple of 60 degrees that they lie at
    double before_J = 0.0;
    int turns = 3;
    for (int k = 0; k < static_cast<int>(turns * 2 * pi / (5 * omega_mech * 1e-3)); k++) {
        plant.run(rig::all_off());
        plant_truth_t t = plant.truth();
        if (t.e_in_J != before_J) {
            peaks.insert(std::lround((t.theta_e_rad - 0.14) / (pi / 3)));
        }
        before_J = t.e_in_J;
    }
    EXPECT_GE(peaks.size(), static_cast<size_t>(6 * turns - 2));
}

// A trip under current: each leg's diode puts the whole link against it; all ends in the time predicted.
TEST(Trip, CurrentDecaysThroughTheDiodes)
{
    plant_config_t config = locked_spm();
    config.inverter = rig::inverter(10e3, 0.0, 0.0, 0.7, 0.02);
    rig::Plant plant(config);
    plant.run(rig::pwm(0.53, 0.485, 0.485), 2000);
    plant_truth_t t0 = plant.truth();
    ASSERT_GT(t0.i_A[0], 2.0);
    plant_trip(plant);
    double R = 0.373 + 0.02, L = 3.24e-3, V = 2.0 / 3.0 * (36.0 + 1.4); // A low, B and C high
    double zero_s = L / R * std::log1p(R * t0.i_A[0] / V);
    auto expected = [&](double t) { return (t0.i_A[0] + V / R) * std::exp(-R / L * t) - V / R; };
    bool died = false;
    for (double start = 0.0; !died; start += 1e-4) {
        for (double t = 0.0; t < 99e-6; t += 1e-6) {
            double i = plant.at(t).i_A[0];
            if (start + t < zero_s) {
                ASSERT_NEAR(i, expected(start + t), closed_form * t0.i_A[0] + 1e-9);
            } else {
                ASSERT_EQ(i, 0.0) << start + t << " of " << zero_s;
                died = true;
            }
        }
        plant.run(rig::all_off());
    }
    plant.run(rig::all_off(), 100);
    for (double i : rig::currents(plant.truth())) {
        EXPECT_EQ(i, 0.0);
    }
}

TEST(Trip, HoldsUntilTheNextPwm)
{
    rig::Plant plant(locked_spm());
    plant_pwm_t pwm = rig::pwm(0.6, 0.5, 0.5);
    plant.run(pwm, 10);
    plant_trip(plant);
    plant_run_period(plant);
    plant_run_period(plant);
    for (int k = 0; k < 20; k++) {
        plant_run_period(plant);
    }
    EXPECT_EQ(plant.truth().i_A[0], 0.0);
    plant.run(pwm);
    EXPECT_EQ(plant.truth().i_A[0], 0.0); // the update delay
    plant_run_period(plant);
    EXPECT_GT(plant.truth().i_A[0], 0.0);
}

// A current that starts after a time in which nothing happened: how long steps were then must not matter. The
// drop is A's upper switch's and the two lower ones', 4/3 V, but for the zone of 5 mA.
TEST(SwitchDrop, CountsFromTheStart)
{
    plant_config_t config = locked_spm();
    config.inverter = rig::inverter(10e3, 0.0, 1.0, 0.7, 0.0);
    rig::Plant plant(config);
    plant.run(rig::all_off(), 20);
    plant.run(rig::pwm(1, 0, 0), 1);
    for (int k = 1; k < 5; k++) {
        plant.run(rig::pwm(1, 0, 0), 1);
        double expected = (24.0 - 4.0 / 3.0) / 0.373 * -std::expm1(-0.373 / 3.24e-3 * k * 1e-4);
        ASSERT_NEAR(plant.truth().i_A[0], expected, 3e-4) << k; // 4/3 V over 0.7 us in 3.24 mH
    }
}

// A current creeping through zero under closed switches: the drop turns over without a train of events.
TEST(SwitchDrop, TurnsOverWithTheCurrent)
{
    plant_config_t config = locked_spm();
    config.inverter = rig::inverter(10e3, 0.0, 1.0, 0.7, 0.0);
    rig::Plant plant(config);
    plant.run(rig::pwm(1, 0, 0), 3);
    double i_A = plant.truth().i_A[0];
    ASSERT_GT(i_A, 0.5);
    plant.run(rig::pwm(0, 0, 0), 1);
    plant.run(rig::pwm(0, 0, 0), 500);
    // 4/3 of the drop against the current: zero is reached, and kept
    plant_truth_t t = plant.truth();
    EXPECT_NEAR(t.i_A[0], 0.0, 1e-6 * 77.6e-3 / 3.24e-3); // the tolerance of the integrator
    // the error control watches the flux, not the loss in a drop that turns over within a step
    EXPECT_NEAR(t.e_in_J - t.e_copper_J - t.e_device_J - t.e_mech_J - t.e_field_J, 0.0, 1e-5 * t.e_in_J);
}

} // namespace
