// six_step.h call by call, without a plant: a rotor whose crossings are given in counts, terminals that follow from them in
// double precision, and the legs, commutations and samples that are asked for held against the header's instants.
#include "bldc/six_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "tests/unit/bldc/rig.h"

namespace
{

using bldc_rig::fixed;
using bldc_rig::real;

constexpr int kN = 1000;        // counts of half a period
constexpr int kPeriod = 2 * kN; // counts
constexpr int kLead = 100;      // counts
constexpr double kLink = 0.6;   // per-unit, as all voltages here
constexpr double kDiode = 0.02;
constexpr double kSwing = 0.3;  // in 60 degrees at kOmega: never at a rail
constexpr double kOmega = 0.5;  // per-unit, of the rotor
constexpr double kU = 0.5;      // of the link
constexpr double kRounding = 5; // counts: 2 of an instant, 3 of commutation_due()
constexpr double kReset = 3;    // counts: of the angle, the quotient and the sixth

six_step_config_t configured(double T, double advance = 0)
{
    six_step_config_t c = {};
    c.pattern.id = PATTERN_H_PWM_L_ON;
    c.pattern.complementary = true;
    c.pattern.half_period = kN;
    c.pattern.lead = kLead;
    c.pattern.least = 200;
    c.pattern.most = PM_ONE;
    c.crossings = CROSSINGS_open_terminal;
    c.crossing.reference = ZERO_LINK;
    c.crossing.rail = fixed(0.01, PM_Q_BITS);
    c.crossing.blank = 50;
    c.crossing.swing = fixed(kSwing / kOmega, PM_Q_BITS);
    c.commutation.turn_base = static_cast<uint32_t>(std::lround(6 * T * kOmega));
    c.crossing.t_60 = static_cast<uint32_t>(std::lround(T * kOmega));
    c.commutation.half = fixed((0.5 - advance) / 6, 32);
    c.commutation.strikes = 4;
    c.thresholds.most = fixed(0.1, PM_Q_BITS);
    c.compared = -1;
    return c;
}

pm_angle_t turns(double x)
{
    return static_cast<pm_angle_t>(std::llround(std::ldexp(x - std::floor(x), 32)) & 0xFFFFFFFFLL);
}

// Crossing in the middle of the sector: 60 degrees behind that in the sector before, at 60 degrees in sector 0.
double crossing_turn(uint32_t sector)
{
    return (sector + 1) / 6.0;
}

// A to C; B and C change places in the other direction (sectors.h).
struct Legs {
    char high, low, open;
};

Legs legs_of(int64_t k, bool reverse)
{
    static const Legs forward[] = {{'B', 'A', 'C'}, {'C', 'A', 'B'}, {'C', 'B', 'A'},
                                   {'A', 'B', 'C'}, {'A', 'C', 'B'}, {'B', 'C', 'A'}};
    Legs l = forward[((k % 6) + 6) % 6];
    for (char *leg : {&l.high, &l.low, &l.open}) {
        *leg = reverse && *leg != 'A' ? static_cast<char>('B' + 'C' - *leg) : *leg;
    }
    return l;
}

// A rotor and the drive that follows it. Crossing k is in sector k mod 6; first is that before the reset.
class Bench
{
  public:
    Bench(double T, const six_step_config_t &c, uint32_t sector = 0, bool backwards = false,
          int64_t start = 0)
        : config(c), T_(T), first_(sector), start_(start), now(start), reverse(backwards)
    {
    }

    // The crossing was a share of a sector ago.
    void reset(double ago = 0.1)
    {
        z0_ = static_cast<double>(now) - ago * T_;
        const double turn = crossing_turn(static_cast<uint32_t>(first_)) + ago / 6;
        six_step_reset(&s, &config, turns(reverse ? -turn : turn),
                       fixed(reverse ? -kOmega : kOmega, PM_Q_BITS), static_cast<uint32_t>(now));
        reset_ = now;
        ask_[0] = ask_[1] = {};
        commutations.clear();
    }

    // Instant of crossing k, what the rotor does.
    double z(int64_t k) const
    {
        const int64_t n = k - first_;
        return z0_ + static_cast<double>(n) * T_ + (n > 0 && late ? late(k) : 0);
    }

