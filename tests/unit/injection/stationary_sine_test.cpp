// What stationary_sine.h has beside stationary_test.cpp.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/injection/rig.h"

namespace
{

using bench::Complex;
using bench::kDegree;
using bench::Machine;

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

TEST(StationarySine, FundamentalCurrentIsFreeOfTheCarrier)
{
    const rig::Answer a = settled(config(), 0.4, 0.1, 6, {0.5, 3});
    EXPECT_LT(std::abs(a.i_A - Complex(0.5, 3) * std::polar(1.0, 0.1)), 3e-3);
}

} // namespace
