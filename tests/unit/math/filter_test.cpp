#include "firmware/math/filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdlib>

#include "samples.h"

namespace
{

using samples::q;
using samples::Random;
using samples::real;

// One rounding of half an LSB per step, gathered by a filter that forgets at rate k: half an LSB / k.
constexpr double kLp1Rounding = 0x1p-29;
// The sampled filter has its -3 dB point at w_c up to w_c T_s / 2 relative; 1 % is that at w_c T_s = 0.02.
constexpr double kCornerError = 0.01;
// Shaped rounding noise of 1 LSB per step, at most 1 / (2 zeta w T_s) times at the pole frequency.
constexpr double kBiquadLsb = 0x1p-28;
// The coefficients have 29 bits; near the dc gain they count as 2^-30 / (w T_s)^2.
constexpr double kNotchDepth = 1e-5;

pm_frac_t frac(double x)
{
    return static_cast<pm_frac_t>(std::llround(x * 0x1p32));
}

struct Biquad {
    double b0, b1, b2, a1, a2;
};

int32_t q29(double x)
{
    return static_cast<int32_t>(std::llround(x * 0x1p29));
}

pm_biquad_config_t fixed(const Biquad &c)
{
    return {q29(c.b0), q29(c.b1), q29(c.b2), q29(c.a1), q29(c.a2)};
}

Biquad quantised(const pm_biquad_config_t &c)
{
    const auto of = [](int32_t x) { return x * 0x1p-29; };
    return {of(c.b0), of(c.b1), of(c.b2), of(c.a1), of(c.a2)};
}

// Bilinear transform with the frequency kept exact.
Biquad low_pass(double w, double zeta)
{
    const double t = std::tan(w / 2), n = 1 / (1 + 2 * zeta * t + t * t);
    return {t * t * n, 2 * t * t * n, t * t * n, 2 * (t * t - 1) * n, (1 - 2 * zeta * t + t * t) * n};
}

Biquad notch(double w, double zeta)
{
    const double t = std::tan(w / 2), n = 1 / (1 + 2 * zeta * t + t * t);
    const double b = (1 + t * t) * n, m = 2 * (t * t - 1) * n;
    return {b, m, b, m, (1 - 2 * zeta * t + t * t) * n};
}

// Direct form I, on purpose another structure than the firmware's.
class Reference
{
  public:
    explicit Reference(const Biquad &c) : c_(c)
    {
    }
    double step(double x)
    {
        const double y = c_.b0 * x + c_.b1 * x1_ + c_.b2 * x2_ - c_.a1 * y1_ - c_.a2 * y2_;
        x2_ = x1_;
        x1_ = x;
        y2_ = y1_;
        y1_ = y;
        return y;
    }

