#include "firmware/math/root.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "samples.h"

namespace
{

using samples::corners;
using samples::Random;
using samples::real;

// root.h.
constexpr double kSqrtError = 0x1p-25;
constexpr double kHypotRelative = 1.1e-8;
constexpr double kDivRelative = 1e-8;
constexpr double kHalfLsb = 0x1p-29;
constexpr double kRatioLow = -0x1p-16;
constexpr double kRatioHigh = 0x1p-15;
constexpr double kPerVolt = 0x1p-16; // times v + 1 / v

constexpr int kCount = 1000000;
const double kLargest = real(INT32_MAX);

TEST(MathRoot, SquareRootOverTheWholeRange)
{
    double worst = 0;
    const auto check = [&worst](pm_q_t x) {
        worst = std::max(worst, std::abs(real(pm_sqrt(x)) - std::sqrt(real(x))));
    };
    for (int64_t x = 0; x <= INT32_MAX; x += 1021) {
        check(static_cast<pm_q_t>(x));
    }
    for (const int32_t x : corners()) {
        check(std::max(x, 0));
    }
    for (pm_q_t x = 0; x < 300000; ++x) {
        check(x);
    }
    EXPECT_LE(worst, kSqrtError);
}

TEST(MathRoot, SquareRootOfSquares)
{
    EXPECT_EQ(pm_sqrt(0), 0);
    EXPECT_EQ(pm_sqrt(INT32_MIN), 0);
    EXPECT_EQ(pm_sqrt(-1), 0);
    EXPECT_EQ(pm_sqrt(1), 1 << 14);
    EXPECT_NEAR(pm_sqrt(PM_ONE), PM_ONE, 4);
    EXPECT_NEAR(pm_sqrt(PM_Q(4.0)), PM_Q(2.0), 4);
    EXPECT_NEAR(pm_sqrt(PM_Q(0.25)), PM_Q(0.5), 4);
}

TEST(MathRoot, WideRootOfASquare)
{
    for (int64_t x = 0; x <= INT32_MAX; x += 1021) {
        const double exact = std::sqrt(static_cast<double>(x) * 0x1p-24);
        const double actual = pm_sqrt_wide(static_cast<int32_t>(x)) * 0x1p-22;
        ASSERT_LE(actual, exact * (1 + 1e-8)) << x;
        ASSERT_GE(actual, exact * (1 - 1e-8) - 0x1p-22) << x;
    }
    EXPECT_EQ(pm_sqrt_wide(-1), 0);
    EXPECT_EQ(pm_sqrt_wide(1), 1 << 10);
}

double hypot_excess(int32_t x, int32_t y)
{
    const double exact = std::min(std::hypot(real(x), real(y)), kLargest);
    return std::abs(real(pm_hypot(x, y)) - exact) - kHypotRelative * exact;
}

TEST(MathRoot, Length)
{
    double worst = 0;
    for (const int32_t x : corners()) {
        for (const int32_t y : corners()) {
            worst = std::max(worst, hypot_excess(x, y));
        }
    }
    Random random;
    for (int i = 0; i < kCount; ++i) {
        const int32_t x = random.any_size();
        worst = std::max(worst, hypot_excess(x, random.any_size()));
    }
    for (double length = 3; length < 0x1p31; length *= 1.7) { // both parts alike in size
        for (double angle = 0; angle < 7; angle += 0.001) {
            worst = std::max(worst, hypot_excess(static_cast<int32_t>(length * std::cos(angle)),
                                                 static_cast<int32_t>(length * std::sin(angle))));
        }
    }
    EXPECT_LE(worst, kHalfLsb);
}

TEST(MathRoot, LengthSaturates)
{
    EXPECT_EQ(pm_hypot(INT32_MIN, INT32_MIN), INT32_MAX);
    EXPECT_EQ(pm_hypot(INT32_MAX, INT32_MAX), INT32_MAX);
    EXPECT_EQ(pm_hypot(PM_Q(7.0), PM_Q(-7.0)), INT32_MAX);
    EXPECT_NEAR(pm_hypot(0, INT32_MIN), INT32_MAX, 22); // 1e-8 of it
    EXPECT_EQ(pm_hypot(0, 0), 0);
    EXPECT_EQ(pm_hypot(3, -4), 5);
}

double div_excess(int32_t num, int32_t x)
{
    const double exact = std::clamp(real(num) / real(x), -kLargest, kLargest);
    return std::abs(real(pm_div(num, x)) - exact) - kDivRelative * std::abs(exact);
}

TEST(MathRoot, Quotient)
{
    double worst = 0;
    for (const int32_t num : corners()) {
        for (const int32_t x : corners()) {
            if (x > 0) {
                worst = std::max(worst, div_excess(num, x));
            }
        }
    }
    Random random;
    for (int i = 0; i < kCount; ++i) {
        const int32_t num = random.any_size(), x = random.any_size() & INT32_MAX;
        if (x > 0) {
            worst = std::max(worst, div_excess(num, x));
        }
    }
    for (int32_t x = PM_ONE / 100; x < INT32_MAX - 1000000; x += 104729) {
        worst = std::max(worst, div_excess(PM_ONE, x));
    }
    EXPECT_LE(worst, kHalfLsb);
}

TEST(MathRoot, QuotientOutsideItsRange)
{
    for (const int32_t x : {0, -1, INT32_MIN}) {
        EXPECT_EQ(pm_div(PM_ONE, x), INT32_MAX);
        EXPECT_EQ(pm_div(-PM_ONE, x), -INT32_MAX);
        EXPECT_EQ(pm_div(0, x), 0);
    }
    EXPECT_EQ(pm_div(INT32_MIN, 1), -INT32_MAX);
    EXPECT_EQ(pm_div(PM_ONE, PM_ONE / 9), INT32_MAX);
}

TEST(MathRoot, RatioOfParts)
{
    double low = 0, high = 0;
    const auto check = [&](int32_t num, int32_t den) {
        const double error = pm_ratio(num, den) * 0x1p-31 - static_cast<double>(num) / den;
        low = std::min(low, error);
        high = std::max(high, error);
    };
    for (const int32_t num : corners()) {
        for (const int32_t den : corners()) {
            if (num >= 0 && den > 0 && num <= den) {
                check(num, den);
            }
        }
    }
    Random random;
    for (int i = 0; i < kCount; ++i) {
        const int32_t a = random.any_size() & INT32_MAX, b = random.any_size() & INT32_MAX;
        if (std::max(a, b) > 0) {
            check(std::min(a, b), std::max(a, b));
        }
    }
    EXPECT_GE(low, kRatioLow);
    EXPECT_LE(high, kRatioHigh);
    EXPECT_EQ(pm_ratio(PM_ONE, PM_ONE), PM_UNIT_MAX);
    EXPECT_EQ(pm_ratio(0, 1), 0);
}

TEST(MathRoot, PerVolt)
{
    for (double v = 1 / 16.0; v < 7.999; v *= 1.0007) {
        const auto x = static_cast<pm_q_t>(v * 0x1p28);
        const double exact = 0x1p24 / real(x);
        ASSERT_NEAR(pm_per_volt(x), exact, exact * kPerVolt * (v + 1 / v)) << v;
        // The voltage itself is all of the period.
        ASSERT_NEAR(pm_mulh(x, pm_per_volt(x)), 0x1p20, 0x1p20 * kPerVolt * (v + 1 / v) + 0.5) << v;
    }
    EXPECT_GT(pm_per_volt(PM_ONE / 16), 0);
}

TEST(MathRoot, RootTwiceHasTheShapeOfTheRoot)
{
    for (double x = 1; x < 0x1p31; x *= 1.003) {
        const auto whole = static_cast<int32_t>(x);
        const double exact = 2 * std::sqrt(static_cast<double>(whole));
        const double actual = pm_root_twice(whole);
        ASSERT_GE(actual, exact - 1) << whole; // what the shift cuts
        ASSERT_LE(actual, 1.061 * exact) << whole;
    }
    EXPECT_EQ(pm_root_twice(0), 1);
}

} // namespace
