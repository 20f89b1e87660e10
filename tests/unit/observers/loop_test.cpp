#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/contract/bench.h"
#include "tests/unit/math/samples.h"

#include "observers/loop.h"

namespace
{

using bench::Complex;
using bench::fixed;
using bench::kDegree;
using bench::kPi;
using bench::real;

// METHODS.md 2.4.1 (e), 2.4.2 (e), 2.4.3 (e), 2.4.4 (e).
constexpr double kNoiseGain = 0.20;
constexpr double kRampError = 0.10;
constexpr double kRampOfEkf = 0.10;
constexpr double kSixthShare = 0.5;
// Fixed point against double: rounding of eps K_1 and W, gathered over the loop's memory.
constexpr double kFixed_rad = 2e-6;

constexpr double kPeriod_s = 100e-6;
constexpr double kBase_rad_s = 540;
constexpr double kZeta = 0.9;
constexpr double kEqualNoise = 0.7067; // r / w_n of equal noise bandwidth

struct Loop {
    loop_config_t config = {};
    pm_pll_config_t gains = {};
    loop_t loop = {};
    pm_pll_t pll = {};

    Loop(loop_id_t id, double w_n_rad_s)
    {
        config.id = id;
        double kp = 2 * kZeta * w_n_rad_s * kPeriod_s, ki = w_n_rad_s * w_n_rad_s * kPeriod_s;
        if (id == LOOP_SIMPLIFIED_EKF) {
            const double r = kEqualNoise * w_n_rad_s;
            kp = 2 * r * kPeriod_s;
            ki = 2 * r * r * kPeriod_s;
            config.k_acceleration = fixed(r * r * r * kPeriod_s * kPeriod_s / kBase_rad_s, 36);
        }
        gains.kp_turn = fixed(kp * 2 / kPi, 32);
        gains.ki = fixed(ki / kBase_rad_s, 32);
        gains.k_theta = fixed(16 * kBase_rad_s * kPeriod_s / (2 * kPi), 30);
        loop_reset(&loop);
        loop_slow(&loop, &config, PM_ONE);
    }

    double theta() const
    {
        return bench::rad(pll.theta);
    }
    void predict()
    {
        pm_pll_predict(&pll, &gains);
    }
    void correct(double eps_rad)
    {
        const pm_q_t eps = fixed(std::clamp(eps_rad, -1.0, 1.0), 28);
        pm_pll_correct(&pll, &gains, loop_eps(&loop, &config, &pll, &gains, eps));
    }
};

// The source: an EMF e in the stationary frame, |e| = E at the rotor's angle; the angle of it, seen from the
// loop.
double error_signal(Complex e, double E, const Loop &loop)
{
    return -(e * std::polar(1.0, -loop.theta())).real() / E;
}

double rms_of(Loop loop, double omega_pu, const std::function<Complex(double, int)> &emf, double E)
{
    double theta = 0, sum = 0;
    int n = 0;
    loop.pll.omega = fixed(omega_pu, 28);
    for (int k = 1; k <= 60000; ++k) {
        theta += omega_pu * kBase_rad_s * kPeriod_s;
        loop.predict();
        loop.correct(error_signal(emf(theta, k), E, loop));
        if (k > 10000) {
            sum += std::pow(bench::wrapped(theta - loop.theta()), 2);
            ++n;
        }
    }
    return std::sqrt(sum / n);
}

// White noise of a given rms in either component of the EMF.
class Noise
{
  public:
    explicit Noise(double rms) : width_(rms * std::sqrt(3.0))
    {
    }
    Complex operator()()
    {
        const double d = random_.within(-width_, width_);
        return {d, random_.within(-width_, width_)};
    }