    void period()
    {
        six_step_in_t in = {};
        in.now = static_cast<uint32_t>(now);
        in.u = fixed(u, PM_Q_BITS);
        zero_sample_t sample = {};
        const Ask &asked = ask_[0];
        const bool looked = !third && !s.lost && asked.there && asked.out.sample_at != 0;
        if (looked) {
            sample = measured(asked);
            if (config.crossings == CROSSINGS_virtual_third) {
                six_step_from_mean(&s, &sample);
            }
            in.sample = &sample;
        }
        zero_sample_t before = {};
        if (stale > 0) {
            --stale;
            before.v_dc = fixed(kLink, PM_Q_BITS);
            before.v[0] = before.v[1] = before.v[2] = fixed(kLink / 2, PM_Q_BITS);
            in.sample = &before;
        }
        if (third) {
            in.v_zero = fixed(zero_at(static_cast<double>(now)), PM_Q_BITS);
        }
        const uint8_t was = s.crossing.sector;
        six_step_step(&s, &config, &in, &out);
        if (s.crossing.sector != was && !commutations.empty()) {
            opened.push_back({first_ + sector_at_sample_, s.crossing.open_since});
        }
        ask_[0] = ask_[1];
        ask_[1] = {now + kPeriod, out, true};
        if (out.commutate_at != 0) {
            commutations.push_back(now + kPeriod + out.commutate_at);
        }
        now += kPeriod;
    }
    // Less than so many sectors since the beginning.
    bool within(double sectors) const
    {
        return static_cast<double>(now - start_) < sectors * T_;
    }
    // What the first call can ask for.
    double earliest() const
    {
        return static_cast<double>(reset_ + kPeriod + 1);
    }
    double sectors() const
    {
        return static_cast<double>(commutations.size());
    }
    void run(int periods)
    {
        for (int n = 0; n < periods; ++n) {
            period();
        }
    }

    // To the call that finds the next crossing; its sector.
    uint8_t to_crossing()
    {
        const uint8_t was = s.commutation.crossed;
        for (int n = 0; s.commutation.crossed == was && n < 1000; ++n) {
            period();
        }
        return s.commutation.crossed;
    }

    // Legs that conduct, as asked for: the commutation out of sector k is commutations[k - first].
    void expect_legs() const
    {
        const int64_t k = first_ + static_cast<int64_t>(commutations.size());
        const Legs after = legs_of(k, reverse);
        const Legs before = legs_of(out.commutate_at != 0 ? k - 1 : k, reverse);
        expect_states(out.legs.legs, before);
        expect_states(out.then, after);
        EXPECT_EQ(out.legs.duty[before.high - 'A'], fixed(u, PM_Q_BITS));
    }
    static void expect_states(uint16_t legs, const Legs &l)
    {
        EXPECT_EQ(pm_leg(legs, static_cast<uint32_t>(l.high - 'A')), PM_LEG_PWM);
        EXPECT_EQ(pm_leg(legs, static_cast<uint32_t>(l.low - 'A')), PM_LEG_LOW);
        EXPECT_EQ(pm_leg(legs, static_cast<uint32_t>(l.open - 'A')), PM_LEG_OFF);
    }
    // The instants that sectors of the samples were opened at are those of the commutations, exactly.
    void expect_opened() const
    {
        for (const Opened &o : opened) {
            const auto n = static_cast<size_t>(o.k - first_ - 1);
            ASSERT_LT(n, commutations.size());
            EXPECT_EQ(o.since, static_cast<uint32_t>(commutations[n])) << o.k;
        }
    }

    six_step_config_t config;
    six_step_t s = {};
    six_step_out_t out = {};
    std::vector<int64_t> commutations;
    struct Opened {
        int64_t k;
        uint32_t since;
    };
    std::vector<Opened> opened;
    double u = kU;
    int stale = 0;                                 // samples that were not asked for
    bool third = false;                            // v_zero
    double frozen = 0;                             // v_zero from shortly behind crossing 2 on
    double lag = 0;                                // of v_zero, counts
    double (*late)(int64_t k) = nullptr;           // of crossing k
    double (*seen)(int64_t k, double y) = nullptr; // another distance, of sector k
    double ringing = 0;       // counts behind a commutation in which a terminal is past its crossing
    int64_t held = INT64_MAX; // from this crossing on there is nothing but a rail

  private:
    struct Ask {
        int64_t start;
        six_step_out_t out;
        bool there;
    };

