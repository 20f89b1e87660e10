// six_step.h call by call, without a plant: a rotor whose crossings are given in counts, and terminals that follow from them in
// double precision.
#ifndef TESTS_UNIT_BLDC_SIX_STEP_BENCH_H
#define TESTS_UNIT_BLDC_SIX_STEP_BENCH_H

#include "bldc/six_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "tests/unit/bldc/rig.h"

namespace six_step_bench
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

inline six_step_config_t configured(double T, double advance = 0)
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

inline pm_angle_t turns(double x)
{
    return static_cast<pm_angle_t>(std::llround(std::ldexp(x - std::floor(x), 32)) & 0xFFFFFFFFLL);
}

// Crossing in the middle of the sector: 60 degrees behind that in the sector before, at 60 degrees in sector 0.
inline double crossing_turn(uint32_t sector)
{
    return (sector + 1) / 6.0;
}

// A to C; B and C change places in the other direction (sectors.h).
struct Legs {
    char high, low, open;
};

inline Legs legs_of(int64_t k, bool reverse)
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
        expect_states(out.legs, before);
        expect_states(out.then, after);
        EXPECT_EQ(compare_of(out, before.high), std::lround(u * kN));
    }
    uint16_t compare_of(const six_step_out_t &asked, char leg) const
    {
        uint16_t compare[PM_LEGS][2];
        pattern_write(&asked.on, asked.sector, reverse, compare);
        return compare[leg - 'A'][0];
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
        const uint16_t states = changed ? asked.out.then : asked.out.legs;
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
    double terminal(uint16_t states, const Ask &asked, char leg, double place) const
    {
        const auto index = static_cast<uint32_t>(leg - 'A');
        const pm_leg_t state = pm_leg(states, index);
        EXPECT_NE(state, PM_LEG_OFF) << leg;
        if (state == PM_LEG_HIGH) {
            return kLink;
        }
        const bool up = std::abs(place - kN) < compare_of(asked.out, leg);
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
inline void expect_on_time(const Bench &b, int64_t first, double T, double advance = 0, size_t from = 0,
                           double rounding = kRounding)
{
    for (size_t n = from; n < b.commutations.size(); ++n) {
        const double due = b.z(first + static_cast<int64_t>(n)) + (0.5 - advance) * T;
        EXPECT_NEAR(static_cast<double>(b.commutations[n]), std::max(due, b.earliest()), rounding) << n;
    }
}

// thresholds.h: leg C upwards in sector 0, downwards in 3, both at u_V further out; B shows no deviation.
constexpr double kDivider = 0.02; // 4 degrees

inline double divider_of_C(int64_t k, double y)
{
    return k % 3 == 0 ? y + (k % 2 == 0 ? kDivider : -kDivider) : y;
}

} // namespace six_step_bench

#endif
