// Instants of crossings against the EMF they come from, without a plant.
#include "bldc/zero_crossing.h"

#include <gtest/gtest.h>

#include "tests/unit/bldc/rig.h"

namespace
{

using bldc_rig::fixed;
using bldc_rig::kDegree;
using bldc_rig::kPi;

constexpr double kV_dc = 24, kBase_V = 40;
constexpr uint32_t kT60 = 100000;   // counts
constexpr double kSpacing = 4000;   // counts
constexpr double kAmplitude = 6;    // of the terminal's swing about its reference, a sine
constexpr double kError_counts = 4; // rounding of the ratio and of the product, of 4000 counts
constexpr double kShape_counts = 8; // chord of the sine between two samples 2.4 degrees apart

double degrees(double counts)
{
    return 60.0 * counts / kT60;
}

constexpr zero_expected_t kExpected = {0, 0, kT60, 0, 0};

struct Sample {
    zero_sample_t measured;
    zero_instant_t when;
};

pm_q_t swing(double factor)
{
    return fixed(factor * kAmplitude * kPi / 3 / kBase_V, 28);
}

// Sector in which the crossing is at count 0; a sample of the ideal terminal at another.
struct Bench {
    zero_crossing_config_t config = {ZERO_LINK, fixed(0.35 / kBase_V, 28), 1000, swing(1), kT60, 0};
    uint32_t sector = 0;
    bool reverse = false;
    zero_legs_t legs = ZERO_LEGS_APART;
    zero_crossing_t self = {};

