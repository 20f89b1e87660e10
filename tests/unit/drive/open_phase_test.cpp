// Currents that are wanted and that flow, without a drive: which legs conduct is what a test says.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "firmware/drive/open_phase.h"
#include "tests/contract/bench.h"
#include "tests/unit/drive/direct.h"

namespace
{

using bench::Complex;
using bench::fixed;
using bench::kPi;

constexpr double kLeast = 1e-4; // of the square of the base current

// What a star lets flow when some legs do not conduct, or in one direction only.
struct Star {
    bool wire[3] = {true, true, true};
    bool into[3] = {true, true, true}, out_of[3] = {true, true, true};

    Complex flows(Complex wanted) const
    {
        double i[3];
        int open = -1;
        for (int x = 0; x < 3; ++x) {
            i[x] = (wanted * std::polar(1.0, -2 * kPi / 3 * x)).real();
            if (!wire[x] || !(i[x] > 0 ? into[x] : out_of[x])) {
                open = x;
            }
        }
        if (open >= 0) { // the other two share what is left
            const int p = (open + 1) % 3, q = (open + 2) % 3;
            i[p] = (i[p] - i[q]) / 2;
            i[q] = -i[p];
            i[open] = 0;
        }
        return {i[0], (i[1] - i[2]) / std::sqrt(3.0)};
    }
};

struct Run {
    double f_Hz, amplitude;
    double noise = 0, lag_ms = 0, phase = 0.3;
};

// Milliseconds until it is found, of `most`; 0: not
int look(const Star &star, const Run &run, int most = 2000)
{
    open_phase_t self;
    open_phase_reset(&self);
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, run.noise);
    for (int ms = 1; ms <= most; ++ms) {
        const auto wanted = [&](double at_ms) {
            return std::polar(run.amplitude, run.phase + 2 * kPi * run.f_Hz * at_ms * 1e-3);
        };
        const Complex i = star.flows(wanted(ms - run.lag_ms)) + Complex(noise(random), noise(random));
        const Complex w = wanted(ms);
        if (open_phase_slow(&self, fixed(kLeast, 28), {fixed(w.real(), 28), fixed(w.imag(), 28)},
                            {fixed(i.real(), 28), fixed(i.imag(), 28)})) {
            return ms;
        }
    }
    return 0;
}

TEST(OpenPhase, AWireIsFoundWithinATenthOfASecond)
{
    for (int leg = 0; leg < 3; ++leg) {
        Star star;
        star.wire[leg] = false;
        for (const double f : {3.0, -3.0, 50.0, -400.0, 333.0}) {
            for (const double amplitude : {0.02, 0.3, 1.5}) {
                const int ms = look(star, {f, amplitude, 0.005});
                EXPECT_GT(ms, static_cast<int>(OPEN_PHASE_MS)) << leg << ' ' << f << ' ' << amplitude;
                EXPECT_LE(ms, 100) << leg << ' ' << f << ' ' << amplitude;
            }
        }
    }
}

TEST(OpenPhase, ASwitchIsFoundWithinHalfATurnMore)
{
    for (int leg = 0; leg < 3; ++leg) {
        for (const bool upper : {true, false}) {
            Star star;
            (upper ? star.into : star.out_of)[leg] = false;
            for (const double f : {2.0, -2.0, 20.0, 100.0}) {
                const int ms = look(star, {f, 0.1, 0.005});
                EXPECT_GT(ms, 0) << leg << upper << f;
                EXPECT_LE(ms, 60 + 500 / std::abs(f)) << leg << upper << f;
            }
        }
    }
}

TEST(OpenPhase, ALegThatConductsIsNotMissed)
{
    for (const double f : {0.0, 0.1, 2.0, -30.0, 250.0, 1000.0}) {
        for (const double amplitude : {0.0, 0.003, 0.02, 1.9}) {
            for (const double phase : {0.0, 0.5, 2.0, 4.0}) {
                EXPECT_EQ(look({}, {f, amplitude, 0.01, 0, phase}), 0) << f << ' ' << amplitude;
            }
        }
    }
    EXPECT_EQ(look({}, {50, 0.5, 0.01, 1.6}), 0); // 30 degrees behind
}

// Below what is judged: without current nothing is known of a leg.
TEST(OpenPhase, NothingIsSaidOfNoCurrent)
{
    Star star;
    star.wire[0] = false;
    EXPECT_EQ(look(star, {20, 0.01}), 0);
    EXPECT_GT(look(star, {20, 0.03}), 0);
}

// The drive: not while nothing is controlled, anew at each start, and the fault has its record.
TEST(OpenPhase, OfTheDrive)
{
    direct::Drive x(direct::params(2));
    x.d.config.protection.missed_least = fixed(kLeast, 28);
    x.start_current_mode(); // without a motor no current flows
    EXPECT_EQ(x.fault(), DRIVE_FAULT_OPEN_PHASE);
    EXPECT_FALSE(x.driven());
    EXPECT_EQ(x.d.record.fault, DRIVE_FAULT_OPEN_PHASE);
    x.enable(false);
    x.run_ms(5);
    EXPECT_EQ(x.d.open_phase.ms, 0);
    for (const auto &leg : x.d.open_phase.missed) {
        EXPECT_EQ(leg[0], 0);
        EXPECT_EQ(leg[1], 0);
    }
}

} // namespace
