#include "tools/pmsim/metrics.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tools/pmsim/setup.h"

namespace pmsim
{
namespace
{

const double pi = 3.14159265358979323846;
const double exact = 1e-9; // sums of a few thousand doubles

Setup test_setup()
{
    pmsim::Setup setup = default_setup();
    setup.plant.machine.pole_pairs = 3;
    setup.rated = {4.0, 100.0, 2.0, 300.0};
    return setup;
}

// 1000 periods of 0.1 ms, each as the test describes it.
template <class Describe>
MetricValue gather(const Expectation &expectation, Describe describe, int periods = 1000)
{
    const pmsim::Setup setup = test_setup();
    const std::unique_ptr<Metric> metric = make_metric(expectation, setup);
    for (int k = 0; k < periods; ++k) {
        Sample sample{};
        sample.rig.state = RIG_RUNNING;
        sample.rig.truth.t_s = 1e-4 * k;
        describe(sample, k);
        metric->add(sample);
    }
    return metric->value();
}

template <class Describe> MetricValue gather(const char *name, Describe describe, int periods = 1000)
{
    Expectation expectation;
    expectation.metric = name;
    return gather(expectation, describe, periods);
}

TEST(Metrics, WhatHasAUnitIsANumber)
{
    for (const MetricInfo &info : metric_infos()) {
        EXPECT_EQ(info.is_word, info.unit.empty()) << info.name;
        EXPECT_EQ(info.is_word, !info.words.empty()) << info.name;
    }
}

TEST(Metrics, AngleErrorOfAWaveAboutAnOffset)
{
    const auto wave = [](Sample &s, int k) {
        s.rig.angle_error_rad = (2.0 + 3.0 * std::sin(2 * pi * k / 100.0)) * pi / 180.0;
    };
    EXPECT_NEAR(gather("angle_error_mean_deg", wave).number, 2.0, exact);
    EXPECT_NEAR(gather("angle_error_std_deg", wave).number, 3.0 / std::sqrt(2.0), exact);
    EXPECT_NEAR(gather("angle_error_rms_deg", wave).number, std::sqrt(4.0 + 4.5), exact);
    EXPECT_NEAR(gather("angle_error_max_deg", wave).number, 5.0, exact);
}

TEST(Metrics, LargestErrorIsThatOfEitherSign)
{
    const auto wave = [](Sample &s, int k) { s.rig.angle_error_rad = k == 500 ? -0.1 : 0.05; };
    EXPECT_NEAR(gather("angle_error_max_deg", wave).number, 0.1 * 180.0 / pi, exact);
}

TEST(Metrics, WithoutAPositionThereIsNothingToJudge)
{
    const auto off = [](Sample &s, int) { s.rig.state = RIG_FINDING; };
    EXPECT_TRUE(std::isnan(gather("angle_error_max_deg", off).number));
    const auto half = [](Sample &s, int k) {
        s.rig.state = k < 500 ? RIG_CALIBRATING : RIG_RUNNING;
        s.rig.angle_error_rad = k < 500 ? 3.0 : 0.01;
    };
    EXPECT_NEAR(gather("angle_error_max_deg", half).number, 0.01 * 180.0 / pi, exact);
}

TEST(Metrics, Speeds)
{
    const auto ramp = [](Sample &s, int k) {
        s.rig.truth.omega_mech_rad_s = 0.1 * k;
        s.rig.omega_ref_mech_rad_s = 0.1 * k + 1.0;
        s.rig.omega_hat_mech_rad_s = 0.1 * k - 2.0;
    };
    EXPECT_NEAR(gather("speed_final_rel", ramp).number, 0.999, exact);
    EXPECT_NEAR(gather("speed_mean_rel", ramp).number, 0.4995, exact);
    EXPECT_NEAR(gather("speed_error_max_rel", ramp).number, 0.01, exact);
    EXPECT_NEAR(gather("speed_estimate_error_max_rel", ramp).number, 0.02, exact);
}

TEST(Metrics, TimeToSpeedCountsTheCommandedDirectionOnly)
{
    Expectation expectation;
    expectation.metric = "time_to_speed_s";
    expectation.fraction = 0.5;
    expectation.t0_s = 0.01;
    const auto forward = [](Sample &s, int k) {
        s.direction = 1;
        s.rig.truth.omega_mech_rad_s = 0.1 * k; // 50 rad/s at k = 500
    };
    const auto wrong_way = [](Sample &s, int k) {
        s.direction = -1;
        s.rig.truth.omega_mech_rad_s = 0.1 * k;
    };
    EXPECT_NEAR(gather(expectation, forward).number, 0.05 - 0.01, exact);
    EXPECT_TRUE(std::isnan(gather(expectation, wrong_way).number));
}

TEST(Metrics, BackwardMovementIsMechanicalAndFromTheFarthestPoint)
{
    const auto there_and_back = [](Sample &s, int k) {
        s.direction = 1;
        const double mech_deg = k < 500 ? 0.1 * k : 49.9 - 0.01 * (k - 499);
        s.rig.truth.theta_e_rad = 3 * mech_deg * pi / 180.0;
    };
    EXPECT_NEAR(gather("backward_movement_deg_mech", there_and_back).number, 5.0, 1e-6);
    EXPECT_NEAR(gather("travel_max_deg_mech", there_and_back).number, 49.9, 1e-6);
}

TEST(Metrics, BackwardMovementFollowsTheDirection)
{
    const auto turned_round = [](Sample &s, int k) {
        s.direction = k < 500 ? 1 : -1;
        s.rig.truth.theta_e_rad = k < 500 ? 0.01 * k : 0.01 * (1000 - k);
    };
    EXPECT_NEAR(gather("backward_movement_deg_mech", turned_round).number, 0.0, exact);
}

TEST(Metrics, FoundAngleErrorIsThatOfTheFirstRunningPeriod)
{
    const auto found = [](Sample &s, int k) {
        s.rig.state = k < 300 ? RIG_FINDING : RIG_RUNNING;
        s.rig.angle_error_rad = k == 300 ? -0.2 : 1.0;
    };
    EXPECT_NEAR(gather("found_angle_error_deg", found).number, -0.2 * 180.0 / pi, exact);
}

// A fault at k = 400; the bridge stays on for two more periods, and comes back at k = 700.
void fault_story(Sample &s, int k)
{
    s.rig.driven = k < 402 || k >= 700;
    s.rig.fault = k >= 400 && k < 650 ? 8 : 0;
    s.rig.state = k >= 400 && k < 650 ? RIG_FAULT : (k >= 650 && k < 700 ? RIG_OFF : RIG_RUNNING);
}

TEST(Metrics, FaultAndWhatTheBridgeDoes)
{
    EXPECT_EQ(gather("fault", fault_story).text, "POSITION_LOST");
    EXPECT_EQ(gather("fault_count", fault_story).number, 1.0);
    EXPECT_EQ(gather("position_lost_count", fault_story).number, 1.0);
    EXPECT_EQ(gather("fault_latency_periods", fault_story).number, 2.0);
    EXPECT_EQ(gather("driven_after_fault_periods", fault_story).number, 2.0 + 300.0);
    EXPECT_EQ(gather("restarts", fault_story).number, 1.0);
    EXPECT_EQ(gather("state_final", fault_story).text, "running");
    EXPECT_NEAR(gather("fault_delay_s", fault_story).number, 0.04, exact);
}

TEST(Metrics, NoFaultMeansNothingToJudge)
{
    const auto fine = [](Sample &, int) {};
    EXPECT_EQ(gather("fault", fine).text, "NONE");
    EXPECT_EQ(gather("fault_count", fine).number, 0.0);
    EXPECT_TRUE(std::isnan(gather("fault_latency_periods", fine).number));
    EXPECT_TRUE(std::isnan(gather("restarts", fine).number));
}

TEST(Metrics, EnergyResidual)
{
    const auto lossless = [](Sample &s, int k) {
        s.rig.truth.e_in_J = 5.0 + k;
        s.rig.truth.e_copper_J = 0.3 * k;
        s.rig.truth.e_device_J = 0.1 * k;
        s.rig.truth.e_mech_J = 0.5 * k;
        s.rig.truth.e_field_J = 0.1 * k;
    };
    EXPECT_NEAR(gather("energy_residual_rel", lossless).number, 0.0, exact);
    const auto invents = [&](Sample &s, int k) {
        lossless(s, k);
        s.rig.truth.e_mech_J *= 1.2;
    };
    EXPECT_NEAR(gather("energy_residual_rel", invents).number, 0.1 / 2.1, exact);
}

TEST(Metrics, LimitFlagsAreSeconds)
{
    const auto limits = [](Sample &s, int k) { s.rig.limits = k < 250 ? 1U << 2 : 1U << 0; };
    EXPECT_NEAR(gather("limit_temperature_s", limits).number, 0.025, exact);
    EXPECT_NEAR(gather("limit_current_s", limits).number, 0.075, exact);
    EXPECT_EQ(gather("limit_speed_s", limits).number, 0.0);
}

TEST(Metrics, CurrentsAndTorque)
{
    const auto constant = [](Sample &s, int k) {
        s.rig.truth.i_A[1] = k == 10 ? -7.0 : 1.0;
        s.rig.truth.i_d_A = -3.0;
        s.rig.truth.i_q_A = 4.0;
        s.rig.truth.torque_Nm = k % 2 == 0 ? 1.5 : 2.5;
    };
    EXPECT_EQ(gather("current_peak_A", constant).number, 7.0);
    EXPECT_NEAR(gather("current_amplitude_mean_A", constant).number, 5.0, exact);
    EXPECT_NEAR(gather("torque_mean_Nm", constant).number, 2.0, exact);
    EXPECT_NEAR(gather("torque_mean_rel", constant).number, 1.0, exact);
    EXPECT_NEAR(gather("torque_span_Nm", constant).number, 1.0, exact);
}

// Speed that varies within a turn, 2.3 turns back and 0.3 of them not counted.
TEST(Metrics, OrdersOfThePositionErrorAreByTheAngleOverWholeTurns)
{
    const auto wave = [](Sample &s, int k) {
        const double x = 2.3 * 2 * pi * k / 1000.0;
        const double theta = -(x + 0.3 * std::sin(x));
        s.rig.truth.theta_e_rad = theta;
        s.rig.angle_error_rad =
            (5.0 + 3.0 * std::cos(2 * theta + 1.0) + 2.0 * std::cos(6 * theta)) * pi / 180.0;
    };
    EXPECT_NEAR(gather("angle_error_2nd_deg", wave).number, 3.0, 0.03);
    EXPECT_NEAR(gather("angle_error_6th_deg", wave).number, 2.0, 0.03);
    EXPECT_TRUE(std::isnan(gather("angle_error_6th_deg", [](Sample &, int) {}).number));
}

// 20 periods in a turn: fundamental of 100 V of 300 V, a fifth harmonic that turns the other way.
// No whole turns: the fit takes mean and the other part out.
TEST(Metrics, HarmonicsOfThePositionErrorAreFitted)
{
    const auto wave = [](int order) {
        return [order](Sample &s, int k) {
            const double theta = 0.013 * k;
            s.rig.truth.theta_e_rad = theta;
            s.rig.angle_error_rad =
                (1.5 + 0.6 * std::cos(order * theta) - 0.8 * std::sin(order * theta)) * pi / 180;
        };
    };
    EXPECT_NEAR(gather("angle_error_h2_deg", wave(2)).number, 1.0, 1e-6);
    EXPECT_NEAR(gather("angle_error_h6_deg", wave(6)).number, 1.0, 1e-6);
    const auto still = [](Sample &s, int) { s.rig.truth.theta_e_rad = 1; };
    EXPECT_TRUE(std::isnan(gather("angle_error_h2_deg", still, 1).number));
}

TEST(Metrics, LoudestBandNeedsTwoWindows)
{
    const auto sine = [](Sample &s, int k) { s.rig.truth.i_d_A = std::sin(2 * pi * k / 20.0); };
    EXPECT_TRUE(std::isnan(gather("i_d_loudest_band_A", sine, 300).number)); // of 400
    EXPECT_FALSE(std::isnan(gather("i_d_loudest_band_A", sine, 500).number));
}

TEST(Metrics, StartTimeIsThatOfFinding)
{
    const auto start = [](Sample &s, int k) {
        s.rig.state = k < 100 ? RIG_CALIBRATING : k <= 300 ? RIG_FINDING : RIG_RUNNING;
    };
    EXPECT_NEAR(gather("start_s", start).number, 200 * 1e-4, exact);
}

TEST(Metrics, WhatPulsesHaveFoundIsThatOfTheSecondPeriodOfSettling)
{
    const auto start = [](Sample &s, int k) {
        s.rig.settles = k >= 200 && k < 300;
        s.rig.angle_error_rad = (k == 201 ? 2.0 : 30.0) * pi / 180;
    };
    EXPECT_NEAR(std::fabs(gather("pulses_angle_error_deg", start).number), 2.0, exact);
}

TEST(Metrics, FundamentalOfTheVoltageIsWithoutItsHarmonics)
{
    const auto turning = [](Sample &s, int k) {
        const double theta = 2 * pi * k / 20.0;
        s.rig.truth.theta_e_rad = theta;
        s.rig.truth.v_dc_V = 300.0;
        s.rig.truth.v_mean_alpha_V = 100.0 * std::cos(theta + 1.2) + 10.0 * std::cos(5 * theta);
        s.rig.truth.v_mean_beta_V = 100.0 * std::sin(theta + 1.2) - 10.0 * std::sin(5 * theta);
    };
    EXPECT_NEAR(gather("voltage_fundamental_rel", turning).number, 100.0 / (300.0 / std::sqrt(3.0)), exact);
}

// A sine of 0.2 A at 1 kHz beside a smaller one and a direct current.
TEST(Metrics, LoudestBandIsTheRmsOfItsSine)
{
    const auto sines = [](Sample &s, int k) {
        s.rig.truth.i_d_A = 3.0 + 0.2 * std::sin(2 * pi * k / 10.0) + 0.1 * std::sin(2 * pi * k / 4.0);
    };
    EXPECT_NEAR(gather("i_d_loudest_band_A", sines).number, 0.2 / std::sqrt(2.0), 0.01);
}

TEST(Metrics, AngleOfTheVoltageIsComparedWithTheCommandOfTwoSamplesBefore)
{
    const auto turned = [](double error_deg) {
        return [error_deg](Sample &s, int k) {
            const double theta = 2 * pi * k / 20.0;
            s.rig.v_alpha_V = 50.0 * std::cos(theta);
            s.rig.v_beta_V = 50.0 * std::sin(theta);
            const double then = theta - 2 * 2 * pi / 20.0 + (k == 700 ? error_deg : 0.0) * pi / 180.0;
            s.rig.truth.v_mean_alpha_V = 40.0 * std::cos(then);
            s.rig.truth.v_mean_beta_V = 40.0 * std::sin(then);
        };
    };
    EXPECT_NEAR(gather("voltage_angle_error_max_deg", turned(0.0)).number, 0.0, 1e-6);
    EXPECT_NEAR(gather("voltage_angle_error_max_deg", turned(-3.0)).number, 3.0, 1e-6);
}

// Each is fed a signal of its own, 10 + 0.01 k with a dip of -20 at k = 500, scaled so that no other signal gives the same;
// the folds of that signal are known.
TEST(Metrics, FoldsOfEverySignal)
{
    const auto wave = [](int k) { return k == 500 ? -20.0 : 10.0 + 0.01 * k; };
    const auto all = [&](Sample &s, int k) {
        const double x = wave(k);
        s.rig.truth.omega_mech_rad_s = 2 * x;
        s.rig.omega_hat_mech_rad_s = 2 * x + 3 * x;
        s.rig.omega_ref_mech_rad_s = 2 * x + 4 * x;
        s.rig.truth.torque_Nm = 5 * x;
        s.rig.truth.i_A[0] = 6 * x;
        s.rig.truth.i_d_A = 7 * x;
        s.rig.truth.i_q_A = 8 * x;
        s.rig.truth.v_dc_V = 9 * x;
        s.rig.weight = 11 * x;
        s.rig.quality = 12 * x;
    };
    const double mean = 10.0 + 0.01 * 499.5 - 0.001 * (20.0 + 15.0); // 15 is the wave without the dip
    double squares = 0.0;
    for (int k = 0; k < 1000; ++k) {
        squares += wave(k) * wave(k) / 1000.0;
    }
    const double rms = std::sqrt(squares), deviation = std::sqrt(squares - mean * mean);
    const double high = 19.99, low = -20.0, last = 19.99;
    const struct {
        const char *name;
        double expected;
    } cases[] = {
        {"speed_error_max_rel", 4 * 20.0 / 100},
        {"speed_estimate_error_max_rel", 3 * 20.0 / 100},
        {"speed_estimate_error_rms_rel", 3 * rms / 100},
        {"speed_mean_rad_s", 2 * mean},
        {"speed_mean_rel", 2 * mean / 100},
        {"speed_min_rel", 2 * low / 100},
        {"speed_max_rel", 2 * high / 100},
        {"speed_final_rad_s", 2 * last},
        {"speed_final_rel", 2 * last / 100},
        {"torque_mean_Nm", 5 * mean},
        {"torque_mean_rel", 5 * mean / 2},
        {"torque_span_Nm", 5 * (high - low)},
        {"current_peak_A", 6 * 20.0},
        {"current_final_A", std::sqrt(7.0 * 7.0 + 8.0 * 8.0) * last},
        {"i_d_mean_A", 7 * mean},
        {"i_q_mean_A", 8 * mean},
        {"i_q_min_A", 8 * low},
        {"i_q_max_A", 8 * high},
        {"i_q_std_A", 8 * deviation},
        {"v_dc_max_V", 9 * high},
        {"v_dc_min_V", 9 * low},
        {"weight_mean", 11 * mean},
        {"quality_min", 12 * low},
    };
    for (const auto &at : cases) {
        EXPECT_NEAR(gather(at.name, all).number, at.expected, 1e-8) << at.name;
    }
}

TEST(Metrics, PeakCurrentIsThatOfAnyPhase)
{
    for (int leg = 0; leg < 3; ++leg) {
        for (const double sign : {1.0, -1.0}) {
            const auto peak = [&](Sample &s, int k) { s.rig.truth.i_A[leg] = k == 3 ? 9.0 * sign : 1.0; };
            EXPECT_EQ(gather("current_peak_A", peak).number, 9.0) << leg;
        }
    }
}

// Only where the drive says that it has a position; what needs none is counted always.
TEST(Metrics, StatesThatHaveAPosition)
{
    for (int state = 0; state < RIG_STATES; ++state) {
        const auto at = [state](Sample &s, int) {
            s.rig.state = state;
            s.rig.quality = 0.7;
            s.rig.truth.v_dc_V = 300.0;
        };
        const bool has = state == RIG_RUNNING || state == RIG_STOPPING;
        EXPECT_EQ(std::isnan(gather("quality_min", at).number), !has) << state;
        EXPECT_EQ(gather("v_dc_min_V", at).number, 300.0) << state;
    }
}

TEST(Metrics, TravelIsFromTheStartEitherWay)
{
    for (const double way : {1.0, -1.0}) {
        const auto turned = [way](Sample &s, int k) {
            const double mech_deg = k < 400 ? 0.01 * k : 4.0 - 0.005 * (k - 400); // to 4, back to 1.005
            s.rig.truth.theta_e_rad = (3.0 * way * mech_deg + 50.0) * pi / 180.0;
        };
        EXPECT_NEAR(gather("travel_max_deg_mech", turned).number, 4.0, 1e-6);
    }
}

TEST(Metrics, WithoutADirectionNothingMovesBackwards)
{
    const auto idle = [](Sample &s, int k) { s.rig.truth.theta_e_rad = -0.01 * k; };
    EXPECT_TRUE(std::isnan(gather("backward_movement_deg_mech", idle).number));
    Expectation expectation;
    expectation.metric = "time_to_speed_s";
    expectation.fraction = 0.0;
    EXPECT_TRUE(std::isnan(gather(expectation, idle).number));
}

TEST(Metrics, TimeToSpeedIsTheFirst)
{
    Expectation expectation;
    expectation.metric = "time_to_speed_s";
    expectation.fraction = 0.5;
    const auto twice = [](Sample &s, int k) {
        s.direction = -1;
        s.rig.truth.omega_mech_rad_s = k == 200 || k > 600 ? -50.0 : -49.0;
    };
    EXPECT_NEAR(gather(expectation, twice).number, 0.02, exact);
}

// Found twice: the worse counts. A window that begins while the drive runs has seen no start.
TEST(Metrics, FoundAngleErrorIsTheWorstOfItsStarts)
{
    const auto found = [](Sample &s, int k) {
        s.rig.state = k == 0 || k == 300 || k == 600 || k == 800 ? RIG_FINDING : RIG_RUNNING;
        s.rig.angle_error_rad = k == 301 ? 0.1 : k == 601 ? -0.3 : k == 801 ? 0.2 : 1.0;
        s.rig.angle_error_rad = k == 1 ? 0.05 : s.rig.angle_error_rad;
    };
    EXPECT_NEAR(gather("found_angle_error_deg", found).number, -0.3 * 180.0 / pi, exact);
    const auto running = [](Sample &s, int) { s.rig.angle_error_rad = 1.0; };
    EXPECT_TRUE(std::isnan(gather("found_angle_error_deg", running).number));
}

// A vector that is imposed counts while the bridge is on.
TEST(Metrics, OpenLoopIsTheTimeWithAnImposedVector)
{
    const auto story = [](Sample &s, int k) {
        s.rig.dragged = k >= 100 && k < 300;
        s.rig.driven = k >= 150;
    };
    EXPECT_NEAR(gather("open_loop_s", story).number, 150 * 1e-4, exact);
}

// Two faults of which one is a lost position; the bridge is off at once, and a start follows each.
TEST(Metrics, EveryFaultCountsOnce)
{
    const auto story = [](Sample &s, int k) {
        const bool first = k >= 100 && k < 200, second = k >= 500 && k < 600;
        s.rig.fault = first ? 1 : second ? 8 : 0;
        s.rig.state = first || second ? RIG_FAULT : k >= 200 && k < 300 ? RIG_OFF : RIG_RUNNING;
        s.rig.driven = s.rig.state == RIG_RUNNING;
    };
    EXPECT_EQ(gather("fault_count", story).number, 2.0);
    EXPECT_EQ(gather("position_lost_count", story).number, 1.0);
    EXPECT_NE(gather("fault", story).text, "POSITION_LOST");
    EXPECT_EQ(gather("fault", story).number, 1.0);
    EXPECT_EQ(gather("fault_latency_periods", story).number, 0.0);
    EXPECT_EQ(gather("restarts", story).number, 2.0);
    EXPECT_EQ(gather("driven_after_fault_periods", story).number, 200.0 + 400.0);
    EXPECT_NEAR(gather("driven_s", story).number, 700 * 1e-4, exact);
    EXPECT_EQ(gather("open_loop_s", story).number, 0.0);
    Expectation late;
    late.metric = "fault_delay_s";
    late.t0_s = 0.004;
    EXPECT_NEAR(gather(late, story).number, 0.01 - 0.004, exact);
}

// Every term by itself: 1 J more of it is 1 J that the balance misses.
TEST(Metrics, EveryEnergyIsInTheBalance)
{
    for (int term = 0; term < 5; ++term) {
        for (const double sign : {1.0, -1.0}) {
            const auto energies = [&](Sample &s, int k) {
                const double x = k / 999.0;
                double e[5] = {10.0, 2.0, 1.0, 4.0, 3.0};
                e[term] += sign;
                s.rig.truth.e_in_J = 5.0 + e[0] * x;
                s.rig.truth.e_copper_J = 6.0 + e[1] * x;
                s.rig.truth.e_device_J = 7.0 + e[2] * x;
                s.rig.truth.e_mech_J = 8.0 + e[3] * x;
                s.rig.truth.e_field_J = 9.0 + e[4] * x;
            };
            EXPECT_NEAR(gather("energy_residual_rel", energies).number, 1.0 / (20.0 + sign), exact) << term;
        }
    }
    EXPECT_TRUE(std::isnan(gather("energy_residual_rel", [](Sample &, int) {}).number));
}

// Blocks of 120 degrees of 3 A with a torque that alternates; and energies of the window alone.
TEST(Metrics, TorquePerAmpereItsRippleAndLosses)
{
    const auto blocks = [](Sample &s, int k) {
        plant_truth_t &t = s.rig.truth;
        t.i_A[k % 3] = 3.0;
        t.i_A[(k + 1) % 3] = -3.0;
        t.torque_Nm = k % 2 == 0 ? -1.5 : -2.5;
        t.e_copper_J = 7.0 + 1e-4 * 3.0 * k;
        t.e_device_J = 1e-4 * k;
        t.e_mech_J = 5.0 + 1e-4 * 12.0 * k;
    };
    EXPECT_NEAR(gather("torque_per_ampere_Nm_A", blocks).number, 2.0 / (3.0 * std::sqrt(2.0 / 3.0)), exact);
    EXPECT_NEAR(gather("torque_ripple_rel", blocks).number, 0.25, exact);
    EXPECT_NEAR(gather("loss_W", blocks).number, 4.0, 1e-6);
    EXPECT_NEAR(gather("efficiency", blocks).number, 0.75, 1e-6);
    EXPECT_TRUE(std::isnan(gather("loss_W", blocks, 1).number));
    EXPECT_TRUE(std::isnan(gather("efficiency", blocks, 0).number));
}

TEST(Metrics, EveryMetricOfTheTableCanBeMade)
{
    const pmsim::Setup setup = test_setup();
    for (const MetricInfo &info : metric_infos()) {
        Expectation expectation;
        expectation.metric = info.name;
        EXPECT_NE(make_metric(expectation, setup), nullptr) << info.name;
    }
}

Expectation bounded(std::optional<double> min, std::optional<double> max, std::optional<double> max_abs)
{
    Expectation expectation;
    expectation.min = min;
    expectation.max = max;
    expectation.max_abs = max_abs;
    return expectation;
}

TEST(Judge, Bounds)
{
    const std::optional<double> no;
    EXPECT_TRUE(judge(bounded(no, 2.0, no), {2.0, ""}).pass);
    EXPECT_FALSE(judge(bounded(no, 2.0, no), {2.001, ""}).pass);
    EXPECT_TRUE(judge(bounded(1.0, no, no), {1.0, ""}).pass);
    EXPECT_FALSE(judge(bounded(1.0, no, no), {0.999, ""}).pass);
    EXPECT_FALSE(judge(bounded(no, no, 2.0), {-2.001, ""}).pass);
    EXPECT_TRUE(judge(bounded(no, no, 2.0), {-2.0, ""}).pass);
    EXPECT_FALSE(judge(bounded(no, 0.0, no), {1e-12, ""}).pass);
}

TEST(Judge, NothingToJudgeFails)
{
    const std::optional<double> no;
    EXPECT_FALSE(judge(bounded(no, 2.0, no), {std::numeric_limits<double>::quiet_NaN(), ""}).pass);
}

TEST(Judge, Words)
{
    Expectation expectation;
    expectation.equals = "NONE";
    EXPECT_TRUE(judge(expectation, {0.0, "NONE"}).pass);
    EXPECT_FALSE(judge(expectation, {0.0, "STALL"}).pass);
}

} // namespace
} // namespace pmsim
