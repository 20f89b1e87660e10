#include "firmware/math/num.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "samples.h"

namespace
{

using samples::corners;
using samples::Random;

// Half a unit of the last of 31 places, and a quarter of that for the quotient that was cut before.
constexpr long double kRelative = 0x1.4p-31L;
constexpr int kCount = 1000000;

long double value(pm_num_t x)
{
    return std::ldexp(static_cast<long double>(x.m), x.e);
}

bool normal(pm_num_t x)
{
    const int64_t m = std::abs(int64_t{x.m});
    return x.m == 0 ? x.e == 0 : m >= int64_t{1} << 30 && m < int64_t{1} << 31;
}

class Worst
{
  public:
    void add(pm_num_t result, long double exact)
    {
        abnormal_ += normal(result) ? 0 : 1;
        const long double error = std::abs(value(result) - exact);
        relative_ = std::max(relative_, exact == 0 ? error : error / std::abs(exact));
    }
    ~Worst()
    {
        EXPECT_LE(relative_, kRelative);
        EXPECT_EQ(abnormal_, 0);
    }

  private:
    long double relative_ = 0;
    int abnormal_ = 0;
};

pm_num_t random_num(Random &random)
{
    const auto e = static_cast<int32_t>(random.within(-60, 60));
    pm_num_t x = pm_num(random.any_size());
    x.e += x.m == 0 ? 0 : e;
    return x;
}

TEST(MathNum, IntegersAreExact)
{
    for (const int32_t x : corners()) {
        EXPECT_EQ(value(pm_num(x)), x);
        EXPECT_TRUE(normal(pm_num(x))) << x;
    }
}

// The compiler makes what the functions would.
TEST(MathNum, ConstantsAreTheSameBits)
{
    for (const int32_t x : corners()) {
        if (x <= 0) {
            continue;
        }
        EXPECT_EQ(pm_num_word(pm_num_constant(x)), pm_num_word_int(x)) << x;
        for (const int32_t y : corners()) {
            if (y > 0) {
                EXPECT_EQ(pm_num_word(pm_num_constant_ratio(x, y)), pm_num_word_ratio(x, y)) << x << "/" << y;
            }
        }
    }
    Random random;
    for (int i = 0; i < kCount; ++i) {
        const int32_t x = random.any_size() & INT32_MAX, y = random.any_size() & INT32_MAX;
        if (x > 0 && y > 0) {
            ASSERT_EQ(pm_num_word(pm_num_constant_ratio(x, y)), pm_num_word_ratio(x, y)) << x << "/" << y;
        }
    }
}

// INT32_MIN and INT32_MAX have 31 significant bits as well; nothing is rounded there.
TEST(MathNum, DecimalsAreRoundedOnce)
{
    Worst worst;
    for (const int32_t x : corners()) {
        for (int n = -12; n <= 12; ++n) {
            worst.add(pm_num_dec(x, n), x * std::pow(10.0L, n));
        }
    }
    EXPECT_EQ(value(pm_num_dec(1000, -3)), 1);
    EXPECT_EQ(value(pm_num_dec(7, 13)), 0);
    EXPECT_EQ(value(pm_num_dec(7, -13)), 0);
}

TEST(MathNum, ProductsAndQuotients)
{
    Worst worst;
    Random random;
    for (int i = 0; i < kCount; ++i) {
        const pm_num_t a = random_num(random), b = random_num(random);
        worst.add(pm_num_mul(a, b), value(a) * value(b));
        if (b.m != 0) {
            worst.add(pm_num_div(a, b), value(a) / value(b));
        }
    }
    for (const int32_t a : corners()) {
        for (const int32_t b : corners()) {
            worst.add(pm_num_mul(pm_num(a), pm_num(b)), static_cast<long double>(a) * b);
            worst.add(pm_num_ratio(a, b), b == 0 ? 0 : static_cast<long double>(a) / b);
        }
    }
}

TEST(MathNum, SumsAndDifferences)
{
    Worst worst;
    Random random;
    for (int i = 0; i < kCount; ++i) {
        const pm_num_t a = random_num(random);
        pm_num_t b = random_num(random);
        if (i % 2 == 0 && b.m != 0) { // near in size, so that leading bits cancel
            b.e = a.e + random.word() % 3;
        }
        // long double holds 64 bits; beyond 33 places apart it would itself round.
        if (std::abs(a.e - b.e) <= 33 || a.m == 0 || b.m == 0) {
            worst.add(pm_num_add(a, b), value(a) + value(b));
            worst.add(pm_num_sub(a, b), value(a) - value(b));
        } else {
            EXPECT_NEAR(static_cast<double>(value(pm_num_add(a, b)) / (value(a) + value(b))), 1, 0x1p-30);
        }
    }
}

TEST(MathNum, SquareRoots)
{
    Worst worst;
    Random random;
    for (int i = 0; i < kCount; ++i) {
        const pm_num_t a = random_num(random);
        worst.add(pm_num_sqrt(a), a.m > 0 ? std::sqrt(value(a)) : 0);
    }
    for (const int32_t x : corners()) {
        worst.add(pm_num_sqrt(pm_num(x)), x > 0 ? std::sqrt(static_cast<long double>(x)) : 0);
    }
    EXPECT_EQ(value(pm_num_sqrt(pm_num(144))), 12);
    EXPECT_EQ(value(pm_num_sqrt(pm_num_dec(625, -4))), 0.25L);
}

TEST(MathNum, ComparisonsAndSigns)
{
    Random random;
    for (int i = 0; i < kCount / 10; ++i) {
        const pm_num_t a = random_num(random), b = random_num(random);
        const long double x = value(a), y = value(b);
        ASSERT_EQ(pm_num_cmp(a, b), (x > y) - (x < y));
        ASSERT_EQ(pm_num_cmp(a, a), 0);
        ASSERT_EQ(value(pm_num_neg(a)), -x);
    }
}

TEST(MathNum, ZeroIsHandledEverywhere)
{
    const pm_num_t zero = pm_num(0), three = pm_num(3);
    EXPECT_EQ(value(pm_num_add(zero, three)), 3);
    EXPECT_EQ(value(pm_num_sub(zero, three)), -3);
    EXPECT_TRUE(normal(pm_num_sub(three, three)));
    EXPECT_EQ(value(pm_num_mul(zero, three)), 0);
    EXPECT_EQ(value(pm_num_div(three, zero)), 0);
    EXPECT_EQ(value(pm_num_div(zero, three)), 0);
    EXPECT_EQ(value(pm_num_sqrt(zero)), 0);
    EXPECT_EQ(value(pm_num_sqrt(pm_num(-4))), 0);
    EXPECT_EQ(pm_num_cmp(zero, zero), 0);
    EXPECT_EQ(value(pm_num_dec(0, -12)), 0);
    int32_t out = 1;
    EXPECT_TRUE(pm_num_to_fixed(zero, 100000, &out));
    EXPECT_EQ(out, 0);
}

TEST(MathNum, ToFixedRoundsOrSaturates)
{
    Random random;
    for (int i = 0; i < kCount; ++i) {
        const pm_num_t a = random_num(random);
        const int frac_bits = static_cast<int>(random.within(-10, 60));
        const long double exact = std::ldexp(value(a), frac_bits), rounded = std::round(exact);
        int32_t out = 0;
        const bool fits = pm_num_to_fixed(a, frac_bits, &out);
        ASSERT_EQ(fits, rounded >= INT32_MIN && rounded <= INT32_MAX)
            << a.m << " " << a.e << " " << frac_bits;
        ASSERT_EQ(out, std::clamp<long double>(rounded, INT32_MIN, INT32_MAX));
    }
}

// Exact but for the last rounding, at any shift.
TEST(MathNum, TimesRoundsOnceOrSaturates)
{
    Random random;
    for (int i = 0; i < kCount; ++i) {
        const int32_t x = random.any_size();
        const pm_num_t unit = random_num(random);
        const int frac_bits = static_cast<int>(random.within(-10, 60));
        const long double exact = std::ldexp(static_cast<long double>(x) * value(unit), frac_bits);
        const long double rounded = std::floor(exact + 0.5L);
        ASSERT_EQ(pm_num_times(x, unit, frac_bits), std::clamp<long double>(rounded, INT32_MIN, INT32_MAX))
            << x << " times " << unit.m << " " << unit.e << ", " << frac_bits;
    }
    for (const int32_t x : corners()) {
        EXPECT_EQ(pm_num_times(x, pm_num(1), 0), x);
        EXPECT_EQ(pm_num_times(x, pm_num(0), 28), 0);
        EXPECT_EQ(pm_num_times(0, pm_num(x), 60), 0);
    }
}

TEST(MathNum, FromFixedAndBack)
{
    for (const int32_t x : corners()) {
        for (const int frac_bits : {0, 22, 28, 32}) {
            EXPECT_EQ(value(pm_num_from_fixed(x, frac_bits)),
                      std::ldexp(static_cast<long double>(x), -frac_bits));
            int32_t back = 0;
            EXPECT_TRUE(pm_num_to_fixed(pm_num_from_fixed(x, frac_bits), frac_bits, &back));
            EXPECT_EQ(back, x);
        }
    }
}

TEST(MathNum, QuotientIsThatOfC)
{
    std::mt19937_64 random(7);
    std::vector<int64_t> nums = {0, 1, -1, INT64_MAX, INT64_MIN, INT64_MIN + 1, INT64_C(1) << 32};
    for (int k = 0; k < 2000; ++k) {
        nums.push_back(static_cast<int64_t>(random()) >> (k % 60));
    }
    for (const int64_t num : nums) {
        std::vector<int32_t> dens = corners();
        for (int k = 0; k < 32; ++k) {
            dens.push_back(static_cast<int32_t>(static_cast<uint32_t>(random()) >> k));
        }
        for (const int32_t den : dens) {
            if (den == 0) {
                EXPECT_EQ(pm_quotient(num, den), 0);
            } else if (den != -1 || num != INT64_MIN) {
                ASSERT_EQ(pm_quotient(num, den), num / den) << num << " / " << den;
            }
        }
    }
}

TEST(MathNum, TwoPi)
{
    EXPECT_NEAR(std::ldexp(1686629713.0, -28), 2 * M_PI, 2 * M_PI * 0x1p-30);
}

} // namespace