    // Towards the crossing, of the sector nearest to it in which this leg is open; flat beyond 30 degrees.
    double distance(int64_t k, double at) const
    {
        const double y = kSwing * std::min(0.5, std::max(-0.5, (at - z(k)) / T_));
        return seen != nullptr ? seen(k, y) : y;
    }
    zero_sample_t measured(const Ask &asked)
    {
        const double place = asked.out.sample_at;
        const double at = static_cast<double>(asked.start) + place;
        int64_t n = 0;
        for (const int64_t c : commutations) {
            n += static_cast<double>(c) < at ? 1 : 0;
        }
        sector_at_sample_ = n;
        const int64_t k = first_ + n;
        const bool changed = asked.out.commutate_at != 0 && asked.out.commutate_at < asked.out.sample_at;
        const uint16_t states = changed ? asked.out.then : asked.out.legs.legs;
        const Legs l = legs_of(k, reverse);
        const double high = terminal(states, asked, l.high, place),
                     low = terminal(states, asked, l.low, place);
        const double way = k % 2 == 0 ? 1 : -1;
        double open = (high + low) / 2 + way * distance(k, at);
        const bool rings =
            n > 0 && at - static_cast<double>(commutations[static_cast<size_t>(n - 1)]) < ringing;
        if (rings) {
            open = (high + low) / 2 + way * kSwing / 3;
        }
        open = std::min(open, kLink + kDiode);
        if (k >= held) {
            open = way > 0 ? kLink : 0;
        }
        zero_sample_t sample = {};
        sample.v_dc = fixed(kLink, PM_Q_BITS);
        sample.v[l.high - 'A'] = fixed(high, PM_Q_BITS);
        sample.v[l.low - 'A'] = fixed(low, PM_Q_BITS);
        sample.v[l.open - 'A'] = fixed(open, PM_Q_BITS);
        return sample;
    }
    static double terminal(uint16_t states, const Ask &asked, char leg, double place)
    {
        const auto index = static_cast<uint32_t>(leg - 'A');
        const pm_leg_t state = pm_leg(states, index);
        EXPECT_NE(state, PM_LEG_OFF) << leg;
        if (state == PM_LEG_HIGH) {
            return kLink;
        }
        const bool up = std::abs(place - kN) < real(asked.out.legs.duty[index]) * kN;
        return state == PM_LEG_PWM && up ? kLink : 0;
    }
    // Star point: between two crossings from one to the other, by the nearest.
    double zero_at(double at) const
    {
        int64_t k = first_;
        while (std::abs(z(k + 1) + lag - at) < std::abs(z(k) + lag - at)) {
            ++k;
        }
        // Gone as soon as the last crossing was seen, so that no sample is ahead of the next one.
        if (frozen != 0 && at - lag > z(2) + 0.4 * T_) {
            return frozen;
        }
        const bool gone = held != INT64_MAX && at - lag > z(held - 1) + kPeriod;
        return gone ? 0 : (k % 2 == 0 ? 1 : -1) * distance(k, at - lag);
    }

    double T_;
    int64_t first_, start_, reset_ = 0;
    double z0_ = 0;
    Ask ask_[2] = {};
    int64_t sector_at_sample_ = 0;

  public:
    int64_t now;
    bool reverse;
};

// Commutation n, out of the sector of crossing n, is half a sector less the advance behind it.
void expect_on_time(const Bench &b, int64_t first, double T, double advance = 0, size_t from = 0,
                    double rounding = kRounding)
{
    for (size_t n = from; n < b.commutations.size(); ++n) {
        const double due = b.z(first + static_cast<int64_t>(n)) + (0.5 - advance) * T;
        EXPECT_NEAR(static_cast<double>(b.commutations[n]), std::max(due, b.earliest()), rounding) << n;
    }
}

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
            Bench::expect_states(out.legs.legs, legs_of(sector, false));
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

// The latter half of the sector told, the first of the next: the crossing before is that of the angle.
TEST(SixStepSteps, ResetTakesTheLastCrossingFromTheAngle)
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

TEST(SixStepSteps, AnAngleAtTheEndsOfATurnIsInASector)
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

TEST(SixStepSteps, ARotorAtTheEndOfASectorStandsInOne)
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
TEST(SixStepSteps, ResetHasNothingToLearnFrom)
{
    const double T = 20 * kPeriod;
    for (const bool was : {true, false}) {
        Bench b(T, configured(T));
        b.s.learn = was;
        b.s.alike = 3;
        b.reset(0.05);
        b.run(8); // in the sector
        EXPECT_EQ(b.s.alike, 3U);
        EXPECT_EQ(b.s.commutation.whole, 0);
    }
}

TEST(SixStepSteps, BeginTakesTheSectorThatTheRotorStandsInTheMiddleOf)
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
        EXPECT_EQ(b.out.legs.legs, PM_LEGS_OFF);
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

// Of one that was used, in the other direction, with a crossing half seen and commutations asked for.
TEST(SixStepSteps, ResetLeavesNothingOfTheRunBefore)
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
            ASSERT_EQ(again.out.legs.legs, fresh.out.legs.legs) << n;
            ASSERT_EQ(again.out.then, fresh.out.then) << n;
            ASSERT_EQ(again.s.crossing.open_since, fresh.s.crossing.open_since) << n;
            ASSERT_EQ(again.s.commutation.crossing, fresh.s.commutation.crossing) << n;
            ASSERT_EQ(again.s.commutation.strikes, 0) << n;
        }
        again.expect_opened();
    }
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