    void open()
    {
        zero_crossing_open(&self, sector, reverse, static_cast<uint32_t>(-static_cast<int>(kT60 / 2)));
    }
    Sample sample(double at) const
    {
        const double towards = sector % 2 == 0 ? 1 : -1;
        const double rails_V = kV_dc / 2 * static_cast<double>(legs);
        const double v = rails_V + towards * kAmplitude * std::sin(degrees(at) * kDegree);
        return terminal(at, v);
    }
    Sample terminal(double at, double v) const
    {
        const sector_t of = sector_legs(sector, reverse);
        Sample s = {};
        s.when.at = static_cast<uint32_t>(static_cast<int64_t>(at));
        s.when.legs = legs;
        s.measured.v_dc = fixed(kV_dc / kBase_V, 28);
        s.measured.v[of.open] = fixed(std::min(std::max(v, 0.0), kV_dc + 0.8) / kBase_V, 28);
        s.measured.v[of.high] = legs == ZERO_LEGS_LOW ? 0 : s.measured.v_dc;
        s.measured.v[of.low] = legs == ZERO_LEGS_HIGH ? s.measured.v_dc : 0;
        return s;
    }
    bool step(const Sample &s, const zero_expected_t &e = kExpected)
    {
        return zero_crossing_step(&self, &config, &s.measured, s.when, &e);
    }
    // First sample at `first`, then every kSpacing; the instant that it finds.
    int32_t find(double first, const zero_expected_t &e = kExpected)
    {
        open();
        for (double at = first; at < kT60 / 2.0; at += kSpacing) {
            if (step(sample(at), e)) {
                return static_cast<int32_t>(self.at);
            }
        }
        ADD_FAILURE() << "no crossing";
        return INT32_MAX;
    }
};

TEST(ZeroCrossing, InterpolatesInBothDirectionsAndAllSectors)
{
    for (const bool reverse : {false, true}) {
        for (uint32_t sector = 0; sector < SECTORS; ++sector) {
            Bench b;
            b.sector = sector;
            b.reverse = reverse;
            for (double first = -30000; first < -30000 + kSpacing; first += 333) {
                EXPECT_NEAR(b.find(first), 0, kShape_counts) << sector << first;
            }
        }
    }
}

// Twin: without interpolation the crossing is up to the distance of two samples late.
TEST(ZeroCrossing, TwinFirstSamplePastIsLateByUpToASample)
{
    double most = 0;
    for (double first = -30000; first < -30000 + kSpacing; first += 333) {
        most = std::max(most, std::fmod(first + 100 * kSpacing, kSpacing));
    }
    EXPECT_GT(most, 100 * kShape_counts);
}

// The star point of a sine is at the mean of the terminals; here it is 0.3 V above, as with another EMF.
TEST(ZeroCrossing, EveryReferenceHasItsCrossing)
{
    for (const zero_reference_t reference : {ZERO_LINK, ZERO_TERMINALS, ZERO_NEUTRAL}) {
        Bench b;
        b.config.reference = reference;
        b.open();
        bool found = false;
        for (double at = -29000; at < 30000 && !found; at += kSpacing) {
            Sample s = b.sample(at);
            s.measured.v_neutral = fixed(0.3 / kBase_V, 28);
            found = b.step(s);
        }
        ASSERT_TRUE(found) << reference;
        const double at_V =
            reference == ZERO_NEUTRAL ? 1.5 * 0.3 : 0; // two thirds of the terminal's is its phase's
        const double crossing = std::asin(at_V / kAmplitude) / kDegree / 60 * kT60;
        EXPECT_NEAR(static_cast<int32_t>(b.self.at), crossing, kShape_counts) << reference;
    }
}

// METHODS.md 10.2.3, late rule: from one sample and the slope of the EMF.
TEST(ZeroCrossing, FindsALateCrossingFromItsDistance)
{
    Bench b;
    for (const double first : {1000.0, 4000.0, 9000.0}) {
        // a sine instead of the line that the slope stands for
        const double line = std::sin(degrees(first) * kDegree) / kDegree / 60 * kT60;
        EXPECT_NEAR(b.find(first), first - line, kError_counts) << first;
    }
}

// A channel with an offset rests above the rail for good behind a downward crossing with both legs low.
TEST(ZeroCrossing, ACrossingIntoTheRailIsFoundWithAnOffset)
{
    for (const double offset_V : {0.0, 0.02, 0.05}) {
        Bench b;
        b.sector = 1;
        b.legs = ZERO_LEGS_LOW;
        b.open();
        bool found = false;
        for (double at = -30000; at < 20000 && !found; at += kSpacing) {
            Sample s = b.sample(at);
            for (pm_q_t &v : s.measured.v) {
                v += fixed(offset_V / kBase_V, 28);
            }
            found = b.step(s);
        }
        ASSERT_TRUE(found) << offset_V;
        // by the slope of the last sample, up to kSpacing ahead; the offset is 0.5 degrees of 6 V
        EXPECT_NEAR(static_cast<int32_t>(b.self.at), 0,
                    kShape_counts + 1.1 * offset_V / kAmplitude / kDegree / 60 * kT60)
            << offset_V;
    }
}

// The arc of a sine instead of the line, up to 30 degrees: the fifth order is left, 3/40 x^5.
TEST(ZeroCrossing, FindsALateCrossingOfASineByItsArc)
{
    Bench b;
    b.config.curve = ZERO_CURVE_SINE;
    for (const double first : {4000.0, 25000.0, 45000.0}) {
        const double x = std::sin(degrees(first) * kDegree);
        const double left = (std::asin(x) - x - x * x * x / 6) / kDegree / 60 * kT60;
        const zero_expected_t due = {0, 0, kT60, static_cast<uint32_t>(-1), 0};
        EXPECT_NEAR(b.find(first, due), left, kError_counts) << first;
        EXPECT_LT(left, 0.3 / 60 * kT60); // degrees
    }
}

// METHODS.md B (c), row 111.
TEST(ZeroCrossing, TwinFactorOfASineForATrapezoidIsAThirdOff)
{
    Bench b;
    b.config.swing = swing(1.5);
    const double first = 6000;
    EXPECT_NEAR(b.find(first), first / 3, 0.02 * first);
}

TEST(ZeroCrossing, BeforeItIsDueALateCrossingNeedsASecondSample)
{
    Bench b;
    zero_expected_t e = kExpected;
    e.at = 20000;
    EXPECT_NEAR(b.find(2000, e), 0, 10);
    b.open();
    EXPECT_FALSE(b.step(b.sample(2000), e));
    EXPECT_TRUE(b.step(b.sample(2000 + kSpacing), e));
}

// A terminal on its way from the rail to the EMF: past at first, then ahead of the crossing.
TEST(ZeroCrossing, IgnoresTheSwingAfterFreewheeling)
{
    Bench b;
    b.open();
    EXPECT_FALSE(b.step(b.terminal(-28000, kV_dc + 0.8)));
    EXPECT_FALSE(b.step(b.terminal(-24000, kV_dc / 2 + 1.5)));
    for (double at = -20000; at < 0; at += kSpacing) {
        EXPECT_FALSE(b.step(b.sample(at)));
    }
    EXPECT_TRUE(b.step(b.sample(1000)));
    EXPECT_NEAR(static_cast<int32_t>(b.self.at), 0, kShape_counts);
    // Twin: taken at once it is wrong by most of the sector.
    b.open();
    zero_expected_t e = kExpected;
    e.at = static_cast<uint32_t>(-30000);
    EXPECT_TRUE(b.step(b.terminal(-24000, kV_dc / 2 + 1.5), e));
    EXPECT_LT(static_cast<int32_t>(b.self.at), -20000);
}

// A rotor that is about to start: all of its EMF, 0.3 V, is as near to the lower rail as what freewheeling leaves, 0.35 V. Behind the
// currents it shows, where 0.0875 V are left. Twins: where the next crossings are sure, or soon after a commutation, it shows nothing.
TEST(ZeroCrossing, AtTheLowerRailASlowEmfShows)
{
    constexpr double kSlow_V = 0.3;
    const pm_q_t slow_swing = fixed(kSlow_V * kPi / 3 / kBase_V, 28);
    const auto find = [&](uint32_t sector, pm_q_t seen, double since) {
        Bench b;
        b.legs = ZERO_LEGS_LOW;
        b.config.swing = slow_swing;
        b.sector = sector;
        const zero_expected_t e = {0, 0, kT60, 0, seen};
        zero_crossing_open(&b.self, sector, false, static_cast<uint32_t>(static_cast<int32_t>(since)));
        for (double at = since + 2000; at < kT60 / 2.0; at += kSpacing) {
            const double towards = sector % 2 == 0 ? 1 : -1;
            const double v = towards * kSlow_V * std::sin(degrees(at) * kDegree);
            if (b.step(b.terminal(at, v), e)) {
                return degrees(static_cast<double>(static_cast<int32_t>(b.self.at)));
            }
        }
        return 1e3;
    };
    const double half = kT60 / 2.0;
    EXPECT_NEAR(find(0, slow_swing / 8, -half), 0, 3);
    EXPECT_NEAR(find(1, slow_swing / 8, -half), 0, 3);
    EXPECT_EQ(find(1, 0, -half), 1e3);
    EXPECT_EQ(find(1, slow_swing / 8, -kT60 * 0.32), 1e3);
}

// The diode of the open leg has carried a current in the off time, and its terminal is on the way from the rail: one sample
// past the crossing behind one ahead of it, two of them behind the freewheeling.
TEST(ZeroCrossing, ASampleOnItsWayFromARailIsNoEarlyCrossing)
{
    for (const bool ahead : {true, false}) {
        Bench bench;
        bench.open();
        double at = -45000;
        if (ahead) {
            EXPECT_FALSE(bench.step(bench.sample(at)));
        }
        for (const double v : {13.0, 15.0, 13.5}) {
            at += kSpacing;
            EXPECT_FALSE(bench.step(bench.terminal(at, v))) << v;
        }
        while (!bench.step(bench.sample(at)) && at < kT60 / 2.0) {
            at += kSpacing;
        }
        EXPECT_NEAR(static_cast<int32_t>(bench.self.at), 0, kShape_counts) << ahead;
    }
}

// A rotor that is accelerated: the crossing comes 18 degrees before it is due, and the samples have the slope of its EMF.
TEST(ZeroCrossing, AnEarlyCrossingIsOneWhereItsSamplesAgree)
{
    zero_expected_t expected = kExpected;
    expected.at = 30000;
    Bench bench;
    EXPECT_NEAR(bench.find(-21000, expected), 0, kShape_counts);
}

TEST(ZeroCrossing, NoRotorIsThatFarPast)
{
    Bench b;
    b.open();
    const double swing_V = kAmplitude * kPi / 3;
    for (double at = 1000; at < 20000; at += 1000) {
        EXPECT_FALSE(b.step(b.terminal(at, kV_dc / 2 + 0.63 * swing_V)));
    }
    EXPECT_TRUE(b.step(b.terminal(21000, kV_dc / 2 + 0.6 * swing_V)));
    EXPECT_NEAR(static_cast<int32_t>(b.self.at), 21000 - 0.6 * kT60, 10);
}

TEST(ZeroCrossing, PassesOverFreewheelingAndBlanking)
{
    for (uint32_t sector = 0; sector < 2; ++sector) {
        Bench b;
        b.sector = sector;
        b.open();
        const double rail = sector == 0 ? kV_dc + 0.8 : 0;
        for (double at = -29500; at < 15000; at += kSpacing) {
            EXPECT_FALSE(b.step(b.terminal(at, rail)));
        }
        // Longer than 30 degrees: found late, where it was.
        EXPECT_TRUE(b.step(b.sample(16000)));
        EXPECT_LT(std::abs(degrees(static_cast<int32_t>(b.self.at))), 0.3);
        // Twin: without the rail's margin the first sample is a crossing.
        Bench twin;
        twin.sector = sector;
        twin.config.rail = fixed(-2 / kBase_V, 28);
        twin.open();
        twin.config.swing = swing(10);
        zero_expected_t e = kExpected;
        e.at = static_cast<uint32_t>(-30000);
        EXPECT_TRUE(twin.step(b.terminal(-29000, rail), e));
    }
    Bench b;
    b.config.blank = 20000;
    b.open();
    EXPECT_FALSE(b.step(b.sample(-40000)));
    EXPECT_FALSE(b.self.ahead);
    EXPECT_FALSE(b.step(b.sample(-30001)));
    EXPECT_FALSE(b.self.ahead);
    EXPECT_FALSE(b.step(b.sample(-30000)));
    EXPECT_TRUE(b.self.ahead);
}

// The current of a machine that brakes freewheels at the other rail: nothing is known of the crossing.
TEST(ZeroCrossing, PassesOverFreewheelingOfABrakingCurrent)
{
    for (uint32_t sector = 0; sector < 2; ++sector) {
        Bench b;
        b.sector = sector;
        b.open();
        for (double at = -29000; at < 10000; at += kSpacing) {
            EXPECT_FALSE(b.step(b.terminal(at, sector == 0 ? 0 : kV_dc + 0.8)));
            EXPECT_FALSE(b.self.ahead);
        }
        EXPECT_TRUE(b.step(b.sample(12000)));
        EXPECT_LT(std::abs(degrees(static_cast<int32_t>(b.self.at))), 0.3);
    }
}

// Off time: the rail cuts one side of the EMF; the distance of the sample on the other side counts (10.3.2).
TEST(ZeroCrossing, OffTimeSamplesOfWhichARailCutsHalf)
{
    for (const zero_legs_t legs : {ZERO_LEGS_LOW, ZERO_LEGS_HIGH}) {
        for (uint32_t sector = 0; sector < 2; ++sector) {
            Bench b;
            b.sector = sector;
            b.legs = legs;
            for (double first = -29000; first < -29000 + kSpacing; first += 500) {
                b.open();
                bool found = false;
                for (double at = first; at < 30000 && !found; at += kSpacing) {
                    found = b.step(b.sample(at)); // between zero and the upper diode's voltage above v_dc
                }
                ASSERT_TRUE(found);
                EXPECT_LT(std::abs(degrees(static_cast<int32_t>(b.self.at))), 0.5) << legs << sector << first;
            }
        }
    }
}

TEST(ZeroCrossing, ThresholdMovesIt)
{
    Bench b;
    zero_expected_t e = kExpected;
    e.threshold = fixed(0.5 / kBase_V, 28);
    const double moved = std::asin(0.5 / kAmplitude) / kDegree / 60 * kT60;
    EXPECT_NEAR(b.find(-29000, e), moved, 2 * kShape_counts);
}

// A rotor at rest: what is left is noise, which crosses in each second sample.
TEST(ZeroCrossing, NoiseIsNoCrossingWhereAnEmfIsAskedFor)
{
    for (const bool asked : {true, false}) {
        Bench b;
        zero_expected_t e = kExpected;
        e.seen = asked ? b.config.swing / 8 : 0;
        b.open();
        bool found = false;
        for (int k = 1; k < 20 && !found; ++k) {
            found = b.step(b.terminal(-30000 + 2000 * k, kV_dc / 2 + (k % 2 == 0 ? 0.05 : -0.05)), e);
        }
        EXPECT_EQ(found, !asked);
        EXPECT_EQ(b.self.ahead, !asked);
    }
}

TEST(ZeroCrossing, AnEmfIsSeenWhereOneIsAskedFor)
{
    Bench b;
    zero_expected_t e = kExpected;
    e.seen = b.config.swing / 8;
    EXPECT_NEAR(b.find(-29000, e), 0, kShape_counts);
}

TEST(ZeroCrossing, InstantsWrap)
{
    Bench b;
    zero_crossing_open(&b.self, 0, false, UINT32_MAX - 5000U);
    Sample s = b.sample(-100);
    s.when.at = UINT32_MAX - 99U;
    EXPECT_FALSE(b.step(s));
    s = b.sample(100);
    s.when.at = 100;
    EXPECT_TRUE(b.step(s));
    EXPECT_NEAR(static_cast<int32_t>(b.self.at), 0, kShape_counts);
}

// y of the swing at two instants, over t_60, of a terminal that is neither ahead nor past by a rail; whether the second has found
// the crossing that is due `early` behind it.
struct Pair {
    double from, y_from, to, y_to, early;

