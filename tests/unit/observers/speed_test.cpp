#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/contract/bench.h"
#include "tests/unit/math/samples.h"

#include "observers/speed.h"

namespace
{

using bench::fixed;
using bench::kDegree;
using bench::kPi;
using bench::real;

// METHODS.md appendix A (e).
constexpr double kSteady = 0.001;
constexpr double kDelay = 1.2;
constexpr double kRipple = 0.5;
constexpr double kExact = 1e-6;

constexpr double kStep_s = 1e-3;
constexpr int kPeriods = 10; // control periods per step
constexpr bench::Machine kMachine = bench::kIpmLinear;
constexpr bench::Base kBase = bench::kIpmBase;

speed_config_t config_of(speed_id_t id, unsigned window, double ratio_s = 3e-3)
{
    speed_config_t c = {};
    c.id = id;
    const observer_model_t model = bench::model(kMachine, kBase);
    c.R = model.R;
    c.L_d = model.L_d;
    c.psi_m = model.psi_m;
    c.per_step = fixed(16.0 / kPeriods, 26);
    c.rise = fixed(real(model.L_q) / (kStep_s * kBase.omega_rad_s), 26);
    c.window = static_cast<uint8_t>(window);
    c.turn_step = kPeriods;
    c.k_theta = fixed(16 * kBase.omega_rad_s * kBase.period_s / (2 * kPi), 30);
    c.per_turn = fixed(2 * kPi / (window * kStep_s * kBase.omega_rad_s), 26);
    c.k_ratio = fixed(1 - std::exp(-kStep_s / ratio_s), 32);
    c.k_mean = fixed(1 - std::exp(-kStep_s * 2 * kPi * 5), 32);
    return c;
}

// A rotor, its voltage at a given current, and a loop that knows the speed as it was 3 ms ago.
class Bench
{
  public:
    Bench(const speed_config_t &config, double psi_factor, double omega_pu)
        : config_(config), omega_(omega_pu), loop_(omega_pu)
    {
        config_.psi_m = static_cast<pm_q_t>(psi_factor * config_.psi_m);
        step(omega_pu); // the first gives the loop's speed
        // what the EMF says of the speed it starts with
        state.omega_e = fixed(omega_pu * kMachine.psi_m_Wb / kBase.psi_Wb() / real(config_.psi_m), 28);
        state.difference = fixed(omega_pu, 28) - state.omega_e;
    }

    double step(double omega_pu, double theta_noise_rad = 0, double v_noise_V = 0)
    {
        theta_ += 0.5 * (omega_ + omega_pu) * kBase.omega_rad_s * kStep_s;
        omega_ = omega_pu;
        loop_ += 0.28 * (omega_ - loop_);
        const double L_q_di = rise_ * kMachine.L_q0_H / kBase.inductance_H() / kBase.omega_rad_s;
        i_q_ += rise_ * kStep_s;
        speed_in_t in = {};
        in.theta =
            bench::turns(bench::wrapped(theta_ + theta_noise_rad * random_.within(-1, 1) * std::sqrt(3.0)));
        in.omega = fixed(loop_, 28);
        in.i = {0, fixed(i_q_, 28)};
        const double v_q = kMachine.R_ohm / kBase.impedance_ohm() * (i_q_ - rise_ * kStep_s / 2) + L_q_di +
                           omega_ * kMachine.psi_m_Wb / kBase.psi_Wb() +
                           v_noise_V / kBase.v_V * random_.within(-1, 1) * std::sqrt(3.0);
        for (int n = 0; n < kPeriods; ++n) {
            speed_collect(&state, fixed(v_q, 28));
        }
        return real(speed_step(&state, &config_, &in));
    }

    // per-unit per second
    void current_ramp(double rise)
    {
        rise_ = rise;
    }

    speed_t state = {};