// thresholds.h: leg C upwards in sector 0, downwards in 3, both at u_V further out; B shows no deviation.
constexpr double kDivider = 0.02; // 4 degrees

double divider_of_C(int64_t k, double y)
{
    return k % 3 == 0 ? y + (k % 2 == 0 ? kDivider : -kDivider) : y;
}

TEST(SixStepSteps, ThresholdsAreTakenOffTheVoltages)
{
    const double T = 9.37 * kPeriod;
    Bench b(T, configured(T), 0);
    b.s.thresholds.u_V[2] = fixed(kDivider, PM_Q_BITS);
    b.reset();
    b.seen = divider_of_C;
    b.run(120);
    expect_on_time(b, 0, T);
    EXPECT_EQ(b.s.expected.moved, 0);
    // Twin: not taken off, C is kDivider / kSwing of a sector early upwards, which the mean of a turn leaves alone.
    Bench twin(T, configured(T), 0);
    twin.reset();
    twin.seen = divider_of_C;
    twin.run(220);
    ASSERT_GT(twin.commutations.size(), 15U);
    EXPECT_NEAR(static_cast<double>(twin.commutations[12]), twin.z(12) + (0.5 - kDivider / kSwing) * T,
                kRounding);
    EXPECT_NEAR(static_cast<double>(twin.commutations[15]), twin.z(15) + (0.5 + kDivider / kSwing) * T,
                kRounding);
}

// The same of the third harmonic of the terminals, where instants are moved and voltages left as they are.
TEST(SixStepSteps, DeviationsOfAThirdHarmonicAreTakenOffTheInstants)
{
    const double T = 9.37 * kPeriod;
    Bench b(T, configured(T), 0);
    b.config.crossings = CROSSINGS_virtual_third;
    b.config.compared = 0;
    b.s.thresholds.u_V[2] = fixed(kDivider, PM_Q_BITS);
    b.reset();
    b.seen = divider_of_C;
    six_step_slow(&b.s, &b.config);
    EXPECT_NEAR(b.s.phase.shift[0], kDivider / kSwing * T, 2);
    EXPECT_NEAR(b.s.phase.shift[3], -kDivider / kSwing * T, 2);
    b.run(120);
    expect_on_time(b, 0, T);
    EXPECT_EQ(b.s.commutation.strikes, 0);
    // With thresholds compared nothing is moved.
    b.config.compared = -1;
    b.s.phase = {};
    six_step_slow(&b.s, &b.config);
    EXPECT_EQ(b.s.phase.shift[0], 0);
}

// What a rotor with an uneven terminal teaches: once for each crossing, of a turn whose six intervals are measured.
TEST(SixStepSteps, LearnsOnceACrossingFromAWholeTurn)
{
    const double T = 9.37 * kPeriod;
    for (const bool reverse : {false, true}) {
        Bench b(T, configured(T), 0, reverse);
        b.config.thresholds.k_V = fixed(1.5 * 0.05, 32);
        b.config.thresholds.k_H = fixed(0.05, 32);
        b.reset();
        b.seen = divider_of_C;
        const uint32_t leg = reverse ? 1 : 2; // C and B change places
        int learnt = 0;
        int64_t k = 0;
        pm_q_t was = 0;
        uint8_t crossed = 0;
        while (k < 30 && b.within(40)) {
            b.period();
            if (b.s.commutation.crossed != crossed) {
                crossed = b.s.commutation.crossed;
                ++k;
            }
            const pm_q_t u = b.s.thresholds.u_V[leg];
            if (u == was) {
                continue;
            }
            // Upward crossings of this leg alone teach it. Late down, early up: D_V is four times the shift of a crossing.
            EXPECT_EQ(crossed, 0);
            const double D = 4 * (kDivider - real(was)) / kSwing * T;
            const double step = 0.05 * 1.5 * kSwing * D / (6 * T);
            EXPECT_NEAR(real(u - was), step, step / 50) << k; // the threshold has moved within the turn
            if (learnt == 0) {
                EXPECT_GE(k, 7); // six intervals lie between seven crossings
                EXPECT_LE(k, 18);
            }
            ++learnt;
            was = u;
        }
        EXPECT_GE(learnt, 2);
        EXPECT_EQ(b.s.alike, SECTORS);
    }
}

