#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/injection/sine_rig.h"

namespace
{

using bench::Complex;
using bench::kDegree;
using bench::Machine;

// I_p - 3.7 times I_n - and the gain belong to a machine without resistance: (R / omega_h L)^2, 2e-3 of I_p.
constexpr double kEps = 0.006;
constexpr double kZero_deg = 0.3;
// Detection on both axes and ten time constants of the stator.
constexpr int kSettled = 1500;
constexpr double kF = 35e-4 / (2 * 0.15643446504); // V_h T_s / (2 sin(pi / 20))

const Machine &kMachine = bench::kIpmLinear;
const double kI_n = kF * (1 / kMachine.L_d0_H - 1 / kMachine.L_q0_H) / 2;
const double kI_p = kF * (1 / kMachine.L_d0_H + 1 / kMachine.L_q0_H) / 2;

injection_config_t config(bool detected = true)
{
    return rig::config(INJECTION_stationary_sine, 6, detected);
}

rig::Answer settled(const injection_config_t &c, double theta, double error_rad, double R_ohm = 6,
                    Complex i_dq_A = 0)
{
    rig::Run run(c);
    run.theta = theta;
    run.error = error_rad;
    run.R_ohm = R_ohm;
    run.i_dq_A = i_dq_A;
    return run.after(kSettled);
}

TEST(StationarySine, ErrorSignalIsHalfTheSineOfTwiceTheError)
{
    for (const bool detected : {true, false}) {
        const injection_config_t c = config(detected);
        for (int a = -90; a <= 90; a += 15) {
            EXPECT_NEAR(settled(c, 0.4, a * kDegree, 1e-3).eps, 0.5 * std::sin(2 * a * kDegree), kEps) << a;
        }
    }
}

TEST(StationarySine, TheAnswerIsThatOfTheSaliencyAtAnyPosition)
{
    for (const double theta : {0.0, 0.8, 2.0, -1.0}) {
        const rig::Answer a = settled(config(), theta, 0);
        EXPECT_NEAR(a.eps / kDegree, 0, kZero_deg) << theta;
        EXPECT_NEAR(a.vector.real() / kI_n, 1, 0.02) << theta;
        EXPECT_NEAR(a.misfit, 0, 0.02) << theta;
    }
}

// METHODS.md 4.4.2.2 (e): I_p wrong by 0.1 I_n, sin 2 theta of 2.9 degrees.
TEST(StationarySine, AWrongIpMovesThePositionBySinTwoTheta)
{
    for (const double theta : {0.2, 0.8, 1.2, -0.8}) {
        injection_config_t c = config(false);
        const double more = 0.1 * kI_n / kI_p;
        c.stationary_sine.saliency.i_p_0 +=
            static_cast<pm_q_t>(std::lround(more * c.stationary_sine.saliency.i_p_0));
        const double expected = 0.05 / kDegree * std::sin(2 * theta);
        const double without = settled(config(false), theta, 0, 1e-3).eps / kDegree;
        EXPECT_NEAR(settled(c, theta, 0, 1e-3).eps / kDegree - without, expected, 0.05) << theta;
        // detected: whatever the configuration has
        c.stationary_sine.stationary.find = true;
        EXPECT_NEAR(settled(c, theta, 0, 1e-3).eps / kDegree, 0, kZero_deg) << theta;
    }
}

// A voltage in phase with the current: as a resistance. I_p cos^2 delta is in phase with a fixed reference, I_p cos
// delta with the answer's own.
TEST(StationarySine, WhatTheInverterTakesIsSeenInThePhase)
{
    const double R = 25, theta = 0.8, phase = R * kI_p / kF / (2 * bench::kPi * 500);
    const double taken_deg = kI_p / (2 * kI_n) * phase * phase / kDegree; // of an I_p that is not reduced
    EXPECT_GT(taken_deg, 2);
    EXPECT_GT(std::abs(settled(config(false), theta, 0, R).eps / kDegree), taken_deg / 2);
    EXPECT_LT(std::abs(settled(config(), theta, 0, R).eps / kDegree), taken_deg / 4);
}

TEST(StationarySine, SpeedMovesNoAngle)
{
    for (const double omega : {30.0, -30.0}) {
        rig::Run run(config());
        run.omega = omega;
        run.i_dq_A = {0, 3};
        run.after(kSettled);
        double mean = 0, most = 0; // half a turn
        const int n = static_cast<int>(std::lround(bench::kPi / std::abs(omega) / rig::kBase.period_s));
        for (int k = 0; k < n; ++k) {
            const double eps = run.step().eps / kDegree;
            mean += eps / n;
            most = std::max(most, std::abs(eps));
        }
        EXPECT_NEAR(mean, 0, 0.1) << omega;
        EXPECT_LT(most, 2) << omega; // the image at 2 omega_h: I_p omega / (2 omega_h), 1 degree
    }
}

// METHODS.md 4.4.2.3 (e): the carrier does not follow the estimate.
TEST(StationarySine, LocksFromAnyErrorUpTo85Degrees)
{
    for (int a = -85; a <= 85; a += 17) {
        rig::Run run(config());
        run.after(400); // I_p is found
        run.error = a * kDegree;
        run.loop_Hz = 20;
        EXPECT_LT(run.settling(2000, 5 * kDegree) * rig::kBase.period_s, 0.100) << a;
    }
}

TEST(StationarySine, FundamentalCurrentIsFreeOfTheCarrier)
{
    const rig::Answer a = settled(config(), 0.4, 0.1, 6, {0.5, 3});
    EXPECT_LT(std::abs(a.i_A - Complex(0.5, 3) * std::polar(1.0, 0.1)), 3e-3);
}

// On alpha, on beta, on alpha; its flux ends where it began.
TEST(StationarySine, CarrierIsOnAlphaAndBetaAndStaysOnAlpha)
{
    rig::Run run(config()), elsewhere(config());
    elsewhere.theta = 2;
    elsewhere.error = 1;
    run.after(1000);
    elsewhere.after(1000);
    int changes = 0;
    double most = 0;
    for (size_t k = 0; k < 1000; ++k) {
        const Complex v = bench::complex(run.given[k]) * rig::kBase.v_V;
        EXPECT_EQ(run.given[k].alpha, elsewhere.given[k].alpha) << k;
        EXPECT_EQ(run.given[k].beta, elsewhere.given[k].beta) << k;
        EXPECT_TRUE(run.given[k].alpha == 0 || run.given[k].beta == 0) << k;
        most = std::max(most, std::abs(v));
        changes += k > 0 && (run.given[k].beta != 0) != (run.given[k - 1].beta != 0) ? 1 : 0;
        EXPECT_TRUE(k < 400 || run.given[k].beta == 0) << k;
    }
    EXPECT_NEAR(most, 35, 1e-4);
    EXPECT_GE(changes, 2);
}

TEST(StationarySine, MisfitIsTheSaliencyThatIsMissing)
{
    injection_config_t c = config();
    c.stationary_sine.saliency.gain_0 /= 2; // twice the saliency expected
    EXPECT_NEAR(settled(c, 0.4, 0).misfit, -0.5, 0.02);
}

} // namespace
