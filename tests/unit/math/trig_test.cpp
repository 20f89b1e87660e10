#include "firmware/math/trig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "samples.h"

namespace
{

// trig.h: (pi/128)^3 / 24 = 6.2e-7 of the cubic term, shared out evenly, and roundings.
constexpr double kDirError = 7e-7;
constexpr double kLengthError = 1e-7;
// trig.h: polynomial 1.2e-5 rad, divisor and quotient cut to 16 bits 1.5e-5 each with opposite signs.
constexpr double kAtanError_deg = 0.0018;

constexpr double kTurn = 2 * M_PI * 0x1p-32;
constexpr uint32_t kStride = 3571; // prime: every table cell is hit at different places

struct Worst {
    double cos = 0, sin = 0, length = 0;
    int32_t lowest = 0;
};

void add(Worst &worst, pm_angle_t angle)
{
    const pm_dir_t r = pm_dir(angle);
    const double c = r.cos * 0x1p-31, s = r.sin * 0x1p-31;
    worst.cos = std::max(worst.cos, std::abs(c - std::cos(angle * kTurn)));
    worst.sin = std::max(worst.sin, std::abs(s - std::sin(angle * kTurn)));
    worst.length = std::max(worst.length, std::abs(std::hypot(c, s) - 1));
    worst.lowest = std::min({worst.lowest, r.cos, r.sin});
}

void expect_within_limits(const Worst &worst)
{
    EXPECT_LE(worst.cos, kDirError);
    EXPECT_LE(worst.sin, kDirError);
    EXPECT_LE(worst.length, kLengthError);
    EXPECT_GT(worst.lowest, INT32_MIN);
}

TEST(MathTrig, DirectionOverTheWholeTurn)
{
    Worst worst;
    for (uint64_t angle = 0; angle < (uint64_t{1} << 32); angle += kStride) {
        add(worst, static_cast<pm_angle_t>(angle));
    }
    expect_within_limits(worst);
    RecordProperty("cos_error", std::to_string(worst.cos));
}

TEST(MathTrig, DirectionAroundTableEntriesAndCellBorders)
{
    Worst worst;
    for (uint32_t cell = 0; cell < 256; ++cell) {
        for (uint32_t near = 0; near < 2000; ++near) {
            add(worst, (cell << 24) + near - 1000U);
        }
    }
    expect_within_limits(worst);
}

TEST(MathTrig, DirectionIsExactOnTheAxes)
{
    const pm_dir_t east = pm_dir(0), north = pm_dir(PM_TURN(0.25)), west = pm_dir(PM_TURN(0.5));
    EXPECT_EQ(east.cos, PM_UNIT_MAX);
    EXPECT_EQ(east.sin, 0);
    EXPECT_EQ(north.cos, 0);
    EXPECT_EQ(north.sin, PM_UNIT_MAX);
    EXPECT_EQ(west.cos, -PM_UNIT_MAX);
    EXPECT_EQ(west.sin, 0);
    EXPECT_EQ(pm_dir(PM_TURN(0.75)).sin, -PM_UNIT_MAX);
}

TEST(MathTrig, TableIsWhatItsGeneratorPromises)
{
    for (int k = 0; k < 128; ++k) {
        const auto q31 = [](double x) {
            return std::clamp<double>(std::nearbyint(x * 0x1p31), -INT32_MAX, INT32_MAX);
        };
        EXPECT_EQ(pm_dir_table[k].first, q31(std::cos(k * M_PI / 64))) << k;
        EXPECT_EQ(pm_dir_table[k].second, q31(std::sin(k * M_PI / 64))) << k;
    }
}

double atan_error_deg(int32_t y, int32_t x)
{
    const double difference = pm_atan2(y, x) * kTurn - std::atan2(static_cast<double>(y), x);
    return std::abs(std::remainder(difference, 2 * M_PI)) * 180 / M_PI;
}

TEST(MathTrig, ArctangentOverTheWholeTurnAndEveryMagnitude)
{
    double worst = 0;
    for (double length = 1.5; length < 0x1p31; length *= 2.7) {
        for (int k = 0; k < 20000; ++k) {
            const double angle = k * 2 * M_PI / 20000;
            const auto x = static_cast<int32_t>(length * std::cos(angle));
            const auto y = static_cast<int32_t>(length * std::sin(angle));
            if (x != 0 || y != 0) {
                worst = std::max(worst, atan_error_deg(y, x));
            }
        }
    }
    EXPECT_LE(worst, kAtanError_deg);
}

TEST(MathTrig, ArctangentAtCornersAndRandomPairs)
{
    double worst = 0;
    for (const int32_t y : samples::corners()) {
        for (const int32_t x : samples::corners()) {
            if (x != 0 || y != 0) {
                worst = std::max(worst, atan_error_deg(y, x));
            }
        }
    }
    samples::Random random;
    for (int i = 0; i < 1000000; ++i) {
        const int32_t y = random.any_size(), x = random.any_size();
        if (x != 0 || y != 0) {
            worst = std::max(worst, atan_error_deg(y, x));
        }
    }
    EXPECT_LE(worst, kAtanError_deg);
}

TEST(MathTrig, ArctangentOnTheAxesAndAtZero)
{
    EXPECT_EQ(pm_atan2(0, 0), 0U);
    EXPECT_EQ(pm_atan2(0, 5), 0U);
    EXPECT_EQ(pm_atan2(5, 0), PM_TURN(0.25));
    EXPECT_EQ(pm_atan2(0, -5), PM_TURN(0.5));
    EXPECT_EQ(pm_atan2(-5, 0), PM_TURN(0.75));
    EXPECT_EQ(pm_atan2(INT32_MIN, 0), PM_TURN(0.75));
    EXPECT_EQ(pm_atan2(0, INT32_MIN), PM_TURN(0.5));
}

TEST(MathTrig, ArctangentUndoesDirection)
{
    for (uint64_t angle = 0; angle < (uint64_t{1} << 32); angle += 1048573) {
        const auto exact = static_cast<pm_angle_t>(angle);
        const pm_dir_t r = pm_dir(exact);
        const double difference_deg = pm_angle_diff(pm_atan2(r.sin, r.cos), exact) * kTurn * 180 / M_PI;
        ASSERT_LE(std::abs(difference_deg), kAtanError_deg + kDirError * 180 / M_PI) << angle;
    }
}

} // namespace
