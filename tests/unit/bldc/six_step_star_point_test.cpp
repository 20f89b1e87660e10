// Block commutation by the third harmonic at the star point, call by call.
#include "tests/unit/bldc/six_step_bench.h"

namespace
{

using namespace six_step_bench;

// The star point of a sine behind a low-pass whose lag is a quarter of a sector: (2 / pi) atan(1) / 2.
Bench star_point(double T, uint32_t sector, bool reverse, double advance = 0)
{
    Bench b(T, configured(T, advance), sector, reverse, 0x100000000LL - std::llround(5 * T));
    b.third = true;
    b.config.crossings = CROSSINGS_third_harmonic;
    b.config.compared = 0;
    b.config.third.pi_rc = static_cast<int32_t>(std::lround(T));
    b.lag = 0.25 * T;
    return b;
}

TEST(SixStepStarPoint, ThirdHarmonicIsFollowedBehindItsLag)
{
    for (const bool reverse : {false, true}) {
        for (const uint32_t sector : {0U, 5U}) {
            for (const double advance : {0.0, 0.2}) {
                const double T = 7.3 * kPeriod;
                Bench b = star_point(T, sector, reverse, advance);
                b.reset(0.3);
                for (int n = 0; n < 120; ++n) {
                    b.period();
                    b.expect_legs();
                }
                EXPECT_NEAR(b.sectors(), 120 / 7.3, 1.5);
                expect_on_time(b, sector, T, advance);
                EXPECT_EQ(b.s.commutation.strikes, 0);
                EXPECT_EQ(b.s.commutation.whole, SECTORS);
            }
        }
    }
}

// Uneven crossings: all six of a turn are told apart, whatever the drive commands by then.
TEST(SixStepStarPoint, ThirdHarmonicMovesInstantsByWhatWasLearnt)
{
    const double T = 11.3 * kPeriod;
    Bench b = star_point(T, 0, false);
    b.s.thresholds.u_V[2] = fixed(kDivider, PM_Q_BITS);
    b.reset(0.3);
    b.seen = divider_of_C;
    b.run(220);
    expect_on_time(b, 0, T, 0, 1);
    Bench twin = star_point(T, 0, false);
    twin.reset(0.3);
    twin.seen = divider_of_C;
    twin.run(220);
    ASSERT_GT(twin.commutations.size(), 15U);
    EXPECT_NEAR(static_cast<double>(twin.commutations[12]), twin.z(12) + (0.5 - kDivider / kSwing) * T,
                kRounding);
}

TEST(SixStepStarPoint, ThirdHarmonicLearnsFromAWholeTurn)
{
    const double T = 11.3 * kPeriod;
    Bench b = star_point(T, 0, false);
    b.config.thresholds.k_V = fixed(1.5 * 0.05, 32);
    b.reset(0.3);
    b.seen = divider_of_C;
    int64_t k = 0;
    uint8_t crossed = 0;
    while (b.s.thresholds.u_V[2] == 0 && b.within(40)) {
        b.period();
        if (b.s.commutation.crossed != crossed) {
            crossed = b.s.commutation.crossed;
            ++k;
        }
    }
    EXPECT_EQ(crossed, 0);
    EXPECT_GE(k, 7);
    EXPECT_LE(k, 18);
    const double step = 0.05 * 1.5 * kSwing * 4 * kDivider / kSwing / 6;
    EXPECT_NEAR(real(b.s.thresholds.u_V[2]), step, step / 50);
    const pm_q_t once = b.s.thresholds.u_V[2];
    b.run(5); // of the eleven in a sector
    EXPECT_EQ(b.s.thresholds.u_V[2], once);
}

// Nothing to be seen from crossing 3 on: given up half a sector behind where it was due, one after the other.
TEST(SixStepStarPoint, ThirdHarmonicThatIsNotThereIsMissedAndLost)
{
    const double T = 11.3 * kPeriod;
    for (const double advance : {-0.3, 0.0, 0.3}) {
        Bench b = star_point(T, 0, false, advance);
        b.reset(0.3);
        b.held = 3;
        for (uint8_t n = 0; n < 4; ++n) {
            while (b.s.commutation.strikes == n && b.within(20)) {
                b.period();
            }
            // The first call whose sample, a lag ago, is that far behind, and not ahead of the end of the sector.
            const double last = static_cast<double>(b.now) - kPeriod - b.lag;
            const double gone = static_cast<double>(b.commutations[3 + n]); // out of its sector
            const double due = std::max(b.z(3 + n) + 0.5 * T, gone - b.lag);
            EXPECT_GT(last, due - kRounding) << advance << int(n);
            EXPECT_LE(last, due + kPeriod + kRounding) << advance << int(n);
            EXPECT_NEAR(static_cast<int32_t>(b.s.commutation.crossing -
                                             static_cast<uint32_t>(std::llround(b.z(3 + n)))),
                        0, (n + 1) * kRounding);
            EXPECT_EQ(b.s.commutation.crossed, (3 + n) % 6);
        }
        EXPECT_TRUE(b.s.lost);
        b.period();
        EXPECT_EQ(b.out.legs, PM_LEGS_OFF);
        expect_on_time(b, 0, T, advance, 0, 5 * kRounding);
    }
}

TEST(SixStepStarPoint, ThirdHarmonicThatStaysAheadIsWaitedFor)
{
    const double T = 11.3 * kPeriod;
    Bench b = star_point(T, 0, false);
    b.config.commutation.strikes = 10;
    b.reset(0.3);
    b.late = [](int64_t k) { return k >= 3 ? 0.3 * 11.3 * kPeriod : 0; };
    b.run(70);
    ASSERT_GT(b.commutations.size(), 4U);
    EXPECT_EQ(b.s.commutation.strikes, 0);
    const double half = 0.5 * (b.z(3) - b.z(-3)) / 6;
    EXPECT_NEAR(static_cast<double>(b.commutations[3]), b.z(3) + half, kRounding);
}

// A sample ahead of the crossing was taken a lag ago, and its crossing is behind that of the signal by what was learnt.
TEST(SixStepStarPoint, ThirdHarmonicIsAheadAsOfItsOwnInstant)
{
    const double T = 11.3 * kPeriod;
    for (const double deviation : {kDivider, -kDivider}) {
        Bench b = star_point(T, 4, false);
        b.s.thresholds.u_V[2] = fixed(deviation, PM_Q_BITS);
        b.reset(0.3);
        while (b.s.commutation.crossed != 5 && b.within(5)) {
            b.period();
        }
        ASSERT_EQ(b.s.commutation.crossed, 5); // C rises next
        b.run(6);
        ASSERT_EQ(b.s.commutation.crossed, 5);
        const double at = static_cast<double>(b.now - kPeriod) - b.lag + deviation / kSwing * T;
        EXPECT_NEAR(static_cast<int32_t>(b.s.commutation.ahead - static_cast<uint32_t>(std::llround(at))), 0,
                    kRounding);
    }
}

// Learnt apart, two crossings may change places with the samples between them: none is ahead of one that was found behind it.
TEST(SixStepStarPoint, ThirdHarmonicIsNotAheadOfWhatWasFound)
{
    const double T = 11.3 * kPeriod;
    Bench b = star_point(T, 4, false);
    b.s.thresholds.u_V[2] = fixed(-2 * kDivider, PM_Q_BITS);
    b.s.thresholds.u_V[0] = fixed(2 * kDivider, PM_Q_BITS);
    b.reset(0.3);
    for (int n = 0; n < 120; ++n) {
        b.period();
        const commutation_t &c = b.s.commutation;
        ASSERT_GE(static_cast<int32_t>(c.ahead - c.crossing), 0) << n;
    }
    EXPECT_FALSE(b.s.lost);
}

// Given up, it is no sample ahead of the one behind it, which has the other sign.
TEST(SixStepStarPoint, ThirdHarmonicThatIsGivenUpIsNotFoundLater)
{
    const double T = 11.3 * kPeriod;
    Bench b = star_point(T, 0, false);
    b.reset(0.3);
    b.frozen = kSwing / 3; // ahead of crossing 3, downwards
    while (b.s.commutation.strikes == 0 && b.within(20)) {
        b.period();
    }
    ASSERT_EQ(b.s.commutation.strikes, 1);
    ASSERT_EQ(b.s.commutation.crossed, 3);
    b.run(6); // another sector takes longer
    EXPECT_EQ(b.s.commutation.crossed, 3);
    EXPECT_EQ(b.s.commutation.strikes, 1);
}

// One sample of the run before is no sample ahead of a crossing.
TEST(SixStepStarPoint, ThirdHarmonicOfTheRunBeforeIsForgotten)
{
    const double T = 11.3 * kPeriod;
    for (int before = 30; before < 42; ++before) {
        Bench used = star_point(T, 1, true);
        used.reset(0.3);
        used.run(before);
        Bench b = star_point(T, 0, false);
        b.s = used.s;
        b.reset(0.1); // the signal is not yet past the crossing before: no crossing of the next one
        b.period();
        EXPECT_EQ(b.s.commutation.crossed, 0);
        b.run(60);
        EXPECT_NEAR(b.sectors(), 60 / 11.3, 1);
        EXPECT_EQ(b.s.commutation.strikes, 0);
        expect_on_time(b, 0, T);
    }
}

} // namespace
