// Crossings of the third harmonic: lag and noise without a plant, then in closed loop on the switching plant with 2 us of dead
// time, 12 bits and noise (METHODS-ADDENDUM.md B (d), rows 124 and 125), in electrical degrees.
#include "bldc/third_harmonic.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/bldc/rig.h"

namespace
{

using namespace bldc_rig;

constexpr double kMost = 0.5; // rows 124 and 125
constexpr double kLaw = 0.1;  // of the lag: 10 % of the formula

// Lag of a triangle's crossing behind an RC, over t_60: exact.
double triangle_lag(double x)
{
    double low = 0, high = 0.5;
    for (int n = 0; n < 60; ++n) {
        const double d = (low + high) / 2;
        (d < x * (1 - std::exp(-d / x) / std::cosh(0.5 / x)) ? low : high) = d;
    }
    return low;
}

TEST(ThirdHarmonic, LagIsThatOfTheFilter)
{
    for (const bool trapezoid : {false, true}) {
        for (double x = 0.01; x < 20; x *= 1.3) { // RC over t_60
            constexpr uint32_t t_60 = 100000;
            const third_harmonic_config_t config = {static_cast<int32_t>(kPi * x * t_60), trapezoid, false};
            third_harmonic_t self = {};
            third_harmonic_slow(&self, &config, t_60, PM_ONE);
            const double exact = trapezoid ? triangle_lag(x) : std::atan(kPi * x) / kPi;
            EXPECT_NEAR(60.0 * self.lag / t_60, 60 * exact, trapezoid ? 0.05 : 0.002) << x;
            EXPECT_NEAR(real(self.seen), std::cos(std::atan(kPi * x)) / 8, 1e-4) << x;
        }
    }
}

TEST(ThirdHarmonic, InterpolatesAndCountsNoiseAboutZeroOnce)
{
    for (const bool negative : {false, true}) {
        const third_harmonic_config_t config = {0, false, negative};
        third_harmonic_t self = {};
        third_harmonic_slow(&self, &config, 100000, PM_ONE);
        third_harmonic_open(&self, 0);
        const pm_q_t way = negative ? -1 : 1;
        EXPECT_FALSE(third_harmonic_step(&self, &config, way * -PM_Q(0.3), 1000, true));
        EXPECT_TRUE(third_harmonic_step(&self, &config, way * PM_Q(0.1), 5000, true));
        EXPECT_NEAR(self.crossing, 4000, 1);
        // Towards the next one, downwards: not until it was seen above zero by an eighth.
        EXPECT_FALSE(third_harmonic_step(&self, &config, way * -PM_Q(0.01), 6000, false));
        EXPECT_FALSE(third_harmonic_step(&self, &config, way * PM_Q(0.12), 7000, false));
        EXPECT_FALSE(third_harmonic_step(&self, &config, way * -PM_Q(0.01), 8000, false));
        EXPECT_FALSE(third_harmonic_step(&self, &config, way * PM_Q(0.13), 9000, false));
        EXPECT_TRUE(third_harmonic_step(&self, &config, way * -PM_Q(0.13), 11000, false));
        EXPECT_NEAR(self.crossing, 10000, 1);
    }
}

Machine with_star(Machine m, double filter_s, double full_scale_V, unsigned seed = 1)
{
    m.plant.sensor.v_zero_full_scale_V = full_scale_V;
    m.plant.sensor.v_zero_filter_s = filter_s;
    m.plant.sensor.v_zero_noise_lsb = 0.5;
    m.plant.sensor.seed = seed;
    return m;
}

// A tenth of third harmonic in the flux of the sine.
Machine hs_third(double filter_s, double share = 0.1, unsigned seed = 1)
{
    Machine m = with_star(hs(), filter_s, 10, seed);
    m.plant.winding.emf[0] = {3, share * m.plant.machine.psi_m_Wb, 0};
    return m;
}

Options third(bool reverse, bool told = true)
{
    Options o;
    o.third = true;
    o.reverse = reverse;
    o.told_filter = told;
    return o;
}

void expect_locked(const Rig &r)
{
    EXPECT_FALSE(r.six_step.lost);
    ASSERT_GT(r.commutations.n, 50);
    EXPECT_LE(r.commutations.most, kMost);
}

// Row 124: a duty of 1, where the leg that has gone freewheels beyond the crossing and a terminal shows nothing of it.
TEST(ThirdHarmonic, CommutatesWithoutPulsesThroughTheFreewheeling)
{
    for (const bool reverse : {false, true}) {
        for (const double share : {0.1, -0.1}) {
            for (const double rpm : {40e3, 60e3, 80e3}) {
                const Machine m = hs_third(0, share);
                Rig r(m, third(reverse), electrical(m, rpm));
                r.measure(60, 40, 1);
                SCOPED_TRACE(rpm);
                expect_locked(r);
            }
        }
    }
}

// Twin: the open terminal, looked at as it is: the rail of the freewheeling is past the crossing.
TEST(ThirdHarmonic, TwinTerminalWithoutBlankingFailsThere)
{
    const Machine m = hs_third(0);
    Rig r(m, {}, electrical(m, 40e3));
    r.config.crossing.blank = 0;
    r.config.crossing.rail = fixed(-2 / kBase_V, PM_Q_BITS);
    r.measure(60, 40, 1);
    EXPECT_TRUE(r.six_step.lost || r.commutations.most > 5);
}

struct Filter {
    double corner_Hz, rpm;
};

// Row 125: 500 Hz to 2 kHz, 10 to 100 % of speed, both directions, three seeds.
TEST(ThirdHarmonic, LagOfTheLowPassIsTakenOff)
{
    for (const unsigned seed : {1U, 2U, 3U}) {
        for (const bool reverse : {false, true}) {
            for (const Filter f :
                 {Filter{500, 300}, {500, 1500}, {500, 3000}, {1000, 300}, {1000, 3000}, {2000, 3000}}) {
                const Machine m = with_star(fan(), 0.5 / kPi / f.corner_Hz, 5, seed);
                const double omega = electrical(m, f.rpm);
                Rig r(m, third(reverse), omega);
                r.measure(20, 20, std::min(0.95, duty(m, omega, 3) + 0.08));
                EXPECT_FALSE(r.six_step.lost);
                EXPECT_LE(std::abs(r.commutations.mean()), kMost) << f.corner_Hz << " Hz, " << f.rpm;
                EXPECT_LE(r.commutations.rms(), kMost) << f.corner_Hz << " Hz, " << f.rpm;
                EXPECT_LE(r.commutations.most, 2 * kMost) << f.corner_Hz << " Hz, " << f.rpm;
            }
        }
    }
}

// Twin: what the filter delays is what the commutation is late by, atan(3 omega / omega_c) / 3.
TEST(ThirdHarmonic, TwinNotToldTheFilterIsLateByItsLaw)
{
    for (const bool reverse : {false, true}) {
        for (const Filter f : {Filter{500, 1500}, {1000, 1500}, {1000, 3000}, {2000, 3000}}) {
            const Machine m = with_star(fan(), 0.5 / kPi / f.corner_Hz, 5);
            const double omega = electrical(m, f.rpm);
            Rig r(m, third(reverse, false), omega);
            r.measure(20, 20, std::min(0.95, duty(m, omega, 3) + 0.08));
            const double law = std::atan(3 * omega / (2 * kPi * f.corner_Hz)) / 3 / kDegree;
            EXPECT_FALSE(r.six_step.lost);
            EXPECT_NEAR(r.commutations.mean(), law, kLaw * law) << f.corner_Hz << " Hz, " << f.rpm;
        }
    }
}

// A rotor that stops has no third harmonic: all legs off.
TEST(ThirdHarmonic, ARotorThatStopsIsLost)
{
    const Machine m = with_star(fan(), 160e-6, 5);
    Rig r(m, third(false), electrical(m, 1500));
    r.run_for(50e-3, 0.55);
    EXPECT_FALSE(r.six_step.lost);
    r.impose(1);
    r.run_for(50e-3, 0.05);
    EXPECT_TRUE(r.six_step.lost);
}

// However slow the rotor, zero is not ahead.
TEST(ThirdHarmonic, ZeroIsNeverAheadOfACrossing)
{
    const third_harmonic_config_t config = {1000000, false, false};
    third_harmonic_t self = {};
    third_harmonic_slow(&self, &config, 100, 1);
    EXPECT_GT(self.seen, 0);
    third_harmonic_open(&self, 0);
    EXPECT_FALSE(third_harmonic_step(&self, &config, 0, 100, true));
    EXPECT_FALSE(third_harmonic_step(&self, &config, PM_Q(0.1), 200, true));
    EXPECT_FALSE(self.ahead);
}

// A sample ahead of the crossing before it was opened is none of this crossing.
TEST(ThirdHarmonic, OpeningForgetsTheSampleAhead)
{
    const third_harmonic_config_t config = {0, false, false};
    third_harmonic_t self = {};
    third_harmonic_slow(&self, &config, 100000, PM_ONE);
    EXPECT_FALSE(third_harmonic_step(&self, &config, -PM_Q(0.3), 1000, true));
    third_harmonic_open(&self, 2000);
    EXPECT_FALSE(third_harmonic_step(&self, &config, PM_Q(0.3), 3000, true));
}

TEST(ThirdHarmonic, TheLagIsTakenOffTheInstant)
{
    const third_harmonic_config_t config = {100000, false, false}; // u = 1/2
    third_harmonic_t self = {};
    third_harmonic_slow(&self, &config, 100000, PM_ONE);
    EXPECT_NEAR(self.lag, 25000, 2);
    third_harmonic_open(&self, 0);
    EXPECT_FALSE(third_harmonic_step(&self, &config, -PM_Q(0.3), 100000, true));
    EXPECT_TRUE(third_harmonic_step(&self, &config, PM_Q(0.1), 104000, true));
    EXPECT_NEAR(self.crossing, 103000 - 25000, 3);
}

} // namespace
