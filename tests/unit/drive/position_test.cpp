#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/observers/flux_bench.h"

namespace
{

using bench::Complex;
using bench::fixed;
using bench::kDegree;
using bench::real;
using bench::Rotation;

// The weight follows a speed filtered over 5 ms; 100 calls later nothing of that is left.
constexpr int kSettle = 100;
constexpr double kWeight = 1e-4; // the span is Q20
// With an exact machine at constant speed (active_flux_test.cpp: 0.2).
constexpr double kIdeal_deg = 0.3;
// Lost is lost: an observer that is told nonsense must not be believed for longer than this (t_lost adds 30
// ms).
constexpr int kLost_ms = 60;

constexpr double kLow = 0.12, kHigh = 0.24;

// Where the voltage acts does not matter here.
constexpr pm_dir_t kNoTurn = {PM_UNIT_MAX, 0};
constexpr pm_pll_t kAtRest = {0, 0};
constexpr pm_ab_t kNoVoltage = {0, 0};
constexpr position_in_t kStill = {&kNoVoltage, {0, 0}, &kNoTurn, nullptr};

pm_pll_config_t loop(double hertz)
{
    const double w = 2 * bench::kPi * hertz, t = bench::kIpmBase.period_s, base = bench::kIpmBase.omega_rad_s;
    return {fixed(1.8 * w * t * 2 / bench::kPi, 32), fixed(w * w * t / base, 32),
            fixed(16 * base * t / (2 * bench::kPi), 30)};
}

position_config_t config(bool injection = true)
{
    const double L_d = 43e-3, L_q = 75e-3, flux = 70 * bench::kIpmBase.period_s, i = bench::kIpmBase.i_A;
    position_config_t c = {};
    c.observer.id = OBSERVER_active_flux;
    c.observer.active_flux = bench::flux_config(bench::kIpmLinear, bench::kIpmBase);
    c.injection.pulsating_square.v_h = fixed(70 / 450.0, 28);
    c.injection.pulsating_square.saliency.gain_0 = fixed(i * L_d * L_q / (flux * (L_q - L_d)), 20);
    c.injection.pulsating_square.half_step =
        fixed(bench::kIpmBase.period_s * bench::kIpmBase.omega_rad_s / 2, 32);
    c.injection.pulsating_square.h_d = fixed(flux / L_d / i, 28);
    c.injection.pulsating_square.h_d_inverse = fixed(i * L_d / flux, 20);
    c.pll_low = loop(20);
    c.pll_high = loop(40);
    c.omega_low = fixed(kLow, 28);
    c.omega_high = fixed(kHigh, 28);
    c.per_span = fixed(1 / (kHigh - kLow), 20);
    c.injects = injection;
    c.current_low = PM_UNIT_MAX;
    c.tied_share = PM_UNIT_MAX;
    return c;
}

position_t started(const position_config_t &c)
{
    position_t self;
    position_reset(&self, &c, &kAtRest, {0, 0}, true);
    return self;
}

void hold(position_t &self, const position_config_t &c, double omega, int calls = kSettle)
{
    for (int k = 0; k < calls; ++k) {
        self.pll.omega = fixed(omega, 28);
        position_slow(&self, &c, {0, 0}, {0, 0});
    }
}

TEST(Position, WeightIsTheSpeedBetweenItsLimits)
{
    const position_config_t c = config();
    for (double omega = -0.4; omega <= 0.4; omega += 0.02) {
        position_t self = started(c);
        hold(self, c, omega);
        const double expected = std::clamp((std::abs(omega) - kLow) / (kHigh - kLow), 0.0, 1.0);
        EXPECT_NEAR(real(self.weight), expected, kWeight) << omega;
        EXPECT_GE(self.weight, 0);
        EXPECT_LE(self.weight, PM_ONE);
        EXPECT_NEAR(self.gains.kp_turn,
                    c.pll_low.kp_turn + expected * (c.pll_high.kp_turn - c.pll_low.kp_turn),
                    1e-3 * c.pll_high.kp_turn);
        EXPECT_NEAR(self.gains.ki, c.pll_low.ki + expected * (c.pll_high.ki - c.pll_low.ki),
                    1e-3 * c.pll_high.ki);
    }
}

TEST(Position, CarrierHasHysteresis)
{
    const position_config_t c = config();
    position_t self = started(c);
    EXPECT_TRUE(self.inject);
    hold(self, c, 1.05 * kHigh); // above, but not by enough
    EXPECT_TRUE(self.inject);
    hold(self, c, 1.2 * kHigh);
    EXPECT_FALSE(self.inject);
    hold(self, c, 1.05 * kHigh); // and not back at once
    EXPECT_FALSE(self.inject);
    hold(self, c, -0.95 * kHigh); // either direction
    EXPECT_TRUE(self.inject);
    hold(self, c, -1.2 * kHigh);
    EXPECT_FALSE(self.inject);
}

// What is controlled is the current that the source separates, with its delay: as long as there is a carrier.
TEST(Position, CurrentControlIsSlowedWhileThereIsACarrier)
{
    position_config_t c = config();
    c.current_low = PM_UNIT_MAX / 9;
    position_t self = started(c);
    for (const double omega : {0.0, (kLow + kHigh) / 2, 1.05 * kHigh}) {
        hold(self, c, omega);
        EXPECT_EQ(position_current_share(&self, &c), c.current_low) << omega;
    }
    hold(self, c, 1.2 * kHigh);
    EXPECT_EQ(position_current_share(&self, &c), PM_UNIT_MAX);
    hold(self, c, 0.95 * kHigh);
    EXPECT_EQ(position_current_share(&self, &c), c.current_low);
}

TEST(Position, WithoutInjectionTheFluxLeadsAlways)
{
    const position_config_t c = config(false);
    position_t self = started(c);
    for (const double omega : {0.0, 0.05, 0.5, 0.0}) {
        hold(self, c, omega);
        EXPECT_FALSE(self.inject);
        EXPECT_EQ(self.weight, PM_ONE);
    }
}

// A third harmonic is believed from speed_low on: below, an offset of its channel may be larger. Row 132.
TEST(Position, WhatLooksLikeAThirdHarmonicBelowSpeedLowIsNone)
{
    position_config_t c = config();
    c.traits_high = SOURCE_THIRD_TURN;
    position_t self = started(c);
    self.shown = PM_ONE;
    hold(self, c, kLow / 2, 1);
    EXPECT_EQ(self.shown, 0);
    hold(self, c, kLow / 2);
    EXPECT_EQ(self.absent_ms, 0);
    self.omega_mean = fixed(kHigh, 28);
    for (int ms = 1; ms < 300; ++ms) {
        self.shown = 0;
        hold(self, c, kHigh, 1);
        ASSERT_EQ(self.weight, 0);
        ASSERT_EQ(self.absent_ms, ms) << "which is a fault from POSITION_ABSENT_MS on";
    }
    self.shown = PM_Q(0.6);
    hold(self, c, kHigh, 1);
    EXPECT_GT(self.weight, 0);
    EXPECT_EQ(self.absent_ms, 0);
}

// What shows it lies along d, and no sample counts more than twice of what was told.
TEST(Position, WhatAThirdHarmonicShowsIsItsPartAlongD)
{
    const struct {
        pm_dq_t z;
        double shown;
    } cases[] = {{{THIRD_Z_ONE / 2, 0}, 0.5}, {{0, THIRD_Z_ONE / 2}, 0}, {{3 * THIRD_Z_ONE, 0}, 2}};
    for (const auto &at : cases) {
        position_config_t c = config();
        c.traits_high = SOURCE_THIRD_TURN;
        c.observer.id = OBSERVER_third_sogi;
        c.observer.third_sogi = {};
        position_t self = started(c);
        for (int ms = 0; ms < 20 * kSettle; ++ms) {
            self.observer.third_sogi.third.last = at.z;
            self.weight = 0;
            hold(self, c, 1.5 * kLow, 1);
        }
        EXPECT_NEAR(real(self.shown), at.shown, 0.01);
    }
}

// One that leads keeps the lead: what it no longer shows is for the quality.
TEST(Position, AThirdHarmonicThatLeadsIsNotHeldBack)
{
    position_config_t c = config();
    c.traits_high = SOURCE_THIRD_TURN;
    for (const double omega : {(kLow + kHigh) / 2, 1.2 * kHigh}) {
        position_t self = started(c);
        for (int ms = 0; ms < kSettle; ++ms) {
            self.shown = self.weight == 0 ? PM_ONE : 0;
            hold(self, c, omega, 1);
        }
        EXPECT_NEAR(real(self.weight), std::min((omega - kLow) / (kHigh - kLow), 1.0), kWeight) << omega;
        EXPECT_EQ(self.absent_ms, 0);
        EXPECT_EQ(self.inject, omega < kHigh);
    }
    position_t alone = started(c); // without a carrier there is none that could lead
    alone.inject = false;
    alone.omega_mean = fixed(1.2 * kHigh, 28);
    hold(alone, c, 1.2 * kHigh, 1);
    EXPECT_EQ(alone.weight, PM_ONE);
    EXPECT_EQ(alone.absent_ms, 0);
}

// At a reversal a filter holds what it saw of the speed before: below speed_low it says nothing of the position while another source
// leads. Row 129.
TEST(Position, WhatAThirdHarmonicErrsByBelowSpeedLowCostsNoQuality)
{
    const struct {
        uint8_t traits;
        double omega;
        bool counts;
    } cases[] = {{SOURCE_THIRD_TURN, kLow / 2, false},
                 {SOURCE_THIRD_TURN, -kLow / 2, false},
                 {SOURCE_THIRD_TURN, 1.5 * kLow, true},
                 {0, kLow / 2, true}};
    for (const auto &at : cases) {
        position_config_t c = config();
        c.traits_high = at.traits;
        c.observer.id = OBSERVER_third_sogi;
        c.observer.third_sogi = {};
        position_t self = started(c);
        for (int ms = 0; ms < kSettle; ++ms) {
            self.observer.third_sogi.third.last = {0, THIRD_Z_ONE / 2};
            hold(self, c, at.omega, 1);
        }
        EXPECT_EQ(self.weight, 0);
        EXPECT_EQ(self.quality < PM_ONE, at.counts) << at.omega;
    }
}

// A quarter of what was told, from speed_low on, either direction; of the third harmonic alone.
TEST(Position, AThirdHarmonicBelowAQuarterIsLacking)
{
    const struct {
        bool third;
        double shown, omega;
        bool lacks;
    } cases[] = {{true, 0.24, kLow, true},
                 {true, 0.24, -kHigh, true},
                 {false, 0.24, kHigh, false},
                 {true, 0.26, kHigh, false},
                 {true, 0.24, 0.99 * kLow, false}};
    for (const auto &at : cases) {
        position_config_t c = config();
        c.traits_high = at.third ? SOURCE_THIRD_TURN : 0;
        position_t self = started(c);
        self.square = fixed(at.shown * at.shown, 28);
        self.omega_mean = fixed(at.omega, 28);
        EXPECT_EQ(position_lacks_third(&self, &c), at.lacks) << at.shown << ' ' << at.omega;
    }
}

// The EMF of a rotor a third of a turn ahead. Where the observer alone leads, and by the third harmonic, the right third was known:
// one slip is one too many. A low-speed source may slip three times.
TEST(Position, ASlipOfAnObserverOfTheThirdHarmonicIsTheLast)
{
    const pm_machine_t machine = {0, fixed(0.28, 28), fixed(0.5, 28), fixed(0.9, 28)};
    const bench::Complex e = bench::kJ * kHigh * 0.28 * std::polar(1.0, 2 * bench::kPi / 3);
    const struct {
        uint8_t low, high;
        pm_q_t weight;
        bool turns;
        unsigned count;
    } cases[] = {{0, SOURCE_THIRD_TURN, PM_ONE, true, SLIP_MOST + 1U},
                 {0, SOURCE_THIRD_TURN, PM_ONE - 1, false, 0},
                 {SOURCE_THIRD_TURN, 0, PM_ONE, true, 1},
                 {SOURCE_THIRD_TURN, SOURCE_THIRD_TURN, 0, true, 1},
                 {0, 0, PM_ONE, false, 0}};
    for (const auto &at : cases) {
        position_config_t c = config();
        c.traits = at.low;
        c.traits_high = at.high;
        position_t self = started(c);
        self.weight = at.weight;
        self.pll = {PM_TURN(0.3), fixed(kHigh, 28)};
        pm_angle_t turn = 0;
        for (int ms = 0; ms < 2 * int(SLIP_MS) && turn == 0U; ++ms) {
            turn = position_resolve_slip(&self, &c, &machine, bench::dq(e), {0, 0}, {0, 0});
        }
        EXPECT_EQ(turn, at.turns ? PM_TURN(1.0 / 3) : 0U);
        EXPECT_EQ(self.pll.theta, PM_TURN(0.3) + turn);
        EXPECT_EQ(self.slip.count, at.count);
    }
}

// Also one that had another weight before.
TEST(Position, WithoutACarrierTheWeightIsOne)
{
    const position_config_t c = config(false);
    position_t self = started(c);
    self.weight = PM_Q(0.3);
    hold(self, c, 0.01, 1);
    EXPECT_EQ(self.weight, PM_ONE);
    EXPECT_NEAR(self.gains.kp_turn, c.pll_high.kp_turn, 16); // a product in Q28
    EXPECT_NEAR(self.gains.ki, c.pll_high.ki, 16);
}

TEST(Position, ResetStartsAtTheGivenAngle)
{
    const position_config_t c = config();
    position_t self;
    const pm_pll_t rests = {PM_TURN(0.3), 0};
    position_reset(&self, &c, &rests, {0, 0}, true);
    EXPECT_EQ(self.pll.theta, PM_TURN(0.3));
    EXPECT_EQ(self.pll.omega, 0);
    EXPECT_EQ(self.weight, 0);
    EXPECT_EQ(self.quality, PM_ONE);
    EXPECT_TRUE(self.inject);
    position_reset(&self, &c, &rests, {0, 0}, false);
    EXPECT_FALSE(self.inject);
    EXPECT_FALSE(self.carrier);
}

TEST(Position, ResetAtSpeedInjectsLaterIfAtAll)
{
    const position_config_t c = config();
    position_t self;
    const pm_pll_t turns = {PM_TURN(0.3), -c.omega_high - 1};
    for (const bool carrier : {true, false}) {
        position_reset(&self, &c, &turns, {0, 0}, carrier);
        EXPECT_EQ(self.pll.omega, turns.omega);
        EXPECT_EQ(self.omega_mean, turns.omega);
        EXPECT_EQ(self.weight, PM_ONE);
        EXPECT_EQ(self.gains.ki, c.pll_high.ki);
        EXPECT_FALSE(self.inject);
        EXPECT_EQ(self.carrier, carrier);
    }
}

// A machine at a speed where the flux leads.
class Running
{
  public:
    explicit Running(double omega) : rotation(bench::kIpmLinear, bench::kIpmBase, omega, {0, 3})
    {
        position_reset(&self, &c_, &kAtRest, {0, 0}, true);
        self.pll.omega = fixed(omega, 28);
        self.omega_mean = self.pll.omega;
        self.inject = false;
        self.weight = PM_ONE;
        self.gains = c_.pll_high;
        const obs_in_t in = rotation.seen(0, rotation.omega_rad_s);
        observer_reset(&self.observer, &c_.observer, &in);
    }

