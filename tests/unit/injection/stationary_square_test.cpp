#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/injection/sine_rig.h"

namespace
{

using bench::Complex;
using bench::kDegree;
using bench::Machine;

// Resistance takes R T_s / L from an answer, 1 % of I_p, 3.7 I_n, alike in all directions: detected. The gain has the rest.
constexpr double kEps = 0.01;
constexpr double kZero_deg = 0.3;
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

TEST(StationarySquare, ErrorSignalIsHalfTheSineOfTwiceTheError)
{
    for (const bool detected : {true, false}) {
        const injection_config_t c = config(detected);
        for (int a = -90; a <= 90; a += 15) {
            EXPECT_NEAR(settled(c, 0.4, a * kDegree, 1e-3).eps, 0.5 * std::sin(2 * a * kDegree), kEps) << a;
        }
    }
}

TEST(StationarySquare, TheAnswerIsThatOfTheSaliencyAtAnyPosition)
{
    for (const double theta : {0.0, 0.8, 2.0, -1.0}) {
        const rig::Answer a = settled(config(), theta, 0);
        EXPECT_NEAR(a.eps / kDegree, 0, kZero_deg) << theta;
        EXPECT_NEAR(a.vector.real() / kI_n, 1, 0.03) << theta;
        EXPECT_NEAR(a.misfit, 0, 0.03) << theta;
    }
}

// METHODS.md 4.4.2.2 (e): I_p wrong by 0.1 I_n, sin 2 theta of 2.9 degrees.
TEST(StationarySquare, AWrongIpMovesThePositionBySinTwoTheta)
{
    for (const double theta : {0.2, 0.8, 1.2, -0.8}) {
        injection_config_t c = config(false);
        const double more = 0.1 * kI_n / kI_p;
        c.stationary_square.saliency.i_p_0 +=
            static_cast<pm_q_t>(std::lround(more * c.stationary_square.saliency.i_p_0));
        const double expected = 0.05 / kDegree * std::sin(2 * theta);
        const double without = settled(config(false), theta, 0, 1e-3).eps / kDegree;
        EXPECT_NEAR(settled(c, theta, 0, 1e-3).eps / kDegree - without, expected, 0.05) << theta;
        // detected: whatever the configuration has
        c.stationary_square.stationary.find = true;
        EXPECT_NEAR(settled(c, theta, 0, 1e-3).eps / kDegree, 0, kZero_deg) << theta;
    }
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

// METHODS.md 4.4.2.3 (e), as of the sine.
TEST(StationarySquare, LocksFromAnyErrorUpTo85Degrees)
{
    for (int a = -85; a <= 85; a += 17) {
        rig::Run run(config());
        run.after(400); // I_p is found
        run.error = a * kDegree;
        run.loop_Hz = 60;
        EXPECT_LT(run.settling(2000, 5 * kDegree) * rig::kBase.period_s, 0.040) << a;
    }
}

TEST(StationarySquare, FundamentalCurrentIsTheMeanOfTwoSamples)
{
    const rig::Answer a = settled(config(), 0.4, 0.1, 6, {0.5, 3});
    EXPECT_LT(std::abs(a.i_A - Complex(0.5, 3) * std::polar(1.0, 0.1)), kF / kMachine.L_d0_H / 2);
}

TEST(StationarySquare, CarrierAlternatesOnAlphaAndBetaAndStaysOnAlpha)
{
    rig::Run run(config()), elsewhere(config());
    elsewhere.theta = 2;
    elsewhere.error = 1;
    run.after(1000);
    elsewhere.after(1000);
    int changes = 0;
    for (size_t k = 0; k < 1000; ++k) {
        const Complex v = bench::complex(run.given[k]) * rig::kBase.v_V;
        EXPECT_EQ(run.given[k].alpha, elsewhere.given[k].alpha) << k;
        EXPECT_EQ(run.given[k].beta, elsewhere.given[k].beta) << k;
        EXPECT_NEAR(v.real() + v.imag(), k % 2 == 0 ? 35 : -35, 1e-4) << k;
        EXPECT_TRUE(run.given[k].alpha == 0 || run.given[k].beta == 0) << k;
        changes += k > 0 && (run.given[k].beta != 0) != (run.given[k - 1].beta != 0) ? 1 : 0;
    }
    EXPECT_EQ(changes, 2);
    EXPECT_EQ(run.given[999].beta, 0);
}

TEST(StationarySquare, MisfitIsTheSaliencyThatIsMissing)
{
    injection_config_t c = config();
    c.stationary_square.saliency.gain_0 /= 2; // twice the saliency expected
    EXPECT_NEAR(settled(c, 0.4, 0).misfit, -0.5, 0.03);
}

} // namespace
