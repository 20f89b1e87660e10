// Where block commutation begins: the sector and the crossing before, from an angle or from rest.
#include "tests/unit/bldc/six_step_bench.h"

namespace
{

using namespace six_step_bench;

// The latter half of the sector told, the first of the next: the crossing before is that of the angle.
TEST(SixStepReset, ResetTakesTheLastCrossingFromTheAngle)
{
    const double T = 7 * kPeriod;
    for (const bool reverse : {false, true}) {
        for (uint32_t sector = 0; sector < SECTORS; ++sector) {
            for (const double ago : {0.001, 0.25, 0.5, 0.75, 0.999}) {
                SCOPED_TRACE(sector + ago);
                Bench b(T, configured(T), sector, reverse, 1000000);
                b.s.thresholds.u_V[0] = 77;
                b.s.thresholds.u_H[1] = 0;
                b.reset(ago);
                EXPECT_EQ(b.s.reverse, reverse);
                EXPECT_EQ(b.s.commutation.crossed, sector);
                EXPECT_EQ(b.s.commutation.sector, sector);
                EXPECT_NEAR(b.s.commutation.crossing, 1000000 - ago * T, kReset);
                EXPECT_NEAR(commutation_t_60(&b.s.commutation), T, kReset);
                EXPECT_NEAR(b.s.expected.t_60, T, kReset);
                EXPECT_NEAR(b.s.expected.at, 1000000 - ago * T + T, 2 * kReset);
                EXPECT_EQ(b.s.commutation.young, 0);
                EXPECT_EQ(b.s.thresholds.u_V[0], 77); // kept
                EXPECT_FALSE(b.s.lost);
                const sector_t legs = six_step_legs(&b.s);
                const Legs l = legs_of(sector, reverse);
                EXPECT_EQ(legs.high, l.high - 'A');
                EXPECT_EQ(legs.low, l.low - 'A');
            }
        }
    }
}

TEST(SixStepReset, AnAngleAtTheEndsOfATurnIsInASector)
{
    const double T = 7 * kPeriod;
    const six_step_config_t c = configured(T);
    // 60 degrees is the crossing in sector 0; a LSB ahead of it, that in sector 5 was a sector ago
    six_step_t s = {};
    six_step_reset(&s, &c, PM_TURN(1.0 / 6) - 1, fixed(kOmega, PM_Q_BITS), 0);
    EXPECT_EQ(s.commutation.crossed, 5);
    EXPECT_NEAR(static_cast<int32_t>(s.commutation.crossing), -T, kReset);
    six_step_reset(&s, &c, PM_TURN(1.0 / 6) + 2, fixed(kOmega, PM_Q_BITS), 0);
    EXPECT_EQ(s.commutation.crossed, 0);
    EXPECT_NEAR(static_cast<int32_t>(s.commutation.crossing), 0, kReset);
    six_step_reset(&s, &c, 0, fixed(kOmega, PM_Q_BITS), 0); // 0 degrees: that of sector 5
    EXPECT_EQ(s.commutation.crossed, 5);
    EXPECT_NEAR(static_cast<int32_t>(s.commutation.crossing), 0, kReset);
    six_step_reset(&s, &c, PM_TURN(0.25), -fixed(kOmega, PM_Q_BITS), 0); // of 270 degrees the other way
    EXPECT_EQ(s.commutation.crossed, 3);
    EXPECT_NEAR(static_cast<int32_t>(s.commutation.crossing), -T / 2, kReset);
    // no speed is the longest turn, forwards
    six_step_reset(&s, &c, PM_TURN(0.25), 0, 0);
    EXPECT_FALSE(s.reverse);
    EXPECT_GT(commutation_t_60(&s.commutation), 1000 * T);
}

TEST(SixStepReset, ARotorAtTheEndOfASectorStandsInOne)
{
    const six_step_config_t c = configured(7 * kPeriod);
    const struct {
        pm_angle_t theta;
        uint8_t sector;
    } cases[] = {{PM_TURN(1.0 / 12) - 1, 5}, {PM_TURN(1.0 / 12) + 1, 0}, {0, 5},
                 {PM_TURN(0.25) - 2, 0},     {PM_TURN(0.25) + 2, 1},     {PM_TURN(11.0 / 12) - 5, 4},
                 {PM_TURN(11.0 / 12) + 1, 5}};
    for (const auto &x : cases) {
        six_step_t s = {};
        six_step_begin(&s, &c, x.theta, false, 30000, 0);
        EXPECT_EQ(s.commutation.sector, x.sector) << x.theta;
    }
}

// Until there is a crossing none is counted, nor learnt from.
TEST(SixStepReset, ResetHasNothingToLearnFrom)
{
    const double T = 20 * kPeriod;
    for (const bool was : {true, false}) {
        Bench b(T, configured(T));
        b.s.learn = was;
        b.s.alike = 3;
        b.reset(0.05);
        b.run(8); // in the sector
        EXPECT_EQ(b.s.alike, 0U);
        EXPECT_EQ(b.s.commutation.whole, 0);
    }
}

TEST(SixStepReset, BeginTakesTheSectorThatTheRotorStandsInTheMiddleOf)
{
    constexpr uint32_t kT30 = 30000, kNow = 123456;
    const double T = 7 * kPeriod;
    for (const bool reverse : {false, true}) {
        for (uint32_t sector = 0; sector < SECTORS; ++sector) {
            for (const double off_deg : {-29.9, -10.0, 0.0, 29.9}) {
                SCOPED_TRACE(sector + off_deg / 1000);
                six_step_t s = {};
                const six_step_config_t c = configured(T);
                const double turn = crossing_turn(sector) + off_deg / 360;
                six_step_begin(&s, &c, turns(reverse ? -turn : turn), reverse, kT30, kNow);
                EXPECT_EQ(s.commutation.sector, sector);
                EXPECT_EQ(s.commutation.crossed, sector);
                EXPECT_EQ(s.reverse, reverse);
                EXPECT_EQ(s.commutation.young, START_CROSSINGS);
                EXPECT_EQ(START_CROSSINGS, 6);
                const double t_60 = 2 * (std::sqrt(2) - 1) * kT30; // commutation.h
                EXPECT_NEAR(s.expected.t_60, t_60, 2);
                EXPECT_NEAR(s.commutation.crossing, kNow + kT30 - t_60 / 2, 2);
                EXPECT_NEAR(s.expected.at, kNow + kT30 * std::sqrt(2), 4);
                EXPECT_NEAR(commutation_due(&s.commutation, &c.commutation), kNow + kT30, 4);
                EXPECT_FALSE(s.lost);
                // however often it is sampled, noise of a rotor at rest is no crossing
                EXPECT_NEAR(real(s.expected.seen), kSwing * T / t_60 / 8, kSwing * T / t_60 / 8 / 1000);
            }
        }
    }
}

// Of one that was used, in the other direction, with a crossing half seen and commutations asked for.
TEST(SixStepReset, ResetLeavesNothingOfTheRunBefore)
{
    const double T = 5.2 * kPeriod;
    for (int before = 20; before < 32; ++before) {
        Bench used(T, configured(T), 4, true);
        used.reset();
        used.run(before);
        Bench again(T, configured(T), 2, false, used.now + 17), fresh = again;
        again.s = used.s;
        again.stale = 2; // samples of the run before
        again.reset();
        fresh.reset();
        for (int n = 0; n < 40; ++n) {
            again.period();
            fresh.period();
            ASSERT_EQ(again.out.commutate_at, fresh.out.commutate_at) << n;
            ASSERT_EQ(again.out.sample_at, fresh.out.sample_at) << n;
            ASSERT_EQ(again.out.legs, fresh.out.legs) << n;
            ASSERT_EQ(again.out.then, fresh.out.then) << n;
            ASSERT_EQ(again.s.crossing.open_since, fresh.s.crossing.open_since) << n;
            ASSERT_EQ(again.s.commutation.crossing, fresh.s.commutation.crossing) << n;
            ASSERT_EQ(again.s.commutation.strikes, 0) << n;
        }
        again.expect_opened();
    }
}

} // namespace
