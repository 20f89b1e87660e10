#include "firmware/math/pi.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "samples.h"

namespace
{

using samples::q;
using samples::Random;
using samples::real;

// Output and integral have 22 bits; the loop gathers a few of their roundings.
constexpr double kStepError = 20 * 0x1p-22;
// pi.h: |integral| <= |u_limited| + |feed-forward|, a little more for the rounding of ki and kb.
constexpr double kIntegralBound = 16.01;
// Overshoot beyond that of the double model.
constexpr double kExtraOvershoot = 1e-5;

constexpr double kWide = 0x1p-22;

struct Gains {
    double kp, ki;
};

pm_pi_config_t fixed(const Gains &g)
{
    return {static_cast<pm_gain_t>(std::lround(g.kp * 0x1p26)),
            static_cast<pm_gain_t>(std::lround(g.ki * 0x1p26)),
            static_cast<pm_unit_t>(std::lround(std::min(g.ki / g.kp, 1.0) * INT32_MAX))};
}

struct DoublePi {
    Gains g;
    double integral = 0;

    double step(double e, double ff, double limit)
    {
        const double u = g.kp * e + integral + ff, limited = std::clamp(u, -limit, limit);
        integral += g.ki * e + g.ki / g.kp * (limited - u);
        return limited;
    }
};

struct FixedPi {
    pm_pi_config_t config;
    pm_pi_t state = {};

    double step(double e, double ff, double limit)
    {
        const pm_wide_t top = static_cast<pm_wide_t>(std::lround(limit / kWide));
        const pm_wide_t u = pm_pi_output(&state, &config, q(e), q(ff));
        const pm_wide_t limited = pm_clamp(u, -top, top);
        pm_pi_update(&state, &config, q(e), limited - u);
        return limited * kWide;
    }
};

// First-order plant with one period of delay, as a phase winding under PWM.
template <typename Pi>
std::vector<double> closed_loop(Pi &pi, const std::vector<double> &reference, double limit)
{
    const double decay = 0.98, gain = 0.05;
    std::vector<double> y = {0};
    double u = 0;
    for (const double r : reference) {
        const double next = pi.step(r - y.back(), 0.1 * y.back(), limit);
        y.push_back(decay * y.back() + gain * u);
        u = next;
    }
    return y;
}

std::vector<double> levels(const std::vector<double> &values, size_t each)
{
    std::vector<double> r;
    for (const double value : values) {
        r.insert(r.end(), each, value);
    }
    return r;
}

double worst_difference(const std::vector<double> &a, const std::vector<double> &b)
{
    double worst = 0;
    for (size_t k = 0; k < a.size(); ++k) {
        worst = std::max(worst, std::abs(a[k] - b[k]));
    }
    return worst;
}

const Gains kWinding = {5.0, 0.1};

TEST(MathPi, StepResponseIsThatOfTheDoubleModel)
{
    DoublePi model = {kWinding};
    FixedPi pi = {fixed(kWinding)};
    const auto reference = levels({0.1, -0.2, 0.15, 0.0}, 400);
    const auto expected = closed_loop(model, reference, 4.0), actual = closed_loop(pi, reference, 4.0);
    EXPECT_LE(worst_difference(expected, actual), kStepError);
    EXPECT_NEAR(actual[399], 0.1, 1e-5); // and it is a controller
}

TEST(MathPi, RecoversFromTheLimitLikeTheDoubleModel)
{
    DoublePi model = {kWinding};
    FixedPi pi = {fixed(kWinding)};
    // 3 cannot be reached with a limit of 1 (the plant settles at 2.5); 2 can.
    const auto reference = levels({3.0, 2.0, -3.0, -2.0, 0.5}, 600);
    const auto expected = closed_loop(model, reference, 1.0), actual = closed_loop(pi, reference, 1.0);
    EXPECT_LE(worst_difference(expected, actual), kStepError);

    const auto overshoot = [](const std::vector<double> &y) {
        return std::max(0.5 - *std::min_element(y.begin() + 2400, y.end()),
                        *std::max_element(y.begin() + 2450, y.end()) - 0.5);
    };
    EXPECT_LE(overshoot(actual), overshoot(expected) + kExtraOvershoot);
    EXPECT_LT(*std::min_element(actual.begin() + 600, actual.begin() + 1200), 2.001); // left the limit at all
}

TEST(MathPi, WithoutBackCalculationItOvershoots)
{
    FixedPi with = {fixed(kWinding)}, without = {fixed(kWinding)};
    without.config.kb = 0;
    const auto reference = levels({3.0, 0.5}, 600);
    const auto good = closed_loop(with, reference, 1.0), bad = closed_loop(without, reference, 1.0);
    EXPECT_NEAR(good[700], 0.5, 0.02);
    EXPECT_GT(bad[700], 1.5); // still at the limit: the test above would notice a missing anti-windup
}

TEST(MathPi, OutputIsExactInItsTerms)
{
    Random random;
    for (int i = 0; i < 200000; ++i) {
        const pm_pi_config_t c = {random.word() & INT32_MAX, 0, 0};
        const pm_pi_t state = {static_cast<pm_wide_t>(std::lround(random.within(-16, 16) / kWide))};
        const pm_q_t e = random.word(), ff = random.word();
        const double exact = c.kp * 0x1p-26 * real(e) + state.integral * kWide + real(ff);
        ASSERT_NEAR(pm_pi_output(&state, &c, e, ff) * kWide, exact, 1.5 * kWide);
    }
}

TEST(MathPi, SmallErrorsMoveTheIntegralBothWays)
{
    const pm_pi_config_t c = fixed({1.0, 0.01});
    for (const int sign : {-1, 1}) {
        FixedPi pi = {c};
        for (int i = 0; i < 1000; ++i) {
            pi.step(sign * 2e-5, 0, 4);
        }
        EXPECT_NEAR(pi.state.integral * kWide, sign * 1000 * 0.01 * 2e-5, 1000 * kWide / 2) << sign;
        EXPECT_GT(sign * pi.state.integral, 0);
    }
    // No error, no drift.
    FixedPi pi = {c};
    for (int i = 0; i < 1000; ++i) {
        pi.step(0, 0, 4);
    }
    EXPECT_EQ(pi.state.integral, 0);
}

// Errors, feed-forward and limits that fight each other, at the documented ends; the sanitizers see an
// overflow.
TEST(MathPi, NoOverflowAtTheCorners)
{
    Random random;
    for (const double kp : {0.001, 1.0, 29.9}) {
        for (const double ratio : {0.001, 0.3, 1.0}) {
            FixedPi pi = {fixed({kp, kp * ratio})};
            for (int i = 0; i < 20000; ++i) {
                const auto corner = [&random] {
                    const int32_t x = random.word();
                    return (x & 3) == 0 ? x : (x < 0 ? INT32_MIN : INT32_MAX);
                };
                const pm_q_t e = corner(), ff = corner();
                const pm_wide_t top = (random.word() & INT32_MAX) >> 6; // 0 ... 8, coupled axes change it
                const pm_wide_t u = pm_pi_output(&pi.state, &pi.config, e, ff);
                pm_pi_update(&pi.state, &pi.config, e, pm_clamp(u, -top, top) - u);
                ASSERT_LE(std::abs(pi.state.integral * kWide), kIntegralBound) << kp << " " << ratio;
            }
        }
    }
}

} // namespace