    bool found(Bench &b) const
    {
        zero_expected_t e = kExpected;
        e.at = static_cast<uint32_t>(static_cast<int32_t>(std::lround((to + early) * kT60)));
        b.open();
        EXPECT_FALSE(b.step(at(b, from, y_from), e));
        EXPECT_TRUE(b.self.ahead);
        return b.step(at(b, to, y_to), e);
    }
    static Sample at(const Bench &b, double place, double y)
    {
        return b.terminal(std::round(place * kT60), kV_dc / 2 + y * kAmplitude * kPi / 3);
    }
};

// Where it is 15 degrees early, a quarter of t_60, samples a quarter of t_60 apart or nearer must agree with the slope.
TEST(ZeroCrossing, FromWhereACrossingIsEarlyOn)
{
    for (const double early : {-0.5, 0.0, 0.2, 0.24, 0.26, 0.4}) {
        Bench b;
        EXPECT_EQ((Pair{-0.1, -0.5, 0.05, 0.6, early}).found(b), early < 0.25) << early; // 1.1 in 0.15
    }
    for (const double apart : {0.1, 0.24, 0.26, 0.3}) {
        Bench b;
        EXPECT_EQ((Pair{0.02 - apart, -0.6, 0.02, 0.6, 0.4}).found(b), apart > 0.25) << apart;
    }
}

// Four times what the EMF rises by in between, and half of the rail for a noisy channel.
TEST(ZeroCrossing, SamplesThatAgreeAreWithinFourSlopes)
{
    const double rail = 0.35 / (kAmplitude * kPi / 3);
    for (const double apart : {0.02, 0.05, 0.1, 0.2}) {
        for (const double rails : {-0.6, 0.0, 0.4, 0.6, 0.9}) {
            const double jump = 4 * apart + rails * rail;
            Bench b;
            EXPECT_EQ((Pair{-0.1, -0.4 * jump, -0.1 + apart, 0.6 * jump, 0.3}).found(b), rails < 0.5)
                << apart << ' ' << rails;
        }
    }
}

// x <= 3/4: however far a first sample is behind one that the rail has cut.
TEST(ZeroCrossing, ALateCrossingIsNoEarlierThanThreeQuartersOfASector)
{
    for (const double y : {0.3, 0.6, 0.74, 0.77, 0.9, 1.2}) {
        Bench b;
        b.legs = ZERO_LEGS_LOW;
        b.open();
        EXPECT_FALSE(b.step(b.terminal(-20000, 0)));
        EXPECT_TRUE(b.self.cut);
        ASSERT_TRUE(b.step(b.terminal(80000, y * kAmplitude * kPi / 3))) << y;
        EXPECT_NEAR(static_cast<int32_t>(b.self.at), 80000 - std::min(y, 0.75) * kT60, 2 * kError_counts)
            << y;
    }
}

TEST(ZeroCrossing, ASwingIsThatOfTheSpeedAndNeverNone)
{
    Bench b;
    for (const double slower : {0.5, 1.0, 3.0}) {
        const pm_q_t y = zero_crossing_swing(&b.config, static_cast<uint32_t>(slower * kT60));
        EXPECT_NEAR(bldc_rig::real(y), kAmplitude * kPi / 3 / kBase_V / slower, 1e-6);
    }
    b.config.swing = 1;
    EXPECT_GT(zero_crossing_swing(&b.config, 1000 * kT60), 0);
}

// Behind the freewheeling, without a sample ahead: once it is due, one past sample is enough; before, the next must say the same,
// which more than 15 degrees before takes the slope of the EMF, too.
TEST(ZeroCrossing, ASecondPastSampleIsBelievedWhereTheCrossingIsNearly)
{
    for (const double early : {-0.05, 0.1, 0.2, 0.3}) {
        for (const bool agrees : {true, false}) {
            Bench b;
            b.open();
            zero_expected_t e = kExpected;
            e.at = static_cast<uint32_t>(static_cast<int32_t>(std::lround((0.1 + early) * kT60)));
            const bool first = b.step(Pair::at(b, 0.06, 0.05), e);
            EXPECT_EQ(first, early + 0.04 < 0);
            if (!first) {
                EXPECT_FALSE(b.self.ahead);
                EXPECT_EQ(b.step(Pair::at(b, 0.1, agrees ? 0.1 : 0.5), e), agrees || early < 0.25) << early;
            }
        }
    }
}

// A leg that falls to the lower rail with both legs low: y of the last sample above it, a twentieth of t_60 before the next.
struct IntoTheRail {
    Bench b;
    double rail_V = 0.35;