// Every crossing of these teaches: no D of thresholds.h is zero.
double uneven(int64_t k)
{
    static const double late[] = {400, -300, 150, -250, 350, -100};
    return late[k % 6];
}

bool differ(const pm_q_t a[PM_LEGS], const pm_q_t b[PM_LEGS])
{
    return !std::equal(a, a + PM_LEGS, b);
}

// Off-time crossings say nothing of on-time deviations: the next seven crossings of the on time have six intervals.
TEST(SixStepSteps, ACrossingOfTheOffTimeHoldsTheLearningForATurn)
{
    const double T = 9.37 * kPeriod;
    Bench b(T, configured(T), 0);
    b.config.pattern.id = PATTERN_H_ON_L_PWM; // both legs high in the off time: EMFs of either sign are seen
    b.late = uneven;
    b.reset();
    b.run(200);
    ASSERT_EQ(b.s.alike, SECTORS);
    ASSERT_EQ(b.s.commutation.whole, SECTORS);
    for (const int off : {1, 4}) {
        b.to_crossing();
        b.u = 0.05; // 100 counts of the period: shorter than `least`
        b.run(3);   // the samples asked for before are in
        for (int n = 0; n < off; ++n) {
            b.to_crossing();
            EXPECT_EQ(b.s.alike, 0U);
            EXPECT_FALSE(b.s.learn);
        }
        ASSERT_EQ(b.s.commutation.whole, SECTORS);
        b.u = kU;
        b.run(3);
        b.config.thresholds.k_V = fixed(1.5 * 0.05, 32);
        b.config.thresholds.k_H = fixed(0.05, 32);
        const thresholds_t before = b.s.thresholds;
        for (int on = 1; on <= 7; ++on) {
            const bool upwards = b.to_crossing() % 2 == 0;
            EXPECT_EQ(b.s.learn, true);
            b.run(3);
            EXPECT_EQ(differ(before.u_V, b.s.thresholds.u_V), on == 7 && upwards) << on;
            EXPECT_EQ(differ(before.u_H, b.s.thresholds.u_H), on == 7 && !upwards) << on;
        }
        b.config.thresholds.k_V = b.config.thresholds.k_H = 0;
        b.s.thresholds = {};
        b.run(200);
    }
}

// zero_crossing.h, `seen`: an eighth of the swing, of a rotor that starts or has eight samples in a sector and more.
TEST(SixStepSteps, WhatASectorMustShowIsAnEighthOfItsSwing)
{
    six_step_t s = {};
    const double T = 4 * kPeriod;
    const six_step_config_t c = configured(T);
    six_step_reset(&s, &c, PM_TURN(0.3), fixed(kOmega, PM_Q_BITS), 0);
    EXPECT_EQ(s.expected.seen, 0);
    const struct {
        uint32_t periods;
        uint8_t young;
        bool asked;
    } cases[] = {{7, 0, false}, {8, 0, true}, {9, 0, true}, {16, 0, true},
                 {2, 1, true},  {7, 6, true}, {2, 0, false}};
    for (const auto &x : cases) {
        s.expected.t_60 = x.periods * kPeriod;
        s.commutation.young = x.young;
        six_step_slow(&s, &c);
        const double swing = kSwing * T / (x.periods * kPeriod);
        EXPECT_NEAR(real(s.expected.seen), x.asked ? swing / 8 : 0, 1e-5) << x.periods;
    }
    s.thresholds.u_H[0] = 300;
    six_step_slow(&s, &c); // no mean: thresholds.h
    EXPECT_EQ(s.thresholds.u_H[0], 200);
    EXPECT_EQ(s.thresholds.u_H[1], -100);
}

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

TEST(SixStepSteps, ThirdHarmonicIsFollowedBehindItsLag)
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
TEST(SixStepSteps, ThirdHarmonicMovesInstantsByWhatWasLearnt)
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

TEST(SixStepSteps, ThirdHarmonicLearnsFromAWholeTurn)
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
TEST(SixStepSteps, ThirdHarmonicThatIsNotThereIsMissedAndLost)
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
        EXPECT_EQ(b.out.legs.legs, PM_LEGS_OFF);
        expect_on_time(b, 0, T, advance, 0, 5 * kRounding);
    }
}

TEST(SixStepSteps, ThirdHarmonicThatStaysAheadIsWaitedFor)
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
TEST(SixStepSteps, ThirdHarmonicIsAheadAsOfItsOwnInstant)
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

// Given up, it is no sample ahead of the one behind it, which has the other sign.
TEST(SixStepSteps, ThirdHarmonicThatIsGivenUpIsNotFoundLater)
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
TEST(SixStepSteps, ThirdHarmonicOfTheRunBeforeIsForgotten)
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
