// third_missing.h: a rotor that turns, with and without its third harmonic, and one that is held, by the EMFs of METHODS.md 0.2.
#include "bldc/third_missing.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace
{

int32_t per_unit(double x)
{
    return static_cast<int32_t>(std::lround(x * PM_ONE));
}

// Per-unit: a link of one half, a machine whose third harmonic is a tenth of its magnets' flux linkage.
constexpr double kLink = 0.5, kPsi = 0.01, kPsi3 = 0.001, kStep = 0.0002;
constexpr third_missing_config_t kConfig = {PM_Q(2 * kPsi3 / kPsi), PM_Q(0.0008), PM_Q(0.01)};

struct Start {
    double speed = 3; // at the end of a sector that it enters at rest, per-unit
    double third = 1; // of what is told
    double divider = 0, drop = 0;
    zero_legs_t legs = ZERO_LEGS_APART;
    third_missing_t seen = {};
    std::mt19937 noise{1};

    // A sector from 30 degrees ahead of its crossing, in a thousand samples.
    void run()
    {
        std::normal_distribution<double> lsb(0, kStep / 2);
        for (int k = 0; k < 1000; ++k) {
            const double omega = speed * k / 1000, x = M_PI / 3 * (k * k / 1e6 - 0.5);
            const double open = 1.5 * omega * kPsi * std::sin(x) - drop * k / 1000;
            zero_sample_t sample = {};
            sample.v_dc = PM_Q(kLink);
            sample.v[1] =
                per_unit((static_cast<double>(legs) * kLink / 2 + open) * (1 + divider) + lsb(noise));
            const double zero = third * 3 * omega * kPsi3 * std::sin(3 * x) + 0.003;
            const third_missing_in_t in = {&sample, per_unit(zero + lsb(noise)), 2, 1, legs};
            third_missing_step(&seen, &kConfig, &in);
        }
    }
};

TEST(ThirdMissing, ARotorThatTurnsAndShowsNone)
{
    for (const zero_legs_t legs : {ZERO_LEGS_APART, ZERO_LEGS_HIGH}) {
        for (const double third : {0.0, 0.3}) {
            Start none;
            none.third = third;
            none.legs = legs;
            none.run();
            EXPECT_TRUE(none.seen.missing) << legs << ' ' << third;
        }
        for (const double third : {0.75, 1.0, -1.0}) {
            Start there;
            there.third = third;
            there.legs = legs;
            there.run();
            EXPECT_FALSE(there.seen.missing) << legs << ' ' << third;
        }
    }
}

// Neither shows anything: dividers 2 % off, a current that rises.
TEST(ThirdMissing, ARotorThatIsHeldIsNone)
{
    for (const zero_legs_t legs : {ZERO_LEGS_APART, ZERO_LEGS_HIGH}) {
        for (const double divider : {0.0, 0.02, -0.02}) {
            Start held;
            held.speed = 0;
            held.divider = divider;
            held.drop = 0.003;
            held.legs = legs;
            held.run();
            EXPECT_FALSE(held.seen.missing) << legs << ' ' << divider;
        }
    }
}

// A diode holds the open terminal at a rail; behind it the samples begin anew, and so they do in the next sector.
TEST(ThirdMissing, FreewheelingAndAnotherSectorBeginAnew)
{
    third_missing_t seen = {};
    for (int k = 0; k < 200; ++k) {
        const bool freewheels = k % 20 < 10;
        zero_sample_t sample = {};
        sample.v_dc = PM_Q(kLink);
        const bool other = k >= 100;
        sample.v[1] = freewheels ? PM_Q(kLink) : PM_Q(kLink / 2) + (other ? PM_Q(0.01) : 0);
        const third_missing_in_t in = {&sample, 0, uint8_t(other ? 3 : 2), 1, ZERO_LEGS_APART};
        third_missing_step(&seen, &kConfig, &in);
        EXPECT_FALSE(seen.missing) << k;
        EXPECT_EQ(seen.samples != 0, !freewheels) << k;
    }
}

struct Stepper {
    third_missing_t seen = {};
    // The terminal and v_zero relative to what they are at rest.
    void operator()(double open, double zero = 0, uint8_t sector = 2, zero_legs_t legs = ZERO_LEGS_APART,
                    double link = kLink)
    {
        zero_sample_t sample = {};
        sample.v_dc = PM_Q(link);
        sample.v[1] = per_unit(static_cast<double>(legs) * link / 2 + open);
        const third_missing_in_t in = {&sample, per_unit(zero), sector, 1, legs};
        third_missing_step(&seen, &kConfig, &in);
    }
    void settle(double open, uint8_t sector = 2, zero_legs_t legs = ZERO_LEGS_APART)
    {
        for (int k = 0; k < 10; ++k) {
            (*this)(open, 0, sector, legs);
        }
    }
};

constexpr double kSeen = 0.0008 / (2 * kPsi3 / kPsi); // of the terminal's mean: what is asked for is `least`

// Means of eight: the first sample of a step is an eighth of it.
TEST(ThirdMissing, SwingsAreThoseOfAMeanOfEight)
{
    for (const int way : {1, -1}) {
        for (const double of_least : {0.9, 1.1}) {
            Stepper s;
            s.settle(0.05);
            s(0.05 + way * 8 * of_least * kSeen);
            EXPECT_EQ(s.seen.missing, of_least > 1) << way;
        }
    }
}

// A terminal that only rises, or falls, swings too; so does v_zero.
TEST(ThirdMissing, ASwingHasTwoEnds)
{
    for (const int way : {1, -1}) {
        for (const bool there : {true, false}) {
            Stepper s;
            s.settle(-0.05 * way);
            for (int k = 0; k < 60; ++k) {
                const double x = way * 0.002 * k;
                s(-0.05 * way + x, there ? 0.25 * x : 0); // more than the fifth that is asked for
            }
            EXPECT_EQ(s.seen.missing, !there) << way;
        }
    }
}

// A rotor that is held, its terminal in the middle of a link that sags: no swing of its EMF.
TEST(ThirdMissing, ALinkThatMovesIsNoSwing)
{
    for (const zero_legs_t legs : {ZERO_LEGS_APART, ZERO_LEGS_HIGH}) {
        Stepper s;
        for (int k = 0; k < 60; ++k) {
            s(-0.03, 0, 2, legs, kLink - 0.002 * k);
        }
        EXPECT_FALSE(s.seen.missing) << legs;
    }
}

// What rings behind the freewheeling, in each place anew: the terminal is at rest from the fifth sample on.
TEST(ThirdMissing, RingingIsNoSwing)
{
    Stepper s;
    for (int n = 0; n < 5; ++n) {
        s(n % 2 == 0 ? kLink / 2 : -kLink / 2); // at a rail
        for (const double ring : {0.2, -0.15, 0.1, 0.05}) {
            s(ring);
        }
        s.settle(0.05);
        EXPECT_FALSE(s.seen.missing) << n;
    }
}

// Each pair of places that follow one another: what is seen in one is no swing of the other.
TEST(ThirdMissing, EverySectorAndInstantHasItsPlace)
{
    for (uint8_t sector = 0; sector < 6; ++sector) {
        for (const int next : {1, 0}) {
            for (const zero_legs_t from : {ZERO_LEGS_LOW, ZERO_LEGS_APART, ZERO_LEGS_HIGH}) {
                for (const zero_legs_t to : {ZERO_LEGS_LOW, ZERO_LEGS_APART, ZERO_LEGS_HIGH}) {
                    if (next == 0 && from == to) {
                        continue;
                    }
                    const auto level = [](zero_legs_t legs, double x) {
                        return legs == ZERO_LEGS_HIGH ? -x : x;
                    };
                    Stepper s;
                    s.settle(level(from, 0.05), sector, from);
                    s.settle(level(to, 0.15), static_cast<uint8_t>((sector + next) % 6), to);
                    EXPECT_FALSE(s.seen.missing) << int(sector) << from << to;
                }
            }
        }
    }
}

} // namespace
