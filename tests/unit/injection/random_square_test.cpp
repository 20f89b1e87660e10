// Square wave of pseudo-random sequence on a machine from its differential equation in the rotor frame.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/injection/rig.h"

namespace
{

using bench::Complex;
using bench::kDegree;

// The resistance moves h_q by (R T_s / L)^2 at most; samples are rounded to 2^-28.
constexpr double kZero_deg = 0.05;
constexpr double kSine = 0.005;

injection_config_t config()
{
    return rig::config(INJECTION_random_square, 6, false);
}

rig::Answer settled(double error_rad, double omega = 0, Complex i_dq_A = 0)
{
    rig::Run run(config());
    run.error = error_rad;
    run.omega = omega;
    run.i_dq_A = i_dq_A;
    run.R_ohm = 1e-3;
    return run.after(200);
}

// +-1 along d of the estimated frame, which lies at `theta`.
int sign_of(const excitation_t &e, double theta)
{
    return (bench::complex(e.v) * std::polar(1.0, -theta)).real() > 0 ? 1 : -1;
}

TEST(RandomSquare, ErrorSignalIsHalfTheSineOfTwiceTheError)
{
    for (int a = -90; a <= 90; a += 10) {
        EXPECT_NEAR(settled(a * kDegree).eps, 0.5 * std::sin(2 * a * kDegree), kSine) << a;
    }
}

TEST(RandomSquare, ARotorThatTurnsIsSeenWhereItIs)
{
    for (const double omega : {-60.0, -15.0, 15.0, 60.0}) {
        EXPECT_NEAR(settled(0, omega).eps / kDegree, 0, kZero_deg) << omega;
    }
}

TEST(RandomSquare, CyclesHaveNoVoltSecondsAndBeginEitherWay)
{
    rig::Run run(config());
    run.R_ohm = 6;
    run.after(4000);
    int forwards = 0, same = 0, before = 0, longest = 0, length = 0;
    const int cycles = static_cast<int>(run.given.size()) / 2;
    for (int n = 0; n < cycles; ++n) {
        const int first = sign_of(run.given[static_cast<size_t>(2 * n)], run.theta),
                  second = sign_of(run.given[static_cast<size_t>(2 * n + 1)], run.theta);
        ASSERT_EQ(first, -second) << n;
        forwards += first > 0;
        same += first == before;
        length = first == before ? length + 1 : 1;
        longest = std::max(longest, length);
        before = first;
    }
    // A fair coin: half of 2000 and four deviations of 22.
    EXPECT_NEAR(forwards, 0.5 * cycles, 90);
    EXPECT_NEAR(same, 0.5 * cycles, 90);
    EXPECT_GE(longest, 6);
    EXPECT_LE(longest, 20);
}

// Without resistance, which leaves R T_s / L_d of each cycle's 81 mA: current control takes out what adds up of that.
TEST(RandomSquare, FundamentalCurrentIsWithoutTheCarrier)
{
    rig::Run run(config());
    run.error = 0.1;
    run.R_ohm = 1e-3;
    run.i_dq_A = {0.5, 3};
    run.after(400);
    for (int k = 0; k < 20; ++k) {
        EXPECT_LT(std::abs(run.step().i_A - Complex(0.5, 3) * std::polar(1.0, 0.1)), 2e-3);
    }
}

TEST(RandomSquare, MisfitIsTheChangeOfTheAnswer)
{
    EXPECT_NEAR(settled(0).misfit, 0, 0.01);
    injection_config_t c = config();
    c.random_square.v_h /= 2;
    rig::Run run(c);
    EXPECT_NEAR(run.after(200).misfit, -0.5, 0.01);
}

// A step of the voltage that control makes at the start of a cycle, which is where the fundamental current changes.
TEST(RandomSquare, FundamentalCurrentStandsForAWholeCycle)
{
    rig::Run run(config());
    run.omega = 30;
    run.after(100);
    for (int k = 0; k < 10; ++k) {
        const Complex first = run.step().i_A, second = run.step().i_A;
        EXPECT_EQ(first, second) << k;
    }
}

} // namespace
