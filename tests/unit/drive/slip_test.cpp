// Slips against a machine in steady state: voltages from its equations, seen from a frame that is turned away.
#include <gtest/gtest.h>

#include <cmath>

#include "firmware/drive/slip.h"
#include "tests/contract/bench.h"
#include "tests/unit/drive/direct.h"

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
constexpr double kLeast = 0.1, kMost = 0.2; // of the speed

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
        const slip_in_t in = {traits,           fixed(kLeast, 28), fixed(kMost, 28),
                              fixed(omega, 28), bench::dq(v),      bench::dq(i)};
        bool away;
        const pm_angle_t turn = slip_slow(&self, &kMachine, &in, &away);
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

// The EMF tells the pole that is right, too: where it has been along q of the estimate for as long.
TEST(Slip, AnEmfThatAgreesIsCounted)
{
    for (const double omega : {0.11, -0.11, 0.5}) {
        slip_t self;
        slip_reset(&self);
        look(self, SOURCE_HALF_TURN, 20, omega, {0, 0.1}, SLIP_MS - 1);
        EXPECT_EQ(self.agrees_ms, SLIP_MS - 1) << omega;
        look(self, SOURCE_HALF_TURN, 20, omega, {0, 0.1}, 300);
        EXPECT_EQ(self.agrees_ms, SLIP_MS) << omega;
        look(self, SOURCE_HALF_TURN, 75, omega, {0, 0.1}, 1);
        EXPECT_EQ(self.agrees_ms, 0) << omega;
    }
    slip_t slow;
    slip_reset(&slow);
    look(slow, SOURCE_HALF_TURN, 0, 0.09, {0, 0});
    EXPECT_EQ(slow.agrees_ms, 0);
}

// Whether the rotor counts as away; it turns with omega, ahead of an estimate that turns with `estimated`.
bool away(double omega, double estimated, double ahead_deg, Complex i, double R = kR)
{
    const Complex turned = std::polar(1.0, ahead_deg * kDegree);
    const Complex i_rotor = i / turned;
    const Complex psi = {kPsi + kL_d * i_rotor.real(), kL_q * i_rotor.imag()};
    const Complex v = (R * i_rotor + kJ * omega * psi) * turned;
    const slip_in_t in = {SOURCE_HALF_TURN,     fixed(kLeast, 28), fixed(kMost, 28),
                          fixed(estimated, 28), bench::dq(v),      bench::dq(i)};
    slip_t self;
    slip_reset(&self);
    bool away = false;
    slip_slow(&self, &kMachine, &in, &away);
    return away;
}

// Up to where the source leads and beyond, 30 degrees off, with R 40 % off and any current up to rated.
TEST(Slip, ARotorThatIsFollowedIsNotAway)
{
    for (const double omega : {0.0, 0.1, 1.1 * kMost, -1.1 * kMost}) {
        for (const double ahead_deg : {-30.0, 0.0, 30.0}) {
            for (const Complex i :
                 {Complex{0, 0}, Complex{-0.1, 0.35}, Complex{-0.1, -0.35}, Complex{0.2, 0.1}}) {
                for (const double share : {0.6, 1.0, 1.4}) {
                    EXPECT_FALSE(away(omega, omega, ahead_deg, i, share * kR))
                        << omega << ' ' << ahead_deg << i;
                }
            }
        }
    }
}

