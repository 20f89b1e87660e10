// What an imposed vector sees of a rotor, against a machine in steady state: voltages from its equations.
#include <gtest/gtest.h>

#include <cmath>

#include "firmware/drive/follow.h"
#include "tests/contract/bench.h"
#include "tests/unit/drive/direct.h"

namespace
{

using bench::Complex;
using bench::fixed;
using bench::kDegree;
using bench::kJ;
using bench::real;

// Per unit.
constexpr double kR = 0.13, kL_d = 0.5, kPsi = 0.28, kV_dc = 0.6, kCurrent = 0.2;

pm_machine_t machine(double L_q = kL_d)
{
    return {fixed(kR, 28), fixed(kPsi, 28), fixed(kL_d, 28), fixed(L_q, 28)};
}

struct Rig {
    pm_machine_t told = machine();
    double R = kR, L_q = kL_d; // the truth
    double turn = 0.02;        // of the vector, of a turn per ms
    follow_t self = {};

    Rig()
    {
        follow_reset(&self, &told);
    }

    void rest(int ms = 200, double lost = 0)
    {
        for (int n = 0; n < ms; ++n) {
            follow_rest(&self, fixed(R * kCurrent + lost, 28));
        }
        follow_rested(&self, &told, fixed(kCurrent, 28), fixed(kV_dc, 28));
    }

    // Voltage in the frame of the vector, the rotor `lag` behind it; it stands: the magnets' EMF is missing.
    bool step(double omega, double lag_deg, bool stands = false, double lost = 0)
    {
        const Complex turned = std::polar(1.0, -lag_deg * kDegree); // the rotor in the frame
        const Complex i_rotor = kCurrent / turned;
        const Complex psi = {(stands ? 0 : kPsi) + kL_d * i_rotor.real(), L_q * i_rotor.imag()};
        const Complex v = R * kCurrent + lost + kJ * omega * psi * turned;
        const follow_in_t in = {fixed(omega, 28), bench::dq(v), fixed(kCurrent, 28), fixed(kV_dc, 28),
                                static_cast<int32_t>(std::lround(turn * FOLLOW_TURN))};
        return follow_slow(&self, &told, &in);
    }

