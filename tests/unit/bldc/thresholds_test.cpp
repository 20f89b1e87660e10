#include "bldc/thresholds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "tests/unit/bldc/rig.h"

namespace
{

using bldc_rig::fixed;
using bldc_rig::kPi;
using bldc_rig::real;

constexpr double kT60 = 100000;
constexpr double kSlope = 0.2; // per rad, so that
constexpr double kSwing = kSlope * kPi / 3;
constexpr double kLeft = 1e-4; // of the threshold; 0.03 degrees

// A machine whose terminals are off by v and h, in legs of the machine; crossings move by what the thresholds do not take off.
struct Bench {
    double v[3], h[3];
    bool reverse = false;
    thresholds_config_t config = {fixed(1.5 * 0.05, 32), fixed(0.05, 32), fixed(0.1, 28)};
    thresholds_t self = {};

    // In sector s, relative to where it belongs, in counts. 10.4: h is what the star point does, to up and down alike.
    double late(uint32_t s) const
    {
        const uint8_t leg = sector_legs(s, reverse).open;
        const double way = reverse ? -1 : 1;
        const double y =
            (sector_rising(s) ? v[leg] : -v[leg]) - way * h[leg]; // of the difference at the crossing
        return (real(thresholds_at(&self, s, reverse)) - y) / kSlope / (kPi / 3) * kT60;
    }
    void turn()
    {
        uint32_t interval[SECTORS];
        uint32_t sum = 0;
        for (uint32_t s = 0; s < SECTORS; ++s) {
            const double before = late(s == 0 ? 5 : s - 1);
            interval[s] = static_cast<uint32_t>(std::lround(kT60 + late(s) - before));
            sum += interval[s];
        }
        for (uint32_t s = 0; s < SECTORS; ++s) {
            thresholds_learn(&self, &config, s, reverse, interval, sum, fixed(kSwing, 28));
        }
    }
    double most_late() const
    {
        double most = 0;
        for (uint32_t s = 0; s < SECTORS; ++s) {
            most = std::max(most, std::abs(late(s)));
        }
        return most * 60 / kT60; // degrees
    }
};

TEST(Thresholds, LearnBothDeviationsInBothDirections)
{
    for (const bool reverse : {false, true}) {
        Bench b{{0.005, -0.004, 0.002}, {0.012, -0.02, 0.008}};
        b.reverse = reverse;
        EXPECT_GT(b.most_late(), 5);
        for (int n = 0; n < 200; ++n) {
            b.turn();
        }
        EXPECT_LT(b.most_late(), 0.05);
        for (int leg = 0; leg < 3; ++leg) {
            EXPECT_NEAR(real(b.self.u_V[leg]), b.v[leg], kLeft);
            EXPECT_NEAR(real(b.self.u_H[leg]), b.h[leg], kLeft);
        }
        // of the machine, not of the direction
        b.reverse = !reverse;
        EXPECT_LT(b.most_late(), 0.05);
    }
}

TEST(Thresholds, TakeTheirShareOfADeviationInATurn)
{
    Bench b{{0.01, 0, 0}, {0, 0, 0}};
    b.turn();
    EXPECT_NEAR(real(b.self.u_V[0]), 0.05 * 0.01, 0.01 * 0.01);
    Bench c{{0, 0, 0}, {0.01, -0.01, 0}};
    c.turn();
    EXPECT_NEAR(real(c.self.u_H[0]), 0.05 * 0.01, 0.01 * 0.01);
    EXPECT_NEAR(real(c.self.u_H[1]), -0.05 * 0.01, 0.01 * 0.01);
}

// Twins of METHODS.md B (c), rows 114 and 115: each alone leaves the other deviation.
TEST(Thresholds, TwinEitherAloneLeavesTheOther)
{
    for (const bool vertical : {false, true}) {
        Bench b{{0.005, -0.005, 0}, {0.012, -0.02, 0.008}};
        (vertical ? b.config.k_H : b.config.k_V) = 0;
        for (int n = 0; n < 200; ++n) {
            b.turn();
        }
        EXPECT_GT(b.most_late(), vertical ? 4 : 1);
    }
}

// A mean of the horizontal ones cannot be told from a slower or faster rotor: it is not learnt.
TEST(Thresholds, HorizontalOnesHaveNoMean)
{
    Bench b{{0, 0, 0}, {0.01, 0.01, 0.01}};
    for (int n = 0; n < 100; ++n) {
        b.turn();
    }
    for (const pm_q_t u : b.self.u_H) {
        EXPECT_NEAR(real(u), 0, kLeft);
    }
}

// Intervals of a rotor that speeds up: each shorter by 1 % than the one before.
TEST(Thresholds, SpeedingUpLeavesNoMean)
{
    thresholds_t with = {}, twin = {};
    const Bench b{{0, 0, 0}, {0, 0, 0}};
    for (uint32_t n = 0; n < 30; ++n) {
        uint32_t interval[SECTORS] = {}, turn = 0;
        for (uint32_t k = 0; k < SECTORS; ++k) {
            interval[(n + k + 1) % SECTORS] = 10000 - 100 * (n + k);
            turn += 10000 - 100 * (n + k);
        }
        for (thresholds_t *self : {&with, &twin}) {
            thresholds_learn(self, &b.config, n % SECTORS, false, interval, turn, PM_ONE / 4);
        }
        thresholds_slow(&with);
    }
    for (int leg = 0; leg < 3; ++leg) {
        EXPECT_NEAR(real(with.u_H[leg]), 0, 5e-5) << leg;
        EXPECT_GT(std::abs(real(twin.u_H[leg])), 4e-4) << leg;
    }
    thresholds_t some = {{1, 2, 3}, {100, 400, -200}};
    thresholds_slow(&some);
    EXPECT_EQ(some.u_V[2], 3);
    EXPECT_EQ(some.u_H[0], 0);
    EXPECT_EQ(some.u_H[1], 300);
    EXPECT_EQ(some.u_H[2], -300);
}

TEST(Thresholds, StayWithinTheirLimit)
{
    Bench b{{0.5, 0, 0}, {0, 0, 0}};
    for (int n = 0; n < 400; ++n) {
        b.turn();
    }
    EXPECT_EQ(b.self.u_V[0], b.config.most);
}

// Of three terminals: what stands behind them is left alone.
TEST(Thresholds, SlowWritesTheThreeTerminals)
{
    struct {
        thresholds_t self;
        pm_q_t behind[2];
    } x = {{{1, 2, 3}, {300, 600, 900}}, {77, 78}};
    thresholds_slow(&x.self);
    EXPECT_EQ(x.behind[0], 77);
    EXPECT_EQ(x.behind[1], 78);
    EXPECT_EQ(x.self.u_H[2], 300);
}

} // namespace
