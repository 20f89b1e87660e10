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

constexpr double kLeast = 1e-4; // of the square of the base current: 1 % is judged

// What a star lets flow when some legs do not conduct, or in one direction only.
struct Star {
    bool wire[3] = {true, true, true};
    bool into[3] = {true, true, true}, out_of[3] = {true, true, true};

    Complex flows(Complex wanted) const
    {
        double i[3];
        int open = -1, wires = 0;
        for (int x = 0; x < 3; ++x) {
            i[x] = (wanted * std::polar(1.0, -2 * kPi / 3 * x)).real();
            wires += wire[x] ? 1 : 0;
            if (!wire[x] || !(i[x] > 0 ? into[x] : out_of[x])) {
                open = x;
            }
        }
        if (wires < 2) {
            return 0;
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

struct Flow {
    double f_Hz, amplitude;
    double noise = 0, phase = 0.3;
    double share = 1, behind_deg = 0; // of what is wanted, what flows
    double lag_ms = 0, restless = 0;  // of the current; of the reference from one sample to the next
};

// Milliseconds until it is found, of `most`; 0: not
int look(const Star &star, const Flow &run, int most = 2000)
{
    open_phase_t self;
    open_phase_reset(&self);
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, run.noise), restless(0, run.restless);
    Complex follows; // what the current follows
    for (int ms = 1; ms <= most; ++ms) {
        const Complex turn = std::polar(1.0, 2 * kPi * run.f_Hz * ms * 1e-3);
        const Complex reference =
            std::polar(run.amplitude, run.phase) + Complex(restless(random), restless(random));
        follows += (reference - follows) / (1 + run.lag_ms);
        const Complex w = reference * turn;
        const Complex driven = run.share * follows * turn * std::polar(1.0, -run.behind_deg * kPi / 180);
        const Complex i = star.flows(driven) + Complex(noise(random), noise(random));
        if (open_phase_slow(&self, fixed(kLeast, 28), bench::ab(w), bench::ab(i), 0)) {
            return ms;
        }
    }
    return 0;
}

TEST(OpenPhase, AWireIsFoundWithinAQuarterOfATurn)
{
    for (int leg = 0; leg < 3; ++leg) {
        Star star;
        star.wire[leg] = false;
        for (const double f : {1.5, -3.0, 50.0, -400.0, 317.0}) {
            for (const double amplitude : {4 * std::sqrt(kLeast), 0.3, 1.5}) {
                const int ms = look(star, {f, amplitude, 0.001});
                EXPECT_GT(ms, static_cast<int>(OPEN_PHASE_MS)) << leg << ' ' << f << ' ' << amplitude;
                EXPECT_LE(ms, 100 + 250 / std::abs(f)) << leg << ' ' << f << ' ' << amplitude;
            }
        }
    }
}

// Of twice the least, what flows beside the leg is judged over a third of the time only; 333 Hz beat with 1 kHz.
TEST(OpenPhase, AWireIsFoundAtTheLeastCurrent)
{
    for (int leg = 0; leg < 3; ++leg) {
        Star star;
        star.wire[leg] = false;
        for (const double f : {1.5, -3.0, 50.0, 333.0}) {
            const int ms = look(star, {f, 2 * std::sqrt(kLeast), 0.001});
            EXPECT_GT(ms, static_cast<int>(OPEN_PHASE_MS)) << leg << ' ' << f;
            EXPECT_LE(ms, 300 + 500 / std::abs(f)) << leg << ' ' << f;
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
                const int ms = look(star, {f, 0.1, 0.001});
                EXPECT_GT(ms, 0) << leg << upper << f;
                EXPECT_LE(ms, 90 + 750 / std::abs(f)) << leg << upper << f;
            }
        }
    }
}

TEST(OpenPhase, ALegThatConductsIsNotMissed)
{
    for (const double f : {0.0, 0.1, 2.0, -30.0, 250.0, 1000.0}) {
        for (const double amplitude : {0.0, 0.003, 0.02, 1.9}) {
            for (double phase = 0; phase < 6.2; phase += 0.1) {
                EXPECT_EQ(look({}, {f, amplitude, 0.0012, phase}), 0)
                    << f << ' ' << amplitude << ' ' << phase;
            }
        }
    }
}

// At the limit of the voltage there is less than is wanted, and in another direction.
TEST(OpenPhase, CurrentThatFallsShortIsNotALegThatIsOff)
{
    for (const double f : {0.5, -5.0, 25.0, -50.0, 250.0, 1000.0}) {
        for (const double share : {0.0, 0.0625, 0.25, 0.7}) {
            Flow run = {f, 0.5, 0.001};
            run.share = share;
            run.behind_deg = std::abs(f) > 20 ? 85 : 28;
            EXPECT_EQ(look({}, run, 20000), 0) << f << ' ' << share;
        }
    }
}

// Speed control that makes noise of the position's, and current control that does not follow it.
TEST(OpenPhase, ARestlessReferenceIsNotALegThatIsOff)
{
    for (const double lag_ms : {0.0, 1.6, 5.0}) {
        for (const double amplitude : {0.0, 0.1}) {
            Flow run = {2, amplitude, 0.001};
            run.lag_ms = lag_ms;
            run.restless = 0.3;
            EXPECT_EQ(look({}, run, 100000), 0) << lag_ms << ' ' << amplitude;
        }
    }
}

// A leg that conducts as it is wanted takes four milliseconds back: one of five is enough, one of eight is not.
TEST(OpenPhase, ALegMayBeMissedInFourOfFiveMilliseconds)
{
    const pm_ab_t wanted = {fixed(0.5, 28), 0};
    const pm_ab_t beside = {0, fixed(0.5, 28)};
    for (const int of : {5, 8}) {
        open_phase_t self;
        open_phase_reset(&self);
        bool open = false;
        for (int ms = 0; ms < 1000 && !open; ++ms) {
            open = open_phase_slow(&self, fixed(kLeast, 28), wanted, ms % of == 0 ? wanted : beside, 0);
        }
        EXPECT_EQ(open, of == 8);
    }
}

// Below what is judged: without current nothing is known of a leg.
TEST(OpenPhase, NothingIsSaidOfNoCurrent)
{
    Star star;
    star.wire[0] = false;
    EXPECT_EQ(look(star, {20, 0.008}), 0);
    EXPECT_GT(look(star, {20, 0.02}), 0);
    star.wire[1] = false;
    EXPECT_EQ(look(star, {20, 0.5, 0.001}), 0);
}

// The drive: not while nothing is controlled, anew at each start, and the fault has its record.
TEST(OpenPhase, OfTheDrive)
{
    direct::Drive x(direct::params(2));
    x.start_current_mode();
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    x.d.theta_open = 0; // all of it in the first leg
    x.in.i_leg[1] = direct::current_code(0.1);
    x.in.i_leg[2] = direct::current_code(-0.1);
    x.run_ms(OPEN_PHASE_MS);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_NONE);
    x.run_ms(2);
    EXPECT_EQ(x.fault(), DRIVE_FAULT_OPEN_PHASE);
    EXPECT_FALSE(x.driven());
    EXPECT_EQ(x.d.record.fault, DRIVE_FAULT_OPEN_PHASE);
    x.enable(false);
    x.run_ms(5);
    for (const auto &leg : x.d.open_phase.missed) {
        EXPECT_EQ(leg[0], 0);
        EXPECT_EQ(leg[1], 0);
    }
}

// A carrier moves a small current by what dead time takes of the voltage: more of it is wanted before the legs are judged.
TEST(OpenPhase, ACarrierHidesALittleMore)
{
    for (const bool carrier : {false, true}) {
        direct::Drive x(direct::params(2));
        x.start_current_mode();
        const pm_dq_t i = x.d.i_ref;
        const pm_q_t amplitude = pm_hypot(i.d, i.q);
        x.d.config.protection.judged_carrier = pm_mul(2 * amplitude, 2 * amplitude);
        open_phase_reset(&x.d.open_phase);
        x.d.carrier = carrier;
        x.d.theta_open = 0; // all of it in the first leg, and what flows a quarter of a turn ahead
        x.d.status.i = {-i.q, i.d};
        for (unsigned ms = 0; ms <= OPEN_PHASE_MS + 1U; ++ms) {
            protection_phases(&x.d);
        }
        EXPECT_EQ(x.d.fault, carrier ? DRIVE_FAULT_NONE : DRIVE_FAULT_OPEN_PHASE);
    }
}

} // namespace