    explicit IntoTheRail(double y)
    {
        b.sector = 1;
        b.legs = ZERO_LEGS_LOW;
        b.open();
        EXPECT_FALSE(step(0, y * kAmplitude * kPi / 3));
        EXPECT_TRUE(b.self.ahead);
    }
    bool step(double at, double v)
    {
        return b.step(b.terminal(at * kT60, v));
    }
    double found() const
    {
        return static_cast<double>(static_cast<int32_t>(b.self.at)) / kT60;
    }
};

TEST(ZeroCrossing, ACrossingIntoTheRailIsBehindTheLastSampleBySlope)
{
    const double small = 1e-4; // of t_60
    IntoTheRail by_slope(0.1);
    EXPECT_TRUE(by_slope.step(0.15, 0));
    EXPECT_NEAR(by_slope.found(), 0.1, small);
    // faster than expected: by this sample at the latest
    IntoTheRail by_sample(0.1);
    EXPECT_TRUE(by_sample.step(0.05, 0));
    EXPECT_NEAR(by_sample.found(), 0.05, small);
    // an offset up to a quarter of `rail` is the rail: not before the slope is through
    for (const double offset : {0.1, 0.24}) {
        IntoTheRail rests(0.1);
        EXPECT_FALSE(rests.step(0.05, offset * rests.rail_V));
        EXPECT_NEAR(rests.found(), 0, small);
        EXPECT_TRUE(rests.step(0.15, offset * rests.rail_V));
        EXPECT_NEAR(rests.found(), 0.1, small) << offset;
    }
    // more is a terminal on its way
    IntoTheRail moves(0.1);
    EXPECT_FALSE(moves.step(0.05, 0.27 * moves.rail_V));
    EXPECT_NEAR(moves.found(), 0.05, small);
}

// Neither side tells a distance: it was by this sample.
TEST(ZeroCrossing, BetweenTwoRailsItIsTheSampleItself)
{
    Bench b;
    b.legs = ZERO_LEGS_LOW;
    b.open();
    EXPECT_FALSE(b.step(b.terminal(-3000, 0)));
    EXPECT_TRUE(b.self.cut);
    EXPECT_TRUE(b.step(b.terminal(1000, kV_dc)));
    EXPECT_EQ(static_cast<int32_t>(b.self.at), 1000);
}

// A rotor twice as fast as expected: by interpolation the crossing is at 0, by the slope of one sample it would not be.
TEST(ZeroCrossing, SamplesThatNoRailHasCutAreInterpolated)
{
    const auto y_V = [](double at) { return 2 * at / kT60 * kAmplitude * kPi / 3; };
    // the off time, cut by the rail, tells less than the on time before
    Bench b;
    b.open();
    EXPECT_FALSE(b.step(b.terminal(-6000, kV_dc / 2 + y_V(-6000))));
    b.legs = ZERO_LEGS_LOW;
    EXPECT_FALSE(b.step(b.terminal(-2000, 0)));
    EXPECT_FALSE(b.self.cut);
    b.legs = ZERO_LEGS_APART;
    EXPECT_TRUE(b.step(b.terminal(2000, kV_dc / 2 + y_V(2000))));
    EXPECT_NEAR(static_cast<int32_t>(b.self.at), 0, kError_counts);
    // of two cut ones the later one counts
    Bench cut;
    cut.legs = ZERO_LEGS_LOW;
    cut.open();
    EXPECT_FALSE(cut.step(cut.terminal(-6000, 0)));
    EXPECT_FALSE(cut.step(cut.terminal(-2000, 0)));
    EXPECT_EQ(static_cast<int32_t>(cut.self.at), -2000);
    // with both legs high `rail` is above v_dc: 0.1 V over it is not at the rail
    Bench high;
    high.legs = ZERO_LEGS_HIGH;
    high.open();
    EXPECT_FALSE(high.step(high.terminal(-4000, kV_dc + y_V(-4000))));
    EXPECT_TRUE(high.step(high.terminal(1000, kV_dc + y_V(1000))));
    EXPECT_LT(y_V(1000), 0.35);
    EXPECT_NEAR(static_cast<int32_t>(high.self.at), 0, kError_counts);
}

// A terminal that has come from a rail with one sample past the crossing and goes on with the slope: from the next one's distance.
TEST(ZeroCrossing, AnEarlySampleThatDisagreesIsTheFirstPastTheCrossing)
{
    zero_expected_t e = kExpected;
    e.at = 40000;
    Bench b;
    b.open();
    EXPECT_FALSE(b.step(Pair::at(b, -0.02, -0.4), e));
    EXPECT_TRUE(b.self.ahead);
    EXPECT_FALSE(b.step(Pair::at(b, 0.0, 0.2), e)); // 0.6 in 0.02
    EXPECT_FALSE(b.self.ahead);
    ASSERT_TRUE(b.step(Pair::at(b, 0.04, 0.24), e));
    EXPECT_NEAR(static_cast<int32_t>(b.self.at), (0.04 - 0.24) * kT60, 2 * kError_counts);
}

} // namespace
