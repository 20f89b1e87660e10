#include "bldc/commutation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/bldc/rig.h"

namespace
{

using bldc_rig::fixed;

constexpr uint32_t kT60 = 60000;
constexpr double kRounding = 3; // counts

commutation_config_t make(double advance = 0, uint32_t delay = 0)
{
    return {fixed((0.5 - advance) / 6, 32), delay, 6 * kT60, 4};
}

commutation_t locked(uint32_t at = 0)
{
    commutation_t c;
    commutation_reset(&c, 0, at, kT60);
    return c;
}

TEST(Commutation, IsDueThirtyDegreesBehindTheCrossing)
{
    commutation_t c = locked();
    const commutation_config_t config = make();
    EXPECT_NEAR(commutation_due(&c, &config), 0.5 * kT60, kRounding);
    c.sector = 1; // commanded: that out of the next sector follows from the same crossing
    EXPECT_NEAR(commutation_due(&c, &config), 1.5 * kT60, kRounding);
    commutation_crossed(&c, kT60 + 600);
    EXPECT_NEAR(commutation_due(&c, &config), 1.5 * kT60 + 600 + 50,
                kRounding); // 600 / 6 of the mean, half of it
    EXPECT_EQ(c.crossed, 1);
}

// Constant torque from rest: 30 degrees in t_30, the crossings at t_30 root(2 n).
TEST(Commutation, ARotorFromRestIsFollowedByItsCrossings)
{
    const double t_30 = 100000;
    for (const double slower : {0.75, 1.0, 1.25}) { // than expected: 9/16 to 25/16 of the inertia
        commutation_t c;
        const commutation_config_t config = make();
        commutation_start(&c, 5, 1000, static_cast<uint32_t>(t_30), 6);
        EXPECT_NEAR(commutation_due(&c, &config), 1000 + t_30, kRounding);
        for (int n = 1; n <= 6; ++n) {
            ASSERT_EQ(c.young, 7 - n);
            const double at = 1000 + slower * t_30 * std::sqrt(2.0 * n);
            commutation_ahead(&c, static_cast<uint32_t>(at) - 500);
            c.sector = static_cast<uint8_t>(n - 1);
            EXPECT_GT(commutation_due(&c, &config), at) << slower << n; // it is waited for
            commutation_crossed(&c, static_cast<uint32_t>(at));
            const double turned = std::pow((commutation_due(&c, &config) - 1000) / slower / t_30, 2) * 30;
            EXPECT_NEAR(turned, 60 * n + 30, 20) << slower << n; // where the legs change
        }
        EXPECT_EQ(c.young, 0);
        EXPECT_EQ(commutation_state(&c, &config), COMMUTATION_LOCKED);
    }
}

TEST(Commutation, AStartWithoutCrossingsIsLost)
{
    commutation_t c;
    const commutation_config_t config = make();
    commutation_start(&c, 0, 0, 100000, 6);
    for (int n = 0; n < 4; ++n) {
        EXPECT_EQ(commutation_state(&c, &config), COMMUTATION_LOCKED);
        commutation_missed(&c);
    }
    EXPECT_EQ(commutation_state(&c, &config), COMMUTATION_LOST);
    EXPECT_EQ(c.young, 6);
}

TEST(Commutation, AdvanceAndDelayAreTakenOff)
{
    const commutation_t c = locked();
    const commutation_config_t config = make(7.5 / 60, 170);
    EXPECT_NEAR(commutation_due(&c, &config), kT60 * 22.5 / 60 - 170, kRounding);
}

TEST(Commutation, WaitsWhileTheTerminalIsAheadOfItsCrossing)
{
    commutation_t c = locked();
    const commutation_config_t config = make();
    c.sector = 1;
    commutation_ahead(&c, kT60 - 1000);
    EXPECT_NEAR(commutation_due(&c, &config), 1.5 * kT60, kRounding);
    commutation_ahead(&c, kT60 + 20000);
    EXPECT_NEAR(commutation_due(&c, &config), 1.5 * kT60 + 20000, kRounding);
    commutation_ahead(&c, 3 * kT60); // no longer than another sector
    EXPECT_NEAR(commutation_due(&c, &config), 2.5 * kT60, kRounding);
}

// The mean of six: intervals that are unlike within a turn do not move the commutation of the next sector.
TEST(Commutation, UnlikeIntervalsOfATurnLeaveTheMeanAlone)
{
    commutation_t c = locked();
    const commutation_config_t config = make();
    const int unlike[SECTORS] = {3000, -5000, 2000, 4000, -6000, 2000};
    uint32_t at = 0;
    for (uint32_t n = 0; n < 30; ++n) {
        at += kT60 + static_cast<uint32_t>(unlike[n % SECTORS]);
        c.sector = static_cast<uint8_t>(sector_next(c.sector));
        commutation_crossed(&c, at);
        if (n >= SECTORS) {
            EXPECT_NEAR(commutation_t_60(&c), kT60, 1);
            EXPECT_NEAR(commutation_due(&c, &config) - at, 0.5 * kT60, kRounding);
        }
    }
    EXPECT_EQ(c.whole, SECTORS);
}

TEST(Commutation, AFalseCrossingMovesByHalfASectorAtMostAndCounts)
{
    commutation_t c = locked();
    const commutation_config_t config = make();
    commutation_crossed(&c, 100);
    EXPECT_NEAR(c.crossing, 0.5 * kT60, kRounding);
    EXPECT_EQ(c.strikes, 1);
    EXPECT_EQ(c.whole, 0);
    const uint32_t was = c.crossing, t_60 = commutation_t_60(&c);
    commutation_crossed(&c, was + t_60);
    EXPECT_EQ(c.strikes, 0);
    commutation_crossed(&c, c.crossing + 5 * kT60);
    EXPECT_EQ(c.strikes, 1);
    EXPECT_EQ(commutation_state(&c, &config), COMMUTATION_LOCKED);
}

TEST(Commutation, GoesOnWithoutCrossingsForAWhileThenIsLost)
{
    commutation_t c = locked();
    const commutation_config_t config = make();
    for (uint32_t n = 1; n <= 4; ++n) {
        EXPECT_EQ(commutation_state(&c, &config), COMMUTATION_LOCKED);
        c.sector = static_cast<uint8_t>(sector_next(c.sector));
        commutation_missed(&c);
        EXPECT_NEAR(commutation_due(&c, &config), (n + 0.5) * kT60, n * kRounding);
    }
    EXPECT_EQ(commutation_state(&c, &config), COMMUTATION_LOST);
    for (int n = 0; n < 300; ++n) {
        commutation_missed(&c);
    }
    EXPECT_EQ(commutation_state(&c, &config), COMMUTATION_LOST); // does not begin anew at 256
}

// Row 151. Mean over a turn at steady speed; twin: of one interval the asymmetry is all seen.
TEST(Commutation, SpeedOfATurnHasNoRippleFromAsymmetry)
{
    commutation_t c = locked();
    const commutation_config_t config = make();
    const int unlike[SECTORS] = {3000, -5000, 2000, 4000, -6000, 2000};
    uint32_t at = 0;
    double one_most = 0, six_most = 0;
    for (uint32_t n = 0; n < 60; ++n) {
        at += kT60 + static_cast<uint32_t>(unlike[n % SECTORS]);
        commutation_crossed(&c, at);
        if (n >= SECTORS) {
            six_most = std::max(six_most, std::abs(bldc_rig::real(commutation_speed(&c, &config)) - 1));
            one_most = std::max(one_most, std::abs(kT60 / static_cast<double>(c.interval[c.crossed]) - 1));
        }
    }
    EXPECT_LE(six_most, 5e-4); // METHODS.md B (c): mean 0.05 %, and ripple 0.1 %
    EXPECT_GE(one_most, 0.08);
}

// Under a ramp of one base speed a second the mean of six is that of three intervals ago.
TEST(Commutation, SpeedLagsHalfATurn)
{
    const double count_s = 1 / 170e6, base = 2 * bldc_rig::kPi / (6 * kT60 * count_s);
    commutation_t c = locked();
    const commutation_config_t config = make();
    double t_s = 0, omega = base, last_s = 0;
    for (uint32_t n = 1; n < 600; ++n) {
        last_s = t_s;
        // base t + base t^2 / 2 = n pi/3
        t_s = std::sqrt(1 + 2 * n * bldc_rig::kPi / 3 / base) - 1;
        omega = base * (1 + t_s);
        commutation_crossed(&c, static_cast<uint32_t>(std::lround(t_s / count_s)));
    }
    const double lag_s = (omega / base - bldc_rig::real(commutation_speed(&c, &config)));
    EXPECT_NEAR(lag_s, 3 * (t_s - last_s), 0.05 * 3 * (t_s - last_s));
}

TEST(Commutation, InstantsWrap)
{
    commutation_t c = locked(UINT32_MAX - 1000U);
    const commutation_config_t config = make();
    EXPECT_NEAR(static_cast<int32_t>(commutation_due(&c, &config)), 0.5 * kT60 - 1001, kRounding);
    commutation_crossed(&c, kT60 - 1001U);
    EXPECT_EQ(c.strikes, 0);
}

// Until the start has seen its crossings t_60 is the last interval alone, from then on the mean of six.
TEST(Commutation, AStartForgetsAllButTheLastInterval)
{
    commutation_t c;
    commutation_start(&c, 2, 0, 100000, 3);
    uint32_t at = c.crossing;
    for (const uint32_t interval : {80000U, 70000U, 66000U}) {
        EXPECT_GT(c.young, 0);
        at += interval;
        commutation_crossed(&c, at);
        EXPECT_NEAR(commutation_t_60(&c), interval, 1);
    }
    EXPECT_EQ(c.young, 0);
    double sum = 6 * 66000;
    for (const uint32_t interval : {60000U, 63000U, 62000U, 61000U, 64000U, 60000U}) {
        at += interval;
        commutation_crossed(&c, at);
        sum += interval - 66000.0; // one of those of 66000 goes
        EXPECT_NEAR(commutation_t_60(&c), sum / 6, 1);
    }
}

// Four sectors instead of one, and the half to the commutation.
TEST(Commutation, ASlowStartIsWaitedForForUpToFourSectors)
{
    commutation_t c;
    const commutation_config_t config = make();
    commutation_start(&c, 0, 0, 100000, 6);
    const double t_60 = 2 * (std::sqrt(2) - 1) * 100000;
    const double crossing = 100000 * std::sqrt(2);
    c.sector = 1;
    for (const double ahead : {0.5, 3.9}) {
        commutation_ahead(&c, static_cast<uint32_t>(crossing + ahead * t_60));
        EXPECT_NEAR(commutation_due(&c, &config), crossing + (ahead + 0.5) * t_60, 3 * kRounding) << ahead;
    }
    for (const double ahead : {4.1, 4.9, 9.0}) {
        commutation_ahead(&c, static_cast<uint32_t>(crossing + ahead * t_60));
        EXPECT_NEAR(commutation_due(&c, &config), crossing + 4.5 * t_60, 3 * kRounding) << ahead;
    }
}

TEST(Commutation, CrossingsThatAreTakenAsTheyWereAreCountedUpToATurn)
{
    commutation_t c = locked();
    for (uint32_t n = 1; n <= 9; ++n) {
        commutation_crossed(&c, n * kT60);
        EXPECT_EQ(c.whole, n < SECTORS ? n : SECTORS);
    }
    commutation_crossed(&c, 9 * kT60 + 100); // far too early
    EXPECT_EQ(c.whole, 0);
    commutation_crossed(&c, c.crossing + commutation_t_60(&c));
    EXPECT_EQ(c.whole, 1);
    commutation_missed(&c);
    EXPECT_EQ(c.whole, 0);
}

TEST(Commutation, AllStrikesThatCanBeAskedForAreCounted)
{
    commutation_t c = locked();
    commutation_config_t config = make();
    config.strikes = 255;
    for (int n = 1; n < 255; ++n) {
        commutation_missed(&c);
        ASSERT_EQ(commutation_state(&c, &config), COMMUTATION_LOCKED) << n;
    }
    for (int n = 255; n < 600; ++n) {
        commutation_missed(&c);
        ASSERT_EQ(commutation_state(&c, &config), COMMUTATION_LOST) << n;
    }
}

} // namespace