  private:
    double width_;
    samples::Random random_;
};

double noise_rms(loop_id_t id, double w_n_rad_s, double noise, double E = 1)
{
    Noise white(noise);
    return rms_of(
        Loop(id, w_n_rad_s), 0.3,
        [&](double theta, int) { return bench::kJ * std::polar(E, theta) + white(); }, E);
}

TEST(Loop, ArctangentHasAllTheNoise)
{
    for (const double noise : {0.01, 0.05}) {
        for (const double E : {0.2, 1.0}) {
            EXPECT_NEAR(noise_rms(LOOP_ARCTANGENT, 157, noise * E, E), noise, kNoiseGain * noise);
        }
    }
}

// Closed forms of the noise bandwidths: (4 zeta^2 + 1) / (4 zeta) w_n and 5/3 r.
TEST(Loop, NoiseOfTheOthersIsThatOfTheirBandwidth)
{
    for (const double w_n : {60.0, 157.0, 300.0}) {
        const double noise = 0.05;
        const double pll = noise * std::sqrt((4 * kZeta * kZeta + 1) / (4 * kZeta) * w_n * kPeriod_s);
        EXPECT_NEAR(noise_rms(LOOP_PLL, w_n, noise), pll, 0.1 * pll) << w_n;
        EXPECT_NEAR(noise_rms(LOOP_SIMPLIFIED_EKF, w_n, noise), pll, 0.1 * pll) << w_n;
    }
}

double ramp_error(loop_id_t id, double w_n_rad_s, double per_unit_per_s)
{
    Loop loop(id, w_n_rad_s);
    const double a = per_unit_per_s * kBase_rad_s;
    double error = 0;
    for (int k = 1; k <= 5000; ++k) {
        const double t = k * kPeriod_s;
        loop.predict();
        error = bench::wrapped(a * t * t / 2 - loop.theta());
        loop.correct(std::sin(error));
    }
    return error;
}

TEST(Loop, RampErrors) // 1 pu/s
{
    for (const double w_n : {80.0, 157.0}) {
        for (const double sign : {1.0, -1.0}) {
            const double expected = sign * kBase_rad_s / (w_n * w_n);
            EXPECT_NEAR(ramp_error(LOOP_PLL, w_n, sign), expected, kRampError * std::abs(expected));
            EXPECT_LE(std::abs(ramp_error(LOOP_SIMPLIFIED_EKF, w_n, sign)), kRampOfEkf * std::abs(expected));
        }
    }
}

// Its speed is that of a PLL, 2 zeta a / w_n late, by which its prediction errs for one period.
TEST(Loop, RampErrorOfTheArctangentIsThatOfOnePeriod)
{
    const double w_n = 157, a = kBase_rad_s, expected = 2 * kZeta * a / w_n * kPeriod_s;
    EXPECT_NEAR(ramp_error(LOOP_ARCTANGENT, w_n, 1.0), expected, 0.1 * expected);
}

// The noise of the speed: the arctangent's is the PLL's.
TEST(Loop, TheSpeedIsAsQuietWithTheArctangent)
{
    double rms[LOOP_COUNT] = {};
    for (const loop_id_t id : {LOOP_PLL, LOOP_ARCTANGENT}) {
        Loop loop(id, 157);
        Noise white(0.1);
        loop.pll.omega = fixed(0.3, 28);
        double theta = 0;
        for (int k = 0; k < 30000; ++k) {
            theta += 0.3 * kBase_rad_s * kPeriod_s;
            loop.predict();
            loop.correct(error_signal(bench::kJ * std::polar(1.0, theta) + white(), 1, loop));
            rms[id] += std::pow(real(loop.pll.omega) - 0.3, 2);
        }
    }
    EXPECT_NEAR(rms[LOOP_ARCTANGENT] / rms[LOOP_PLL], 1, 0.1);
}

TEST(Loop, EkfFollowsTheDoubleForm)
{
    const double w_n = 157, r = kEqualNoise * w_n;
    Loop loop(LOOP_SIMPLIFIED_EKF, w_n);
    double theta = 0, omega = 0, W = 0, worst = 0;
    for (int k = 1; k <= 30000; ++k) {
        const double t = k * kPeriod_s;
        const double truth = 0.5 + 20 * std::sin(4 * t) + 30 * t;
        loop.predict();
        loop.correct(std::sin(truth - loop.theta()));
        theta += kPeriod_s * omega;
        const double eps = std::sin(truth - theta);
        W += r * r * r * kPeriod_s * kPeriod_s * eps;
        omega += W + 2 * r * r * kPeriod_s * eps;
        theta += 2 * r * kPeriod_s * eps;
        worst = std::max(worst, std::abs(bench::wrapped(theta - loop.theta())));
    }
    EXPECT_LE(worst, kFixed_rad * 5);
}

// EMF with a_5 = 4 % in negative and a_7 = 1 % in positive sequence: error (a_7 - a_5) sin 6 theta.
Complex harmonic_emf(double theta)
{
    return bench::kJ * (std::polar(1.0, theta) + std::polar(0.04, -5 * theta) + std::polar(0.01, 7 * theta));
}

double sixth(loop_id_t id, double w_n_rad_s, double omega_pu)
{
    return std::sqrt(2) *
           rms_of(
               Loop(id, w_n_rad_s), omega_pu, [](double theta, int) { return harmonic_emf(theta); }, 1);
}

TEST(Loop, SixthHarmonicIsTheFormulasWithTheArctangent) // METHODS.md 3.3.1: within 15 %
{
    for (const double omega : {0.1, 0.5}) {
        EXPECT_NEAR(sixth(LOOP_ARCTANGENT, 157, omega), 0.03, 0.15 * 0.03) << omega;
    }
}

TEST(Loop, OthersAttenuateTheSixthHarmonic) // METHODS.md 2.4.4, 3.3.1: where 6 omega > 3 w_n
{
    for (const double omega : {0.18, 0.5}) {
        const double w_n = 157, direct = sixth(LOOP_ARCTANGENT, w_n, omega);
        ASSERT_GT(6 * omega * kBase_rad_s, 3 * w_n);
        EXPECT_LE(sixth(LOOP_PLL, w_n, omega), 0.65 * direct) << omega;
        EXPECT_LE(sixth(LOOP_SIMPLIFIED_EKF, w_n, omega), kSixthShare * direct) << omega;
    }
    EXPECT_LE(sixth(LOOP_PLL, 157, 0.3), kSixthShare * sixth(LOOP_ARCTANGENT, 157, 0.3));
}

// METHODS.md 2.4.4: a speed step within 0.15 s and a reversal, with the harmonics, and a noise of 2 %.
TEST(Loop, ThreeOfThemThroughStepAndReversal)
{
    for (const loop_id_t id : {LOOP_PLL, LOOP_ARCTANGENT, LOOP_SIMPLIFIED_EKF}) {
        Loop loop(id, 157);
        Noise white(0.02);
        double omega = 0.2, theta = 0, worst = 0;
        loop.pll.omega = fixed(omega, 28);
        for (int k = 1; k <= 20000; ++k) {
            const double target = k < 5000 ? 0.2 : (k < 10000 ? 0.8 : -0.8);
            omega += std::clamp(target - omega, -4.0 * kPeriod_s, 4.0 * kPeriod_s);
            theta += omega * kBase_rad_s * kPeriod_s;
            loop.predict();
            // the EMF changes its sign with the speed; a source knows it
            const double sign = omega < 0 ? -1 : 1;
            const Complex e =
                sign * std::abs(omega) * (sign * harmonic_emf(theta)) + white() * std::abs(omega);
            loop.correct(std::abs(omega) < 0.01 ? 0 : error_signal(e, std::abs(omega), loop));
            worst = std::max(worst, std::abs(bench::wrapped(theta - loop.theta())));
        }
        // without a signal for 5 ms the PLL goes on at a speed that lags by 2 zeta a / w_n: 0.24 rad
        EXPECT_LT(worst, 0.29) << id;
        EXPECT_NEAR(real(loop.pll.omega), -0.8, 0.03) << id;
    }
}

// Whatever theta was, up to the limit of the error signal the arctangent is right after one period.
TEST(Loop, ArctangentForgetsAtOnce)
{
    for (const double wrong : {-0.9, -0.2, 0.5, 0.99}) {
        Loop loop(LOOP_ARCTANGENT, 157);
        loop.pll.theta = bench::turns(3.0);
        loop.correct(wrong);
        EXPECT_NEAR(bench::wrapped(loop.theta() - 3.0 - wrong), 0, 1e-6) << wrong;
    }
}

TEST(Loop, TheOthersShareIsThePlls)
{
    for (const loop_id_t id : {LOOP_ARCTANGENT, LOOP_SIMPLIFIED_EKF}) {
        Loop plain(LOOP_PLL, 157), other(LOOP_PLL, 157);
        other.config = Loop(id, 157).config;
        loop_slow(&other.loop, &other.config, 0);
        for (int k = 0; k < 1000; ++k) {
            for (Loop *l : {&plain, &other}) {
                l->predict();
                l->correct(0.3 * std::sin(0.01 * k));
            }
        }
        EXPECT_EQ(plain.pll.theta, other.pll.theta) << id;
        EXPECT_EQ(plain.pll.omega, other.pll.omega) << id;
    }
}

// By parameter on a running drive: what one kept means nothing to the other.
TEST(Loop, ChangedWithoutAJump)
{
    for (const loop_id_t to : {LOOP_PLL, LOOP_SIMPLIFIED_EKF}) {
        Loop loop(LOOP_ARCTANGENT, 157);
        double theta = 0;
        const auto run = [&](int periods, double disturbance) {
            double worst = 0;
            for (int k = 0; k < periods; ++k) {
                theta += 0.3 * kBase_rad_s * kPeriod_s;
                loop.predict();
                worst = std::max(worst, std::abs(bench::wrapped(theta - loop.theta())));
                loop.correct(std::sin(theta - loop.theta() + disturbance));
            }
            return worst;
        };
        loop.pll.omega = fixed(0.3, 28);
        run(1000, 0);
        run(10, 0.2); // the PLL within hangs behind
        const Loop other(to, 157);
        loop.config = other.config;
        loop.gains = other.gains;
        loop_slow(&loop.loop, &loop.config, PM_ONE);
        EXPECT_LT(run(3000, 0), 0.25) << to;
        EXPECT_LT(run(100, 0), 1e-3) << to;
    }
}

TEST(Loop, LargestErrorsSaturate)
{
    for (const double eps : {1.0, -1.0}) {
        for (const loop_id_t id : {LOOP_PLL, LOOP_ARCTANGENT, LOOP_SIMPLIFIED_EKF}) {
            Loop loop(id, 1000);
            for (int k = 0; k < 20000; ++k) {
                loop.predict();
                loop.correct(eps);
                ASSERT_LE(std::abs(real(loop.pll.omega)), 2.0 + 1e-6) << id;
            }
            if (id != LOOP_ARCTANGENT) { // that is a turn of 1 rad per period, which wraps
                EXPECT_NEAR(real(loop.pll.omega), eps * 2, 1e-3) << id;
            }
        }
    }
}

// The inner loop's distance is forgotten where the angle is not the observer's alone, and where the loop is another.
TEST(Loop, ForgetsItsInnerDistance)
{
    const struct {
        loop_id_t before, now;
        pm_q_t weight;
        bool kept;
    } cases[] = {{LOOP_ARCTANGENT, LOOP_ARCTANGENT, PM_ONE, true},
                 {LOOP_ARCTANGENT, LOOP_ARCTANGENT, PM_ONE / 2, false},
                 {LOOP_ARCTANGENT, LOOP_ARCTANGENT, 0, false},
                 {LOOP_PLL, LOOP_PLL, PM_ONE / 2, true},
                 {LOOP_PLL, LOOP_PLL, 0, false},
                 {LOOP_PLL, LOOP_ARCTANGENT, PM_ONE, false}};
    for (const auto &at : cases) {
        loop_t self;
        loop_reset(&self);
        self.id = static_cast<uint8_t>(at.before);
        self.inner = 12345;
        loop_config_t c = {};
        c.id = at.now;
        loop_slow(&self, &c, at.weight);
        EXPECT_EQ(self.inner, at.kept ? 12345 : 0) << at.before << at.now << ' ' << at.weight;
        EXPECT_EQ(self.direct, at.weight == PM_ONE);
    }
}

} // namespace
