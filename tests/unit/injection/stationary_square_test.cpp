// What stationary_square.h has beside stationary_test.cpp.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/injection/rig.h"

namespace
{

using bench::Complex;
using bench::kDegree;
using bench::Machine;

constexpr int kSettled = 1500; // detection on both axes and ten time constants of the stator
constexpr double kF = 35e-4;   // V_h T_s

const Machine &kMachine = bench::kIpmLinear;
const double kI_n = kF * (1 / kMachine.L_d0_H - 1 / kMachine.L_q0_H) / 2;
const double kI_p = kF * (1 / kMachine.L_d0_H + 1 / kMachine.L_q0_H) / 2;

injection_config_t config(bool detected = true)
{
    return rig::config(INJECTION_stationary_square, 6, detected);
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

// The position loop moves with the error that I_p makes; the detection must not be moved by it.
TEST(StationarySquare, DetectedWhateverTheLoopDoesAndWhileItTurns)
{
    for (const double omega : {0.0, 30.0, -30.0}) {
        injection_config_t c = config();
        c.stationary_square.saliency.i_p_0 +=
            static_cast<pm_q_t>(std::lround(0.1 * kI_n / kI_p * c.stationary_square.saliency.i_p_0));
        for (const double theta : {0.2, 0.8, -0.8}) {
            rig::Run run(c);
            run.theta = theta;
            run.omega = omega;
            run.loop_Hz = 20;
            run.after(3000);
            double most = 0;
            for (int k = 0; k < 1100; ++k) {
                run.step();
                most = std::max(most, std::abs(run.error) / kDegree);
            }
            EXPECT_LT(most, 1) << omega << ' ' << theta; // not detected: 2.9
        }
    }
}

TEST(StationarySquare, SpeedMovesNoAngle)
{
    for (const double omega : {30.0, -30.0}) {
        rig::Run run(config());
        run.omega = omega;
        run.i_dq_A = {0, 3};
        run.after(kSettled);
        double mean = 0; // half a turn
        const int n = static_cast<int>(std::lround(bench::kPi / std::abs(omega) / rig::kBase.period_s));
        for (int k = 0; k < n; ++k) {
            mean += run.step().eps / kDegree / n;
        }
        EXPECT_NEAR(mean, 0, 0.05) << omega; // 1.5 periods untold: 0.26
    }
}

TEST(StationarySquare, FundamentalCurrentIsTheMeanOfTwoSamples)
{
    const rig::Answer a = settled(config(), 0.4, 0.1, 6, {0.5, 3});
    EXPECT_LT(std::abs(a.i_A - Complex(0.5, 3) * std::polar(1.0, 0.1)), kF / kMachine.L_d0_H / 2);
}

TEST(StationarySquare, CarrierAlternatesEachPeriod)
{
    rig::Run run(config());
    run.after(1000);
    for (size_t k = 0; k < 1000; ++k) {
        const Complex v = bench::complex(run.given[k].v) * rig::kBase.v_V;
        EXPECT_NEAR(v.real() + v.imag(), k % 2 == 0 ? 35 : -35, 1e-4) << k;
    }
}

} // namespace