    void run_ms(int ms, const pm_pll_t *imposed = nullptr)
    {
        for (int k = 0; k < 10 * ms; ++k) {
            rotation.advance();
            const obs_in_t in = rotation.seen(rotation.theta_rad, rotation.omega_rad_s);
            if (imposed != nullptr && k % 10 == 0) {
                position_force(&self, &c_, imposed);
            }
            const position_in_t at = {&in.v, in.i, &kNoTurn, nullptr};
            position_step(&self, &c_, &at, &out);
            if (k % 10 == 9) {
                position_slow(&self, &c_, in.i, out.i);
            }
        }
    }

    double error_deg() const
    {
        return bench::wrapped(rotation.theta_rad - bench::rad(self.pll.theta)) / kDegree;
    }

    Rotation rotation;
    position_t self = {};
    position_out_t out = {};

  private:
    position_config_t c_ = config();
};

TEST(Position, FollowsTheMachine)
{
    for (const double omega : {0.4, -0.4, 1.0}) {
        Running r(omega);
        r.run_ms(1000);
        EXPECT_NEAR(r.error_deg(), 0, kIdeal_deg) << omega;
        EXPECT_NEAR(real(r.self.pll.omega), omega, 1e-3) << omega;
        EXPECT_GT(real(r.self.quality), 0.95) << omega;
        // the current that it hands on is that of the rotor frame
        EXPECT_NEAR(real(r.out.i.q), 0.3, 0.005) << omega;
        EXPECT_NEAR(real(r.out.i.d), 0, 0.005) << omega;
    }
}

TEST(Position, QualityFallsWhenTheMachineIsNotWhereItWas)
{
    Running r(0.5);
    r.run_ms(300);
    ASSERT_GT(real(r.self.quality), 0.95);
    r.rotation.omega_rad_s = -r.rotation.omega_rad_s; // the rotor runs away backwards
    int ms = 0;
    while (r.self.quality > 0 && ms < 500) {
        r.run_ms(1);
        ++ms;
    }
    EXPECT_LE(ms, kLost_ms);
}

TEST(Position, QualityFallsWithoutAVoltageOrACurrentThatFits)
{
    const position_config_t c = config();
    Running r(0.5);
    r.run_ms(300);
    // the link is gone: the same speed is believed, no voltage, no current
    int ms = 0;
    for (; r.self.quality > 0 && ms < 500; ++ms) {
        for (int k = 0; k < 10; ++k) {
            position_step(&r.self, &c, &kStill, &r.out);
        }
        position_slow(&r.self, &c, {0, 0}, r.out.i);
    }
    EXPECT_LE(ms, 3 * kLost_ms);
}

TEST(Position, QualityFallsWithoutTheCarrier)
{
    const position_config_t c = config();
    position_t self = started(c);
    int ms = 0;
    for (; self.quality > 0 && ms < 500; ++ms) {
        for (int k = 0; k < 10; ++k) {
            position_out_t out;
            position_step(&self, &c, &kStill, &out);
        }
        position_slow(&self, &c, {0, 0}, {0, 0});
    }
    EXPECT_LE(ms, kLost_ms);
}

// A carrier's answer that is far from what was told: up to eight times, sine.h.
TEST(Position, NoMisfitIsTooLargeForTheQuality)
{
    position_config_t c = config();
    c.injection.id = INJECTION_pulsating_sine;
    for (const double misfit : {0.6, 3.9, 4.1, 7.9, -7.9}) {
        position_t self = started(c);
        for (int ms = 0; ms < 300; ++ms) {
            self.injection.pulsating_sine.misfit = fixed(misfit, 28);
            self.injection.pulsating_sine.sine.warm = 100; // nothing of its own yet
            position_slow(&self, &c, {0, 0}, {0, 0});
        }
        EXPECT_EQ(self.quality, 0) << misfit;
    }
}

// An error that comes and goes within a sixth of a turn: by the filter of 3 ms a sixth of it is left, by that of 64 ms a hundredth.
TEST(Position, ASourceThatIsRightInTheMeanIsJudgedByItsMean)
{
    constexpr double kEps = 0.3; // what the position counts as lost at
    for (const bool in_mean : {false, true}) {
        position_config_t c = config();
        c.injection.id = INJECTION_pulsating_sine;
        c.traits = in_mean ? SOURCE_IN_MEAN : 0;
        position_t self = started(c);
        for (int ms = 0; ms < 300; ++ms) {
            self.injection.pulsating_sine.eps = fixed(ms % 2 == 0 ? kEps : -kEps, 28);
            self.injection.pulsating_sine.sine.warm = 100; // nothing of its own yet
            position_slow(&self, &c, {0, 0}, {0, 0});
        }
        const double k = in_mean ? 1.0 / 64 : 0.3;
        EXPECT_NEAR(real(self.quality), 1 - k / (2 - k), 0.02) << in_mean;
    }
}

// The resistance that an open loop has seen is taken within half of what the drive is told.
TEST(Position, ResistanceIsTakenWithinHalfOfItself)
{
    const position_config_t c = config(true);
    const double R = real(c.observer.active_flux.model.R);
    for (const double share : {0.2, 0.49, 0.51, 1.0, 1.49, 1.51, 3.0}) {
        position_t self = started(c);
        position_set_resistance(&self, &c, fixed(share * R, 28));
        EXPECT_NEAR(real(self.observer.active_flux.R), R * std::clamp(share, 0.5, 1.5), 1e-6) << share;
    }
}

TEST(Position, ImposedAngleReplacesTheEstimate)
{
    Running r(0.6);
    const pm_pll_t imposed = {PM_TURN(0.4), fixed(0.6, 28)};
    r.run_ms(1, &imposed); // whatever the machine does, to the last bit
    const auto turn = static_cast<pm_angle_t>(pm_omega_to_angle(imposed.omega, r.self.gains.k_theta));
    EXPECT_EQ(r.self.pll.theta, imposed.theta + 10 * turn);
    EXPECT_EQ(r.self.pll.omega, imposed.omega);
    r.run_ms(1); // and then the loop is closed again
    EXPECT_NE(r.self.pll.omega, imposed.omega);
}

} // namespace