// At any angle, whatever the estimate says; the currents that its beat drives hide it for less than half of that.
TEST(Slip, ARotorThatRunsAwayIsSeen)
{
    for (const double omega : {4 * kMost, -4 * kMost}) {
        for (const double estimated : {0.0, 0.5 * kMost, -kMost}) {
            int seen = 0;
            for (int deg = 0; deg < 360; ++deg) {
                EXPECT_TRUE(away(omega, estimated, deg, {0, 0})) << omega << ' ' << deg;
                seen += away(omega, estimated, deg, {-0.1, 0.3}) ? 1 : 0;
            }
            EXPECT_GT(seen, 180) << omega << ' ' << estimated;
        }
    }
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

// The drive turns its frame with the position; with one slip too many it gives up. The voltage is that of a rotor at the
// other pole, whatever the drive does.
TEST(Slip, ThreeArePutRightTheFourthIsAFault)
{
    direct::Drive x(direct::params(1));
    drive_t &d = x.d;
    for (pm_q_t &zero : d.zero) {
        zero = PM_ONE; // mid-scale
    }
    x.run_ms(1); // the DC link is known
    d.state = DRIVE_RUNNING;
    d.command.enable = true;
    d.config.protection.lost_ms = UINT16_MAX; // the quality, which such a position has lost, is not asked
    position_reset(&d.position, &d.config.position, &direct::kAtRest, {0, 0}, true);
    d.stage = STAGE_VECTOR;
    const pm_q_t omega = d.config.position.omega_low + d.config.position.omega_low / 8;
    const pm_q_t emf = pm_mul(omega, d.config.machine.psi_m);
    int turns = 0;
    for (int ms = 0; ms < 4 * static_cast<int>(SLIP_MS) + 20 && d.fault == DRIVE_FAULT_NONE; ++ms) {
        d.position.pll = {0, omega};
        d.position.inject = true;
        d.voltage.v = {pm_widen(emf) / 2, -pm_widen(emf)};
        const drive_slow_in_t slow = {250};
        drive_slow(&d, &slow);
        if (d.fault == DRIVE_FAULT_NONE && d.position.pll.theta != 0U) {
            ++turns;
            EXPECT_EQ(d.position.pll.theta, PM_TURN(0.5));
            EXPECT_NEAR(bench::real(d.regulator.synchronous_pi.d.integral, 22), -bench::real(emf) / 2, 1e-3);
            EXPECT_NE(drive_status(&d)->limits & DRIVE_LIMIT_SLIP, 0U);
        }
    }
    EXPECT_EQ(turns, static_cast<int>(SLIP_MOST));
    EXPECT_EQ(d.fault, DRIVE_FAULT_POSITION_LOST);
}

// A rotor that a torque from the wrong side has driven back is braked with what was wanted, by a ramp from rest; one that turns the right
// way goes on from its speed. Without it the ramp began at the speed backwards, with the current that had driven it there.
TEST(Slip, WhatWasWantedIsWantedStill)
{
    for (const bool back : {true, false}) {
        direct::Drive x(direct::params(1));
        drive_t &d = x.d;
        for (pm_q_t &zero : d.zero) {
            zero = PM_ONE;
        }
        x.run_ms(1);
        d.state = DRIVE_RUNNING;
        d.command.enable = true;
        d.config.protection.lost_ms = UINT16_MAX;
        position_reset(&d.position, &d.config.position, &direct::kAtRest, {0, 0}, true);
        d.stage = STAGE_VECTOR;
        const pm_q_t size = d.config.position.omega_low + d.config.position.omega_low / 8;
        const pm_q_t omega = back ? -size : size;
        const pm_q_t emf = pm_mul(omega, d.config.machine.psi_m);
        const pm_q_t wanted = d.config.i_max / 2;
        bool resolved = false;
        for (unsigned ms = 0; ms < SLIP_MS + 5 && !resolved; ++ms) {
            d.position.pll = {0, omega};
            d.position.inject = true;
            d.voltage.v = {0, -pm_widen(emf)};
            speed_control_reset(&d.speed, omega, wanted);
            const drive_slow_in_t slow = {250};
            drive_slow(&d, &slow);
            resolved = d.position.pll.theta != 0U;
        }
        ASSERT_TRUE(resolved) << back;
        EXPECT_EQ(d.speed.reference, back ? 0 : omega);
        EXPECT_GT(d.i_ref.q, 0) << back;
        EXPECT_EQ(d.speed.pi.integral, pm_widen(d.i_ref.q)) << back;
    }
}

} // namespace