  private:
    Biquad c_;
    double x1_ = 0, x2_ = 0, y1_ = 0, y2_ = 0;
};

// Amplitude of the response to a unit sine of w rad per step, after settling, through a Hann window.
template <typename F> double amplitude(double w, F step)
{
    std::complex<double> sum = 0;
    const int settle = 40000, periods = static_cast<int>(std::ceil(0.1 * settle * w));
    const int n = static_cast<int>(std::lround(periods * 2 * M_PI / w));
    for (int k = 0; k < settle + n; ++k) {
        const double y = step(std::sin(w * k));
        if (k >= settle) {
            sum += y * std::polar(1 - std::cos(2 * M_PI * (k - settle) / n), -w * k);
        }
    }
    return 2 * std::abs(sum) / n;
}

TEST(MathLp1, FollowsTheDoubleModel)
{
    for (const double k : {0.4999, 0.1, 0.003, 1e-4}) {
        Random random;
        pm_q_t y = q(0.7);
        double model = real(y), worst = 0;
        for (int i = 0; i < 200000; ++i) {
            const pm_q_t x = q(i % 5000 < 2500 ? random.within(-3.9, 3.9) : 3.9);
            model += k * (real(x) - model);
            worst = std::max(worst, std::abs(real(pm_lp1(&y, x, frac(k))) - model));
        }
        const double constant = 8 * 0x1p-33 / k; // k itself is rounded
        EXPECT_LE(worst, kLp1Rounding / k + constant) << k;
    }
}

TEST(MathLp1, ReachesTheInputFromBothSides)
{
    for (const double k : {0.3, 0.01, 1e-3}) {
        for (const double start : {-3.9, 3.9}) {
            pm_q_t y = q(start);
            for (int i = 0; i < 60 / k; ++i) {
                pm_lp1(&y, PM_ONE, frac(k));
            }
            EXPECT_LE(std::abs(y - PM_ONE), 0.5 / k + 1) << k << " from " << start;
        }
    }
}

TEST(MathLp1, ThreeDecibelsAtTheCorner)
{
    const double w = 0.02;
    pm_q_t y = 0;
    const pm_frac_t k = frac(1 - std::exp(-w));
    const double gain = amplitude(w, [&](double x) { return real(pm_lp1(&y, q(x), k)); });
    EXPECT_NEAR(gain, std::sqrt(0.5), kCornerError);
    EXPECT_NEAR(gain, (1 - std::exp(-w)) / std::abs(1.0 - std::exp(-w) * std::polar(1.0, -w)), 1e-6);
}

TEST(MathLp1, LargestAllowedStep)
{
    pm_q_t y = PM_Q(-3.99);
    pm_lp1(&y, PM_Q(3.99), frac(0.4999));
    EXPECT_NEAR(real(y), -3.99 + 0.4999 * 7.98, 1e-8);
}

TEST(MathBiquad, FollowsTheDoubleModel)
{
    for (const double w : {0.002, 0.02, 0.3, 2.0}) {
        for (const Biquad &c : {low_pass(w, std::sqrt(0.5)), low_pass(w, 0.3), notch(w, 0.5)}) {
            const pm_biquad_config_t config = fixed(c);
            Reference reference(quantised(config));
            pm_biquad_t state = {};
            Random random;
            double worst = 0;
            for (int i = 0; i < 100000; ++i) {
                const pm_q_t x = q((i / 700 % 2 != 0 ? 0.8 : -0.8) + random.within(-0.5, 0.5));
                const double exact = reference.step(real(x));
                worst = std::max(worst, std::abs(real(pm_biquad_step(&state, &config, x)) - exact));
            }
            EXPECT_LE(worst, kBiquadLsb * (2 + 2 / w)) << "w " << w << " a1 " << c.a1;
        }
    }
}

TEST(MathBiquad, DcGainIsThatOfTheCoefficients)
{
    for (const double w : {0.002, 0.01, 0.2}) {
        const pm_biquad_config_t config = fixed(low_pass(w, 0.7));
        const Biquad c = quantised(config);
        const double gain = (c.b0 + c.b1 + c.b2) / (1 + c.a1 + c.a2);
        for (const double x : {-1.0, 0.001, 2.5}) {
            pm_biquad_t state = {};
            double mean = 0;
            const int settle = static_cast<int>(40 / w), n = 4096;
            for (int i = 0; i < settle + n; ++i) {
                const pm_q_t y = pm_biquad_step(&state, &config, q(x));
                mean += i >= settle ? real(y) / n : 0.0;
            }
            EXPECT_NEAR(mean, gain * real(q(x)), 2 * kBiquadLsb) << w << " " << x;
        }
    }
}

TEST(MathBiquad, ThreeDecibelsAtTheCorner)
{
    for (const double w : {0.01, 0.1, 1.0}) {
        const pm_biquad_config_t config = fixed(low_pass(w, std::sqrt(0.5)));
        pm_biquad_t state = {};
        const double gain =
            amplitude(w, [&](double x) { return real(pm_biquad_step(&state, &config, q(x))); });
        EXPECT_NEAR(gain, std::sqrt(0.5), 1e-4) << w;
    }
}

TEST(MathBiquad, NotchStopsItsFrequency)
{
    for (const double w : {0.05, 0.5}) {
        const pm_biquad_config_t config = fixed(notch(w, 0.5));
        pm_biquad_t state = {};
        const auto step = [&](double x) { return real(pm_biquad_step(&state, &config, q(x))); };
        EXPECT_LE(amplitude(w, step), kNotchDepth) << w;
        EXPECT_NEAR(amplitude(w / 50, step), 1, 0.001) << w;
    }
}

TEST(MathBiquad, SaturatesAndRecovers)
{
    const pm_biquad_config_t config = fixed({0.5, 0, 0, -0.6, 0.1}); // dc gain 1
    pm_biquad_t state = {};
    pm_q_t y = 0;
    for (int i = 0; i < 100; ++i) {
        y = pm_biquad_step(&state, &config, INT32_MAX);
    }
    EXPECT_NEAR(real(y), 4, 1e-7);
    for (int i = 0; i < 100; ++i) {
        y = pm_biquad_step(&state, &config, PM_ONE);
    }
    EXPECT_NEAR(y, PM_ONE, 4);

    const pm_biquad_config_t loud = fixed({3.9, 0, 0, 0, 0});
    EXPECT_EQ(pm_biquad_step(&(state = {}), &loud, INT32_MAX), (1 << 30) - 8); // 4 - 2^-25
    EXPECT_EQ(pm_biquad_step(&(state = {}), &loud, INT32_MIN), -(1 << 30));
}

// The largest coefficients of every sign against the largest inputs; the sanitizers see an overflow.
TEST(MathBiquad, NoOverflowAtTheCorners)
{
    Random random;
    for (int signs = 0; signs < 32; ++signs) {
        const auto with_sign = [signs](int bit, int32_t x) { return (signs >> bit & 1) != 0 ? -x : x; };
        const pm_biquad_config_t config = {with_sign(0, INT32_MAX), with_sign(1, INT32_MAX),
                                           with_sign(2, INT32_MAX), with_sign(3, (1 << 30) - 1),
                                           with_sign(4, (1 << 29) - 1)};
        pm_biquad_t state = {};
        for (int i = 0; i < 2000; ++i) {
            const pm_q_t y = pm_biquad_step(&state, &config, random.word() < 0 ? INT32_MIN : INT32_MAX);
            ASSERT_LE(std::abs(real(y)), 4.0);
            const double s1 = static_cast<double>(state.s1) * 0x1p-57;
            ASSERT_LE(std::abs(s1), 44.1);
        }
    }
}

} // namespace
