// What block commutation asks for, call by call: legs, commutations and samples held against the instants of the header.
#include "tests/unit/bldc/six_step_bench.h"

namespace
{

using namespace six_step_bench;

TEST(SixStepSteps, CommutateAtTheInstantsOfTheHeaderInBothDirections)
{
    for (const bool reverse : {false, true}) {
        for (const double T : {3.13 * kPeriod, 5.3 * kPeriod, 12.71 * kPeriod}) {
            for (const double advance : {0.0, 0.1}) {
                const uint32_t sector = reverse ? 5 : 2;
                // the counter wraps within the second turn
                Bench b(T, configured(T, advance), sector, reverse, 0x100000000LL - std::llround(8 * T));
                b.reset();
                SCOPED_TRACE(T);
                const int periods = static_cast<int>(20 * T / kPeriod);
                for (int n = 0; n < periods; ++n) {
                    b.period();
                    b.expect_legs();
                    EXPECT_LT(b.out.commutate_at, kPeriod);
                }
                EXPECT_NEAR(b.sectors(), 20, 1);
                expect_on_time(b, sector, T, advance);
                b.expect_opened();
                EXPECT_GE(b.opened.size(), 17);
                EXPECT_EQ(b.s.commutation.strikes, 0);
                EXPECT_EQ(b.s.commutation.whole, SECTORS);
                EXPECT_FALSE(b.s.lost);
            }
        }
    }
}

// Evenly late by some counts more each sector: crossings and not the clock are what is followed.
double by_turns(int64_t k)
{
    return k % 6 < 3 ? 400 : -400;
}

TEST(SixStepSteps, CrossingsAreFoundWhereTheyAre)
{
    const double T = 9.37 * kPeriod;
    for (const bool reverse : {false, true}) {
        Bench b(T, configured(T), 0, reverse, 4321);
        b.late = by_turns;
        b.reset();
        int crossings = 0;
        uint8_t was = b.s.commutation.crossed;
        int64_t k = 0;
        for (int n = 0; n < 200; ++n) {
            b.period();
            if (b.s.commutation.crossed != was) {
                was = b.s.commutation.crossed;
                ++k;
                ++crossings;
                const auto at = static_cast<double>(static_cast<int32_t>(b.s.commutation.crossing));
                EXPECT_NEAR(at, b.z(k), 2) << k; // of its sector, whatever the drive commands by then
                EXPECT_EQ(was, k % 6);
                // what the six intervals of the last turn sum up to
                const uint32_t t_60 = b.s.expected.t_60;
                EXPECT_NEAR(t_60, k > 6 ? (b.z(k) - b.z(k - 6)) / 6 : T, k > 6 ? 2 : 150) << k;
                EXPECT_NEAR(static_cast<int32_t>(b.s.expected.at), at + t_60, 1);
            }
        }
        EXPECT_GE(crossings, 20);
        b.expect_opened();
    }
}

// 1 ... 2 N - 1 counts of the period after next; at once where it should have been before. `due` is the header's.
TEST(SixStepSteps, ACommutationBelongsToOnePeriod)
{
    const double T = 6 * kPeriod;
    const struct {
        int32_t due;
        uint16_t at;
    } cases[] = {
        {-500, 1},    {-1, 1},         {0, 1}, {1, 1}, {2, 2}, {1234, 1234}, {kPeriod - 1, kPeriod - 1},
        {kPeriod, 0}, {kPeriod + 1, 0}};
    for (const auto &x : cases) {
        for (const uint32_t sector : {0U, 3U, 5U}) {
            Bench b(T, configured(T), sector);
            b.reset();
            const uint32_t due = commutation_due(&b.s.commutation, &b.config.commutation);
            EXPECT_NEAR(due, (0.5 - 0.1) * T, kReset + 3);
            six_step_in_t in = {};
            in.now = due - static_cast<uint32_t>(x.due) - kPeriod;
            in.u = fixed(kU, PM_Q_BITS);
            six_step_out_t out = {};
            six_step_step(&b.s, &b.config, &in, &out);
            EXPECT_EQ(out.commutate_at, x.at) << x.due;
            EXPECT_EQ(b.s.commutation.sector, x.at != 0 ? (sector + 1) % 6 : sector);
            Bench::expect_states(out.legs, legs_of(sector, false));
            Bench::expect_states(out.then, legs_of(x.at != 0 ? sector + 1 : sector, false));
            // the next one is a sector later; it is made again only where something has moved it
            EXPECT_EQ(b.s.moved, x.at != 0);
            in.now += kPeriod;
            six_step_step(&b.s, &b.config, &in, &out);
            EXPECT_NEAR(static_cast<int32_t>(b.s.due - due), x.at != 0 ? T : 0, kReset + 3) << x.due;
            EXPECT_EQ(out.commutate_at, x.due >= kPeriod ? std::max(x.due - kPeriod, 1) : 0);
        }
    }
}

// A sample that is not there is made good by the next: the sector is open since its commutation.
TEST(SixStepSteps, ASectorIsOpenSinceItsCommutationWhereASampleIsMissing)
{
    const double T = 6 * kPeriod;
    for (const int32_t at : {1, 2, 700, kPeriod - 1}) {
        Bench b(T, configured(T), 3);
        b.reset();
        const uint32_t due = commutation_due(&b.s.commutation, &b.config.commutation);
        six_step_in_t in = {};
        in.now = due - static_cast<uint32_t>(at) - kPeriod;
        in.u = fixed(kU, PM_Q_BITS);
        six_step_out_t out = {};
        for (int n = 0; n < 3; ++n) {
            six_step_step(&b.s, &b.config, &in, &out);
            in.now += kPeriod;
        }
        zero_sample_t ahead = {};
        ahead.v_dc = fixed(kLink, PM_Q_BITS);
        ahead.v[0] = ahead.v[1] = ahead.v[2] = fixed(kLink / 2 - 0.1, PM_Q_BITS);
        in.sample = &ahead;
        six_step_step(&b.s, &b.config, &in, &out);
        EXPECT_EQ(b.s.crossing.sector, 4);
        EXPECT_EQ(b.s.crossing.open_since, due) << at;
    }
}

// One instant in the sector that the sample is in. PWM_ON: D - lead in even, N + D - lead in odd sectors.
TEST(SixStepSteps, ASampleIsAskedForInTheSectorThatItIsIn)
{
    const double T = 6 * kPeriod;
    constexpr int kEven = kN / 2 - kLead, kOdd = kN + kN / 2 - kLead;
    const struct {
        uint32_t sector;
        int commutate_at;
        int sample_at;
    } cases[] = {
        {0, kEven - 1, kOdd}, {0, kEven, kEven},     {0, kEven + 1, kEven}, {0, kOdd + 1, kEven},
        {0, 0, kEven},        {1, kEven - 1, kEven}, {1, kEven, 0},         {1, kOdd - 1, 0},
        {1, kOdd, kOdd},      {1, kOdd + 1, kOdd},   {1, 0, kOdd},
    };
    for (const auto &x : cases) {
        SCOPED_TRACE(x.sector);
        SCOPED_TRACE(x.commutate_at);
        Bench b(T, configured(T), x.sector);
        b.config.pattern.id = PATTERN_PWM_ON;
        b.reset();
        const uint32_t due = commutation_due(&b.s.commutation, &b.config.commutation);
        six_step_in_t in = {};
        in.now = due - static_cast<uint32_t>(x.commutate_at != 0 ? x.commutate_at : 2 * kPeriod) - kPeriod;
        in.u = fixed(kU, PM_Q_BITS);
        six_step_out_t out = {};
        six_step_step(&b.s, &b.config, &in, &out);
        EXPECT_EQ(out.commutate_at, x.commutate_at);
        EXPECT_NEAR(out.sample_at, x.sample_at, x.sample_at != 0 ? 1 : 0); // duties in counts are cut
        // Two calls on it comes, and is looked at as of that sector.
        in.now += kPeriod;
        six_step_out_t next = {};
        six_step_step(&b.s, &b.config, &in, &next);
        in.now += kPeriod;
        zero_sample_t middle = {};
        middle.v_dc = fixed(kLink, PM_Q_BITS);
        middle.v[0] = middle.v[1] = middle.v[2] = fixed(kLink / 2, PM_Q_BITS);
        in.sample = &middle;
        six_step_step(&b.s, &b.config, &in, &next);
        const bool after = out.commutate_at != 0 && x.commutate_at < x.sample_at;
        EXPECT_EQ(b.s.crossing.sector, (x.sector + (after ? 1 : 0)) % 6);
    }
}

// The crossing before is known: samples behind it in the same sector say nothing more.
TEST(SixStepSteps, NoCrossingIsCountedTwice)
{
    const double T = 20 * kPeriod;
    Bench b(T, configured(T));
    b.reset(0.05);
    const uint32_t at = b.s.commutation.crossing;
    for (int n = 0; n < 10; ++n) { // to the commutation, 9 periods on
        b.period();
        EXPECT_EQ(b.s.commutation.crossing, at);
        EXPECT_EQ(b.s.commutation.whole, 0);
        EXPECT_EQ(b.s.commutation.strikes, 0);
        EXPECT_TRUE(b.s.crossing.found);
    }
    b.run(13);
    EXPECT_EQ(b.s.commutation.whole, 1);
}

// Freewheeling throughout a sector: its commutations go on, in time, and it counts; the next crossing forgives it.
TEST(SixStepSteps, ASectorWithoutACrossingIsMissed)
{
    const double T = 8.3 * kPeriod;
    for (const uint32_t sector : {0U, 1U}) {
        Bench b(T, configured(T), sector);
        b.reset();
        b.held = sector + 3;
        while (b.s.commutation.strikes == 0 && b.within(10)) {
            b.period();
        }
        ASSERT_EQ(b.s.commutation.strikes, 1);
        // seen with the first sample of the next sector, delivered a period after its own
        const auto from = static_cast<double>(b.commutations[3]);
        EXPECT_GT(static_cast<double>(b.now), from + kPeriod);
        EXPECT_LE(static_cast<double>(b.now), from + 3 * kPeriod);
        EXPECT_EQ(b.s.commutation.crossed, (sector + 3) % 6);
        EXPECT_NEAR(b.s.commutation.crossing, b.z(sector + 3), kRounding);
        EXPECT_NEAR(b.s.expected.at, b.z(sector + 4), 2 * kRounding);
        EXPECT_EQ(b.s.commutation.whole, 0);
        b.held = INT64_MAX;
        b.run(20);
        EXPECT_EQ(b.s.commutation.strikes, 0);
        EXPECT_FALSE(b.s.lost);
        expect_on_time(b, sector, T, 0, 0, 2 * kRounding);
        b.expect_opened();
    }
}

TEST(SixStepSteps, LostAfterTheStrikesThenAllLegsAreOffUntilTheNextReset)
{
    const double T = 6.4 * kPeriod;
    Bench b(T, configured(T), 1);
    b.reset();
    b.held = 3;
    while (!b.s.lost && b.within(20)) {
        b.period();
        if (!b.s.lost) {
            b.expect_legs();
        }
    }
    EXPECT_TRUE(b.s.lost);
    EXPECT_EQ(b.s.commutation.strikes, b.config.commutation.strikes);
    // four sectors from that of crossing 3 on are over with the commutation out of 6
    EXPECT_GT(b.now, b.commutations[5]);
    EXPECT_LE(b.now, b.commutations[5] + 3 * kPeriod);
    b.held = INT64_MAX;
    for (int n = 0; n < 40; ++n) {
        b.period();
        EXPECT_EQ(b.out.legs, PM_LEGS_OFF);
        EXPECT_EQ(b.out.commutate_at, 0);
        EXPECT_TRUE(b.s.lost);
    }
    // as if it were new
    b.reset();
    EXPECT_FALSE(b.s.lost);
    b.run(80);
    EXPECT_FALSE(b.s.lost);
    expect_on_time(b, 1, T);
    EXPECT_NEAR(b.sectors(), 80 / 6.4, 1);
}

// Stays ahead by a third of what it shows at most: a rotor that has stopped.
double stopped(int64_t k, double y)
{
    return k >= 3 ? std::min(y, -kSwing / 6) : y;
}

// Row 108, commutation.h: while samples are ahead of the crossing the legs do not change, for up to one t_60.
TEST(SixStepSteps, WaitsForARotorThatIsStillAhead)
{
    const double T = 10.6 * kPeriod;
    Bench b(T, configured(T), 0);
    b.reset();
    b.seen = stopped;
    while (b.commutations.size() < 4 && b.within(20)) {
        b.period();
    }
    ASSERT_EQ(b.commutations.size(), 4U);
    // that out of sector 3 would be due half a sector behind its crossing; a whole one later at most
    EXPECT_NEAR(static_cast<double>(b.commutations[3]), b.z(3) + 1.5 * T, kRounding);
    // Three samples later than they should be: as late as the last that was ahead, half a sector behind that.
    Bench some(T, configured(T), 0);
    some.reset();
    some.late = [](int64_t k) { return k >= 3 ? 0.3 * 10.6 * kPeriod : 0; };
    while (some.commutations.size() < 4 && some.within(20)) {
        some.period();
    }
    ASSERT_EQ(some.commutations.size(), 4U);
    const double half = 0.5 * (some.z(3) - some.z(-3)) / 6; // of a turn whose last interval was longer
    EXPECT_NEAR(static_cast<double>(some.commutations[3]), some.z(3) + half, kRounding);
}

// Ringing: a terminal that shows anything within the blanking, also where a commutation is between two samples.
TEST(SixStepSteps, NothingIsLookedAtForTheBlankingAfterACommutation)
{
    for (const double T : {9.81 * kPeriod, 15.3 * kPeriod}) {
        Bench b(T, configured(T), 0);
        b.config.crossing.blank = static_cast<uint32_t>(0.3 * T);
        b.reset();
        b.ringing = 0.3 * T - 1;
        b.run(150);
        EXPECT_EQ(b.s.commutation.strikes, 0);
        expect_on_time(b, 0, T);
        Bench twin(T, configured(T), 0);
        twin.reset();
        twin.ringing = 0.3 * T - 1;
        twin.run(150);
        double most = 0;
        for (size_t n = 0; n < twin.commutations.size(); ++n) {
            most = std::max(most, std::abs(static_cast<double>(twin.commutations[n]) -
                                           (twin.z(static_cast<int64_t>(n)) + 0.5 * T)));
        }
        EXPECT_GT(most, 10 * kRounding);
    }
}

// One that stays across a commutation: the high leg into an even sector, whose low one is new.
TEST(SixStepSteps, CurrentIsThatOfTheLegThatStays)
{
    const double T = 9 * kPeriod;
    const six_step_config_t c = configured(T);
    const pm_q_t i[PM_LEGS] = {100, 20, 3};
    for (const bool reverse : {false, true}) {
        for (uint32_t sector = 0; sector < SECTORS; ++sector) {
            six_step_t s = {};
            const double turn = crossing_turn(sector) + 0.01;
            six_step_reset(&s, &c, turns(reverse ? -turn : turn),
                           fixed(reverse ? -kOmega : kOmega, PM_Q_BITS), 0);
            s.plan[0].sector = static_cast<uint16_t>((sector + 1) % 6); // of the period that has ended
            const Legs now = legs_of(sector, reverse), before = legs_of(sector + 5, reverse);
            const pm_q_t expected = now.high == before.high ? i[now.high - 'A'] : -i[now.low - 'A'];
            EXPECT_EQ(six_step_current(&s, i), expected) << sector;
            EXPECT_EQ(six_step_legs(&s).open, now.open - 'A');
        }
    }
}

// virtual_third.h: v_A + v_B + v_C - n v_dc / 2 ... in place of each; n of the period that has ended.
TEST(SixStepSteps, TheMeanStandsForEachTerminal)
{
    for (const zero_legs_t legs : {ZERO_LEGS_LOW, ZERO_LEGS_APART, ZERO_LEGS_HIGH}) {
        six_step_t s = {};
        s.plan[0].legs = legs;
        s.plan[1].legs = ZERO_LEGS_APART == legs ? ZERO_LEGS_LOW : ZERO_LEGS_APART;
        zero_sample_t sample = {{1000, 20000, 300000}, 0, 50000};
        six_step_from_mean(&s, &sample);
        for (const pm_q_t v : sample.v) {
            EXPECT_EQ(v, 321000 - 50000 * static_cast<int>(legs));
        }
    }
}

} // namespace
