// Slips against a machine in steady state: voltages from its equations, seen from a frame that is turned away.
#include <gtest/gtest.h>

#include <cmath>

#include "firmware/drive/slip.h"
#include "tests/contract/bench.h"

namespace
{

using bench::Complex;
using bench::fixed;
using bench::kDegree;
using bench::kJ;
using bench::kPi;

// Per unit; the current's direction is that of the estimated frame.
constexpr double kR = 0.13, kL_d = 0.5, kL_q = 0.9, kPsi = 0.28;

const pm_machine_t kMachine = {fixed(kR, 28), fixed(kPsi, 28), fixed(kL_d, 28), fixed(kL_q, 28)};
constexpr double kLeast = 0.1; // of the speed

// Periods of 1 kHz until a slip is found, of `most`; the rotor is ahead of the estimate by `ahead_deg`.
struct Found {
    int ms;
    double turn_deg;
};

Found look(slip_t &self, unsigned traits, double ahead_deg, double omega, Complex i, int most = 200,
           double R = kR)
{
    const Complex turned = std::polar(1.0, ahead_deg * kDegree);
    const Complex i_rotor = i / turned;
    const Complex psi = {kPsi + kL_d * i_rotor.real(), kL_q * i_rotor.imag()};
    const Complex v = (R * i_rotor + kJ * omega * psi) * turned;
    for (int ms = 1; ms <= most; ++ms) {
        const slip_in_t in = {traits, fixed(kLeast, 28), fixed(omega, 28), bench::dq(v), bench::dq(i)};
        const pm_angle_t turn = slip_slow(&self, &kMachine, &in);
        if (turn != 0U) {
            return {ms, bench::rad(turn) / kDegree};
        }
    }
    return {0, 0};
}

Found look(unsigned traits, double ahead_deg, double omega, Complex i, double R = kR)
{
    slip_t self;
    slip_reset(&self);
    return look(self, traits, ahead_deg, omega, i, 200, R);
}

TEST(Slip, HalfATurnIsFoundWithinItsTime)
{
    for (const double omega : {0.11, -0.11, 0.5, -0.5}) {
        for (const Complex i : {Complex{0, 0}, Complex{0, 0.3}, Complex{-0.1, -0.3}}) {
            const Found x = look(SOURCE_HALF_TURN, 180, omega, i);
            EXPECT_EQ(x.ms, static_cast<int>(SLIP_MS)) << omega << ' ' << i;
            EXPECT_NEAR(std::fabs(x.turn_deg), 180, 1e-6);
        }
    }
}

TEST(Slip, AThirdIsFoundWithItsDirection)
{
    for (const double omega : {0.2, -0.2}) {
        for (const double third : {120.0, -120.0}) {
            const Found x = look(SOURCE_THIRD_TURN, third, omega, {-0.05, 0.1});
            EXPECT_EQ(x.ms, static_cast<int>(SLIP_MS));
            EXPECT_NEAR(x.turn_deg, third, 1e-6) << omega;
        }
    }
}

// An error of the position that the source corrects by itself, up to the middle between its answers.
TEST(Slip, ErrorsOfTheSourceAreNone)
{
    for (const double omega : {0.2, -0.2}) {
        for (const double error : {0.0, 30.0, -30.0, 60.0, -60.0, 90.0, -90.0}) {
            EXPECT_EQ(look(SOURCE_HALF_TURN, error, omega, 0).ms, 0) << error;
            if (std::fabs(error) <= 60) {
                EXPECT_EQ(look(SOURCE_THIRD_TURN, error, omega, 0).ms, 0) << error;
            }
        }
    }
}

TEST(Slip, NoneWhereTheSourceIsUniqueOrTheEmfTooSmall)
{
    EXPECT_EQ(look(0, 180, 0.5, 0).ms, 0);
    EXPECT_EQ(look(SOURCE_HALF_TURN, 180, 0.09, 0).ms, 0);
}

// omega psi_m from where it is judged, 0.4 R i, and R off by a fifth: no false slip. Below nothing is judged.
TEST(Slip, WrongResistanceDoesNotMatter)
{
    const double omega = 0.12, i = omega * kPsi / (0.4 * kR);
    for (const double R : {0.8 * kR, 1.2 * kR}) {
        for (const Complex axis : {Complex{0, i}, Complex{0, -i}, Complex{i, 0}, Complex{-i, 0}}) {
            EXPECT_EQ(look(SOURCE_HALF_TURN, 0, omega, 0.99 * axis, R).ms, 0) << R << axis;
            EXPECT_EQ(look(SOURCE_HALF_TURN, 180, omega, 1.05 * axis).ms, 0) << axis;
        }
    }
}

TEST(Slip, ACrossingShorterThanItsTimeIsNone)
{
    slip_t self;
    slip_reset(&self);
    for (int n = 0; n < 10; ++n) {
        EXPECT_EQ(look(self, SOURCE_HALF_TURN, 180, 0.5, 0, static_cast<int>(SLIP_MS) - 1).ms, 0);
        EXPECT_EQ(look(self, SOURCE_HALF_TURN, 0, 0.5, 0, 1).ms, 0);
    }
    EXPECT_EQ(self.count, 0);
}

TEST(Slip, EachIsCounted)
{
    slip_t self;
    slip_reset(&self);
    for (int n = 1; n <= 4; ++n) {
        EXPECT_GT(look(self, SOURCE_HALF_TURN, 180, 0.5, 0).ms, 0);
        EXPECT_EQ(self.count, n);
    }
}

} // namespace