  private:
    speed_config_t config_;
    samples::Random random_;
    double theta_ = 0, omega_, loop_, i_q_ = 0.3, rise_ = 0;
};

TEST(Speed, EachIsExactInTheSteadyState)
{
    for (const speed_id_t id : {SPEED_LOOP, SPEED_DIFFERENCE, SPEED_EMF_RATIO, SPEED_COMBINED}) {
        for (const double omega : {0.0, 0.1, -0.5, 1.2}) {
            Bench bench(config_of(id, 6), 1.0, omega);
            double last = 0;
            for (int k = 0; k < 100; ++k) {
                last = bench.step(omega);
            }
            EXPECT_NEAR(last, omega, kExact + 1e-5 * std::abs(omega)) << id;
        }
    }
}

TEST(Speed, ResetIsBumpless)
{
    for (const double omega : {0.3, -0.9}) {
        Bench bench(config_of(SPEED_COMBINED, 5), 1.0, omega);
        for (int k = 0; k < 20; ++k) {
            EXPECT_NEAR(bench.step(omega), omega, 1e-5) << k;
        }
    }
}

// From another estimator, with the drive running.
TEST(Speed, TakesOverWithoutAJump)
{
    Bench bench(config_of(SPEED_COMBINED, 6), 1.0, 0.4);
    bench.state.ready = false;
    bench.state.past[0] = 12345;
    bench.state.omega_e = 0;
    for (int k = 0; k < 20; ++k) {
        EXPECT_NEAR(bench.step(0.4), 0.4, 1e-5) << k;
    }
}

// Rated current within 20 ms asks for 15 V, which would pass for 22 % of speed.
TEST(Speed, AChangeOfCurrentIsNoSpeed)
{
    Bench bench(config_of(SPEED_EMF_RATIO, 6), 1.0, 0.3);
    bench.step(0.3);
    bench.current_ramp(20);
    double last = 0;
    for (int k = 0; k < 20;
         ++k) { // the jump of the voltage at its start lies within a step, and is forgotten
        last = bench.step(0.3);
    }
    EXPECT_NEAR(last, 0.3, 5e-4);
}

// Appendix A: the difference is the mean over the window, the ratio errs by psi_m, the combination does not.
TEST(Speed, AWrongMagnetSpoilsTheRatioAlone)
{
    for (const double factor : {0.9, 1.1}) {
        double last[SPEED_COUNT] = {};
        for (const speed_id_t id : {SPEED_DIFFERENCE, SPEED_EMF_RATIO, SPEED_COMBINED}) {
            Bench bench(config_of(id, 6), factor, 0.5);
            for (int k = 0; k < 1000; ++k) {
                last[id] = bench.step(0.5);
            }
        }
        EXPECT_NEAR(last[SPEED_DIFFERENCE], 0.5, kSteady * 0.5);
        EXPECT_NEAR(last[SPEED_COMBINED], 0.5, kSteady * 0.5);
        EXPECT_NEAR(last[SPEED_EMF_RATIO], 0.5 / factor, kSteady * 0.5); // the twin
    }
}

// Time from a step of 10 % to half of it, between steps by interpolation.
double delay_s(speed_id_t id, double factor, unsigned window, double end = 0.9)
{
    Bench bench(config_of(id, window), factor, 0.1);
    double start = 0;
    for (int k = 0; k < 200; ++k) {
        start = bench.step(0.1);
    }
    const double rise = id == SPEED_EMF_RATIO ? (end - 0.1) / factor : end - 0.1;
    double before = start;
    for (int k = 1; k < 400; ++k) {
        const double now = bench.step(end);
        if (now > start + rise / 2) {
            return (k - 1 + (start + rise / 2 - before) / (now - before)) * kStep_s;
        }
        before = now;
    }
    return 1;
}

TEST(Speed, TheCombinationIsAsFastAsTheRatio)
{
    const double ratio = delay_s(SPEED_EMF_RATIO, 0.9, 6);
    const double combined = delay_s(SPEED_COMBINED, 0.9, 6);
    EXPECT_LE(combined, kDelay * ratio);
    // the twin: a difference over 6 ms is late by 3
    EXPECT_GT(delay_s(SPEED_DIFFERENCE, 0.9, 6, 0.3), 1.3 * ratio);
}

double ripple(speed_id_t id, unsigned window)
{
    Bench bench(config_of(id, window), 0.9, 0.5);
    double sum = 0, squares = 0;
    const int n = 20000;
    for (int k = 0; k < n + 1000; ++k) {
        const double omega = bench.step(0.5, 0.3 * kDegree, 0.33);
        if (k >= 1000) {
            sum += omega;
            squares += omega * omega;
        }
    }
    return std::sqrt(squares / n - (sum / n) * (sum / n));
}

// A position noise of 0.3 degree; in the voltage what current control makes of half an LSB, 135 V/A 2.4 mA;
// at the same delay, N T/2 = 3 ms.
TEST(Speed, TheCombinationIsQuieterThanTheDifferenceOfItsDelay)
{
    const double difference = ripple(SPEED_DIFFERENCE, 6);
    const double expected = 0.3 * kDegree * std::sqrt(2) / (6 * kStep_s * kBase.omega_rad_s);
    EXPECT_NEAR(difference, expected, 0.05 * expected); // noise / (N T)
    EXPECT_LE(ripple(SPEED_COMBINED, 6), kRipple * difference);
}

TEST(Speed, DelayOfTheDifferenceIsHalfItsWindow)
{
    for (const unsigned window : {2U, 4U, 6U}) {
        EXPECT_NEAR(delay_s(SPEED_DIFFERENCE, 1.0, window, 0.3), window * kStep_s / 2, 0.6e-3) << window;
    }
}

// More than half a turn per step: 2.5 turns per ms at base speed.
TEST(Speed, TheDifferenceCountsWholeTurns)
{
    constexpr double base = 15700;
    speed_config_t c = config_of(SPEED_DIFFERENCE, 4);
    c.turn_step = 40;
    c.k_theta = fixed(16 * base * 25e-6 / (2 * kPi), 30);
    c.per_turn = fixed(2 * kPi / (4 * kStep_s * base), 26);
    speed_t state = {};
    double theta = 0;
    pm_q_t omega = 0;
    for (int k = 0; k < 50; ++k) {
        theta += 0.9 * base * kStep_s;
        speed_in_t in = {};
        in.theta = bench::turns(bench::wrapped(theta));
        in.omega = fixed(0.88, 28); // the loop is not quite there
        omega = speed_step(&state, &c, &in);
    }
    EXPECT_NEAR(real(omega), 0.9, 1e-5);
}

} // namespace