    // Milliseconds until it is said to stand, of `most`.
    int stands(double omega, int most = 500)
    {
        for (int ms = 1; ms <= most; ++ms) {
            if (step(omega, 0, true)) {
                return ms;
            }
        }
        return 0;
    }
};

// omega psi_m / 2 = R / 32 i + v_dc / 512
constexpr double kSeen = 2 * (kR * kCurrent / 32 + kV_dc / 512) / kPsi;

TEST(Follow, ALagOfUpToAQuarterTurnFollows)
{
    for (const double omega : {1.02 * kSeen, -1.02 * kSeen, 0.2, -0.2}) {
        for (double lag = -90; lag <= 90; lag += 15) {
            Rig x;
            x.rest();
            for (int ms = 0; ms < 400; ++ms) {
                ASSERT_FALSE(x.step(omega, lag)) << omega << ' ' << lag;
            }
            EXPECT_TRUE(x.self.follows);
            EXPECT_NEAR(static_cast<int32_t>(x.self.lag) / std::pow(2, 32) * 360, lag, 0.5);
            EXPECT_NEAR(real(x.self.along), omega * kPsi * std::sin(lag * kDegree),
                        1e-4 * std::abs(omega) + 1e-6);
            EXPECT_NEAR(real(x.self.across), omega * kPsi * std::cos(lag * kDegree),
                        1e-4 * std::abs(omega) + 1e-6);
        }
    }
}

// Behind an observer the vector damps at once, long before the filters show that the rotor follows.
TEST(Follow, TheLagIsKnownFromTheFirstMillisecondBehindAnObserver)
{
    for (const double omega : {0.2, -0.2}) {
        for (const double lag : {-60.0, 15.0, 60.0}) {
            Rig x;
            x.rest();
            follow_resume(&x.self);
            for (int ms = 0; ms < 30; ++ms) {
                x.step(omega, lag);
                ASSERT_NEAR(static_cast<int32_t>(x.self.lag) / std::pow(2, 32) * 360, lag, 0.5)
                    << omega << ' ' << ms;
            }
        }
    }
}

TEST(Follow, ARotorThatStandsIsSeenFromTheSpeedOnAtWhichItsEmfWouldShow)
{
    for (const double sign : {1.0, -1.0}) {
        Rig x;
        x.rest();
        EXPECT_EQ(x.stands(sign * 1.02 * kSeen), int(FOLLOW_STANDS_MS));
        EXPECT_FALSE(x.self.follows);
        Rig slow;
        slow.rest();
        EXPECT_EQ(slow.stands(sign * 0.98 * kSeen), 0);
        Rig untold; // without a rest R may be off by a quarter
        EXPECT_EQ(untold.stands(sign * 1.02 * kSeen), 0);
        EXPECT_EQ(untold.stands(sign * 2 * (kR * kCurrent / 4 + kV_dc / 512) / kPsi * 1.02),
                  int(FOLLOW_STANDS_MS));
    }
}

// Friction holds a rotor until the vector is so far ahead.
TEST(Follow, AThirdOfATurnIsWaitedFor)
{
    for (const double turn : {1.0 / 300, 1.0 / 600}) {
        Rig x;
        x.turn = turn;
        x.rest();
        EXPECT_NEAR(x.stands(0.1), 1 / (3 * turn), 2);
    }
    Rig x;
    x.turn = 1.0 / 300;
    x.rest();
    for (int n = 0; n < 5; ++n) {
        for (int ms = 0; ms < 80; ++ms) {
            ASSERT_FALSE(x.step(0.1, 0, true));
        }
        for (int ms = 0; ms < 90; ++ms) { // follows
            ASSERT_FALSE(x.step(0.1, 40));
        }
    }
}

// Behind an observer, which knew that it turned, it may swing meanwhile.
TEST(Follow, ARotorThatTurnedIsWaitedForAWholeTurn)
{
    for (const double turn : {0.01, 1.0 / 300}) {
        Rig x;
        x.turn = turn;
        x.rest();
        follow_resume(&x.self);
        EXPECT_NEAR(x.stands(0.1), 1 / turn, 2);
    }
}

// A vector that passes a salient rotor sees its saliency alternate.
TEST(Follow, SaliencyIsNoEmf)
{
    Rig x;
    x.L_q = 2.5 * kL_d; // (L_q - L_d) i = 0.54 psi_m
    x.told = machine(x.L_q);
    x.rest();
    bool stands = false;
    for (int ms = 0; ms < 300 && !stands; ++ms) {
        stands = x.step(0.1, 360 * x.turn * ms, true);
    }
    EXPECT_TRUE(stands);
    EXPECT_FALSE(x.self.follows);
}

// Of a rotor on the vector saliency takes (L_q - L_d) i / 2 = 0.27 psi_m; that is not the EMF of one that stands, even where
// psi_m is told half too large.
TEST(Follow, WhatSaliencyTakesIsNotMissing)
{
    for (const double omega : {0.1, -0.1}) {
        Rig x;
        x.L_q = 2.5 * kL_d;
        x.told = machine(x.L_q);
        x.told.psi_m = fixed(1.5 * kPsi, 28);
        x.rest();
        for (int ms = 0; ms < 300; ++ms) {
            ASSERT_FALSE(x.step(omega, 0)) << ms;
        }
        EXPECT_TRUE(x.self.follows);
    }
}

// R a fifth and half off, and what dead time leaves: known from the rest, within R / 2 and v_dc / 64.
TEST(Follow, TheRestTellsTheResistance)
{
    for (const double R : {0.8 * kR, 1.2 * kR, 1.5 * kR}) {
        for (const double lost : {-kV_dc / 70, 0.0, kV_dc / 70}) {
            Rig x;
            x.R = R;
            x.rest(200, lost);
            EXPECT_NEAR(real(x.self.R), R + lost / kCurrent, 1e-5);
            for (int ms = 0; ms < 300; ++ms) {
                ASSERT_FALSE(x.step(0.1, 30, false, lost));
            }
            EXPECT_NEAR(real(x.self.along), 0.1 * kPsi / 2, 1e-5);
        }
    }
    Rig x;
    x.R = 3 * kR;
    x.rest();
    EXPECT_NEAR(real(x.self.R), 1.5 * kR + kV_dc / 64 / kCurrent, 1e-5);
    x = Rig();
    x.R = 1.2 * kR;
    x.rest(FOLLOW_REST_MS - 1); // too short
    EXPECT_EQ(x.self.R, x.told.R_s);
    for (int ms = 0; ms < int(FOLLOW_REST_MS); ++ms) { // long enough, without a current
        follow_rest(&x.self, fixed(0.1, 28));
    }
    follow_rested(&x.self, &x.told, 0, fixed(kV_dc, 28));
    EXPECT_EQ(x.self.R, x.told.R_s);
}

TEST(Follow, TheLoadIsJudgedByTheLag)
{
    for (const double omega : {0.1, -0.1}) {
        for (const double lag : {10.0, 22.0, 25.0, 39.0, 42.0, 80.0}) {
            for (const double sign : {1.0, -1.0}) {
                Rig x;
                x.rest();
                EXPECT_EQ(follow_load(&x.self), 0);
                for (int ms = 0; ms < 300; ++ms) {
                    x.step(omega, sign * lag);
                }
                EXPECT_EQ(follow_load(&x.self), lag > 41 ? 1 : (lag < 23 ? -1 : 0)) << lag;
            }
        }
    }
    Rig x; // not of one that stands
    x.rest();
    x.stands(0.1);
    EXPECT_EQ(follow_load(&x.self), 0);
}

// One millisecond in which the EMF is there is no proof yet; a vector that slows down below where it shows begins again.
TEST(Follow, FollowsAfterItsTimeAndIsForgottenBelow)
{
    Rig x;
    x.rest();
    int ms = 0;
    for (; ms < 100 && x.self.follows_ms == 0U; ++ms) {
        x.step(0.1, 30);
        ASSERT_FALSE(x.self.follows);
    }
    for (int more = 1; more < FOLLOW_FOLLOWS_MS; ++more) {
        EXPECT_FALSE(x.self.follows) << more;
        EXPECT_EQ(x.self.follows_ms, more);
        x.step(0.1, 30);
    }
    EXPECT_TRUE(x.self.follows);
    x.step(0.5 * kSeen, 30);
    EXPECT_FALSE(x.self.follows);
    EXPECT_EQ(x.self.follows_ms, 0U);
}

} // namespace
