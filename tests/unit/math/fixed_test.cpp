#include "firmware/math/fixed.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "samples.h"

namespace
{

using samples::corners;
using samples::Random;
using samples::real;

// Half a unit of the last place that the product keeps, as fixed.h says.
constexpr double kMulError = 0x1p-25;
constexpr double kFracError = 0x1p-29;
constexpr double kUnitError = 0x1p-28;
constexpr double kGainError = 0x1p-23;
// An angle is rounded to 2^-29 turn, a radian to 2^-28; the constants are rounded as well.
constexpr double kToRadError = 0x1p-28;
constexpr double kToTurnError_rad = 0x1p-27;

constexpr int kRandomCount = 1000000;

constexpr double kFrac = 0x1p-32;
constexpr double kUnit = 0x1p-31;
constexpr double kGain = 0x1p-26;
constexpr double kWide = 0x1p-22;

int32_t wrapped(int64_t x)
{
    return static_cast<int32_t>(static_cast<uint32_t>(static_cast<uint64_t>(x)));
}

// a b / 2^32 rounded half up; long double holds the whole product.
int64_t rounded_product(int32_t a, int32_t b)
{
    return static_cast<int64_t>(std::floor(static_cast<long double>(a) * b / 4294967296.0L + 0.5L));
}

int64_t rounded_negative_product(int32_t a, int32_t b)
{
    return static_cast<int64_t>(std::floor(static_cast<long double>(a) * b / -4294967296.0L + 0.5L));
}

template <typename F> void for_pairs(F check)
{
    for (const int32_t a : corners()) {
        for (const int32_t b : corners()) {
            check(a, b);
        }
    }
    Random random;
    for (int i = 0; i < kRandomCount; ++i) {
        const int32_t a = random.any_size();
        check(a, random.any_size());
    }
}

// First failure only: a broken product fails at every pair.
#define CHECK_PAIR(expected, actual, a, b)                                                                   \
    do {                                                                                                     \
        if ((expected) != (actual)) {                                                                        \
            FAIL() << #actual << " of " << (a) << ", " << (b) << ": " << (actual) << ", not " << (expected); \
        }                                                                                                    \
    } while (false)

TEST(MathFixed, UpperProductIsRoundedExactly)
{
    for_pairs([](int32_t a, int32_t b) { CHECK_PAIR(rounded_product(a, b), pm_mulh(a, b), a, b); });
}

TEST(MathFixed, UpperProductFromHalvesIsTheSame) // that of ARMv6-M
{
    for_pairs([](int32_t a, int32_t b) {
        CHECK_PAIR(rounded_product(a, b), pm_mulh_halves(a, b, 0), a, b);
        CHECK_PAIR(-rounded_negative_product(a, b), pm_mulh_halves(a, b, 1), a, b);
    });
}

TEST(MathFixed, UpperProductAccumulatesAndWraps)
{
    Random random;
    for_pairs([&random](int32_t a, int32_t b) {
        const int32_t c = random.word();
        CHECK_PAIR(wrapped(c + rounded_product(a, b)), pm_mulh_add(c, a, b), a, b);
        CHECK_PAIR(wrapped(c + rounded_negative_product(a, b)), pm_mulh_sub(c, a, b), a, b);
        CHECK_PAIR(wrapped(rounded_product(a, b) + rounded_product(c, a)), pm_mulh2(a, b, c, a), a, b);
    });
}

TEST(MathFixed, ProductsKeepTheirStatedError)
{
    double mul = 0, frac = 0, unit = 0, gain = 0;
    for_pairs([&](int32_t x, int32_t y) {
        if (std::abs(real(x) * real(y)) < 8 - kMulError) {
            mul = std::max(mul, std::abs(real(pm_mul(x, y)) - real(x) * real(y)));
        }
        frac = std::max(frac, std::abs(real(pm_frac(x, y)) - real(x) * (y * kFrac)));
        if (real(x) * (y * kUnit) < 8 - kUnitError) {
            unit = std::max(unit, std::abs(real(pm_unit(x, y)) - real(x) * (y * kUnit)));
        }
        gain = std::max(gain, std::abs(pm_gain(x, y) * kWide - real(x) * (y * kGain)));
    });
    EXPECT_LE(mul, kMulError);
    EXPECT_LE(frac, kFracError);
    EXPECT_LE(unit, kUnitError);
    EXPECT_LE(gain, kGainError);
    // A format read wrongly by one bit would pass above only if it lost accuracy.
    EXPECT_GT(mul, kMulError / 2);
    EXPECT_GT(unit, kUnitError / 2);
}

TEST(MathFixed, ProductsHaveNoBias)
{
    Random random;
    double sum = 0;
    for (int i = 0; i < kRandomCount; ++i) {
        const int32_t x = random.word(), y = random.word();
        sum += real(pm_frac(x, y)) - real(x) * (y * kFrac);
    }
    // Truncation would give half an LSB, 2^-29; six standard deviations of the mean of uniform rounding
    // errors.
    EXPECT_LT(std::abs(sum / kRandomCount), 6 * 0x1p-28 / std::sqrt(12.0 * kRandomCount));
}

TEST(MathFixed, AccumulatingFormsAreSumAndProduct)
{
    for_pairs([](int32_t x, int32_t k) {
        const int32_t sum = x >> 2; // cannot wrap
        CHECK_PAIR(sum + pm_frac(x, k), pm_frac_add(sum, x, k), x, k);
        CHECK_PAIR(sum + pm_gain(x, k), pm_gain_add(sum, x, k), x, k);
    });
}

TEST(MathFixed, SaturatingProduct)
{
    for_pairs([](int32_t x, int32_t y) {
        const double exact = real(x) * real(y);
        const double limited = std::clamp(exact, -8.0, 8.0 - 0x1p-24);
        if (std::abs(real(pm_mul_sat(x, y)) - limited) > kMulError) {
            FAIL() << x << " " << y;
        }
    });
    EXPECT_EQ(pm_mul_sat(INT32_MIN, INT32_MIN), INT32_MAX - 15);
    EXPECT_EQ(pm_mul_sat(INT32_MIN, INT32_MAX), INT32_MIN);
}

TEST(MathFixed, SaturatingSums)
{
    for_pairs([](int32_t a, int32_t b) {
        const auto limited = [](int64_t x) { return std::clamp<int64_t>(x, INT32_MIN, INT32_MAX); };
        CHECK_PAIR(limited(int64_t{a} + b), pm_add_sat(a, b), a, b);
        CHECK_PAIR(limited(int64_t{a} - b), pm_sub_sat(a, b), a, b);
    });
}

TEST(MathFixed, Comparisons)
{
    for_pairs([](int32_t a, int32_t b) {
        CHECK_PAIR(std::min(a, b), pm_min(a, b), a, b);
        CHECK_PAIR(std::max(a, b), pm_max(a, b), a, b);
        const int32_t hi = std::max(b, -1000);
        CHECK_PAIR(std::clamp(a, -1000, hi), pm_clamp(a, -1000, hi), a, hi);
    });
}

TEST(MathFixed, SaturationToBits)
{
    for (const int32_t x : corners()) {
        for (unsigned n = 0; n <= 31; ++n) {
            const int64_t top = int64_t{1} << n;
            EXPECT_EQ(pm_sat(x, n), std::clamp<int64_t>(x, -top, top - 1)) << x << " to " << n;
        }
        EXPECT_EQ(pm_abs(x), std::min<int64_t>(std::abs(int64_t{x}), INT32_MAX));
        EXPECT_EQ(pm_magnitude(x), x == INT32_MIN ? x : std::abs(x));
    }
}

TEST(MathFixed, ZoneIsLinearToItsEdgesAndFlatBeyond)
{
    const double edge = 1 << PM_ZONE_BITS;
    Random random;
    for (const double height : {0.0, 0.3, 85.0, 8191.0, 262143.0}) {
        const auto h = static_cast<int32_t>(std::lround(std::ldexp(height, PM_HEIGHT_BITS)));
        for (int n = 0; n < 20000; ++n) {
            const int32_t x = random.word() >> (6 + n % 18); // below 2^26
            const double expected =
                height * std::clamp(x / edge, -1.0, 1 - std::ldexp(1 / edge, -PM_ZONE_LIFT));
            ASSERT_NEAR(pm_zone_add(1000, x, h) - 1000, expected, 0.501) << x;
            ASSERT_NEAR(pm_zone_sub(1000, x, h) - 1000, -expected, 0.501) << x;
        }
    }
}

TEST(MathFixed, SaturationOfWhatIsShifted)
{
    for (const int32_t x : corners()) {
        for (const unsigned n : {3U, 19U, 30U}) {
            const int64_t top = int64_t{1} << n;
            EXPECT_EQ(pm_shl_sat(x >> 5, 5, n), std::clamp<int64_t>(int64_t{x >> 5} * 32, -top, top - 1))
                << x;
            EXPECT_EQ(pm_sat_positive(x, n), std::clamp<int64_t>(x, 0, top - 1)) << x << " to " << n;
        }
    }
}

TEST(MathFixed, ShareOfAWhole)
{
    Random random;
    for (const int32_t whole : {1, 200, 4250, 32767}) {
        EXPECT_EQ(pm_share_of(INT32_MIN, pm_share_whole(whole)), 0);
        EXPECT_EQ(pm_share_of(INT32_MAX, pm_share_whole(whole)), whole);
        EXPECT_EQ(pm_share_of(1 << PM_SHARE_BITS, pm_share_whole(whole)), whole);
        for (int n = 0; n < 5000; ++n) {
            const int32_t share = random.word() >> 10; // -2 ... 2
            const double expected = whole * std::clamp(share * 0x1p-20, 0.0, 1 - 0x1p-20);
            ASSERT_NEAR(pm_share_of(share, pm_share_whole(whole)), expected, 0.5) << share;
        }
    }
}

// Of one and beyond: the largest unit, not the smallest number. All numbers with the next 12 bits around a change.
TEST(MathFixed, AShareOfOneIsNoNegativeUnit)
{
    const auto check = [](int32_t share) {
        const double within = std::clamp(share * 0x1p-20, 0.0, 1 - 0x1p-20);
        ASSERT_EQ(pm_share_to_unit(share) * 0x1p-31, within) << share;
    };
    for (int32_t share = -(1 << 22); share <= 1 << 22; ++share) {
        check(share);
    }
    for (int64_t share = INT32_MIN; share <= INT32_MAX; share += 4095) {
        check(int32_t(share));
    }
    for (const int32_t x : corners()) {
        check(x);
    }
}

// A vector times a share that a reciprocal has left a little beyond one keeps its sign and its size.
TEST(MathFixed, TimesAShareUpToTwo)
{
    Random random;
    for (int32_t share = 0; share < 1 << 21; share += 7) {
        for (const int32_t x : {1 << 27, -(1 << 27), random.word() >> 2}) {
            ASSERT_NEAR(pm_times_share(x, share), x * (share * 0x1p-20), 2.0) << x << ' ' << share;
        }
    }
    EXPECT_EQ(pm_times_share(PM_ONE, 1 << PM_SHARE_BITS), PM_ONE);
    EXPECT_EQ(pm_times_share(-PM_ONE, 1 << PM_SHARE_BITS), -PM_ONE);
}

TEST(MathFixed, WideAndBack)
{
    for (const int32_t x : corners()) {
        EXPECT_EQ(pm_widen(x), std::floor(real(x) / kWide)) << x;
        EXPECT_EQ(real(pm_narrow_sat(x)), std::clamp(x * kWide, -8.0, 8.0 - kWide)) << x;
        if (std::abs(x * kWide) < 8) {
            EXPECT_EQ(real(pm_narrow(x)), x * kWide) << x;
        }
    }
}

TEST(MathFixed, ShiftLeft)
{
    for (const int32_t x : corners()) {
        for (unsigned n = 0; n < 32; ++n) {
            EXPECT_EQ(pm_shl(x, n), wrapped(static_cast<int64_t>(static_cast<uint64_t>(int64_t{x}) << n)));
        }
    }
}

TEST(MathFixed, AngleDifferenceIsTheShortWayRound)
{
    EXPECT_EQ(pm_angle_diff(1U, UINT32_MAX), 2);
    EXPECT_EQ(pm_angle_diff(UINT32_MAX, 1U), -2);
    EXPECT_EQ(pm_angle_diff(PM_TURN(0.75), PM_TURN(0.25)), INT32_MIN);
    EXPECT_EQ(pm_angle_diff(PM_TURN(0.125), PM_TURN(0.875)), 1 << 30);
}

TEST(MathFixed, RadiansAndTurns)
{
    const double turn = 2 * M_PI * 0x1p-32;
    double to_rad = 0, to_turn = 0;
    const auto check = [&](int32_t x) {
        to_rad = std::max(to_rad, std::abs(real(pm_angle_to_rad(x)) - x * turn));
        // Compared as directions, so that +-pi may come out on either side.
        const double back = pm_rad_to_angle(x) * turn - real(x);
        to_turn = std::max(to_turn, std::abs(std::remainder(back, 2 * M_PI)));
    };
    for (const int32_t x : corners()) {
        check(x);
    }
    Random random;
    for (int i = 0; i < kRandomCount; ++i) {
        check(random.any_size());
    }
    EXPECT_LE(to_rad, kToRadError);
    EXPECT_LE(to_turn, kToTurnError_rad);
    EXPECT_NEAR(pm_rad_to_angle(samples::q(M_PI / 2)), 1 << 30, 8);
}

TEST(MathFixed, Literals)
{
    EXPECT_EQ(PM_Q(1.0), PM_ONE);
    EXPECT_EQ(PM_Q(-0.3), std::lround(-0.3 * 0x1p28));
    EXPECT_EQ(PM_FRAC(-0.5), INT32_MIN);
    EXPECT_EQ(PM_FRAC(0.1), std::lround(0.1 * 0x1p32));
    EXPECT_EQ(PM_UNIT(1.0), INT32_MAX);
    EXPECT_EQ(PM_UNIT(-1.0), -INT32_MAX);
    EXPECT_EQ(PM_GAIN(31.5), std::lround(31.5 * 0x1p26));
    EXPECT_EQ(PM_WIDE(-500.0), -500 * (1 << 22));
    EXPECT_EQ(PM_TURN(0.5), 0x80000000U);
}

} // namespace
