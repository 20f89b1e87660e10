#include "firmware/math/frames.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "firmware/math/pair.h"
#include "firmware/math/trig.h"
#include "samples.h"

namespace
{

using samples::q;
using samples::Random;
using samples::real;

// Errors in LSB of Q28. One rounding and the constant's own rounding.
constexpr double kClarkeError = 1;
// The halved alpha is cut, not rounded; c carries the errors of the other two.
constexpr double kClarkeInverseError = 2;
// Two roundings at Q27, and half an LSB of direction.
constexpr double kParkError = 3;
// METHODS.md 1.3.1.2 and 1.3.1.3 allow 2 LSB of Q15, which is 16384 of these.
constexpr double kRoundTripError = 4;
// pm_dir() has 7e-7 per component; turning by it and back loses its length error once more.
constexpr double kTurnRoundTripError = 1.4e-6;

// 3/40 x^5, the term that is left out, at 0.2.
constexpr double kTurnError = 2.5e-5;

constexpr double kPhaseRange = 2.6;
constexpr double kInverseRange = 4.0;
constexpr double kVectorRange = 7.999;
constexpr int kCount = 500000;

const double kRoot3 = std::sqrt(3.0);
const Eigen::Matrix<double, 2, 3> kClarke =
    (Eigen::Matrix<double, 2, 3>() << 2 / 3.0, -1 / 3.0, -1 / 3.0, 0, 1 / kRoot3, -1 / kRoot3).finished();
const Eigen::Matrix<double, 3, 2> kClarkeInverse =
    (Eigen::Matrix<double, 3, 2>() << 1, 0, -0.5, kRoot3 / 2, -0.5, -kRoot3 / 2).finished();

Eigen::Vector3d vector(pm_abc_t x)
{
    return {real(x.a), real(x.b), real(x.c)};
}
Eigen::Vector2d vector(pm_ab_t x)
{
    return {real(x.alpha), real(x.beta)};
}
Eigen::Vector2d vector(pm_dq_t x)
{
    return {real(x.d), real(x.q)};
}

double lsb(double error)
{
    return error * 0x1p28;
}

template <typename F> void for_abc(F check)
{
    for (int i = 0; i < 27; ++i) { // every corner of the cube
        const auto at = [](int k) { return q((k % 3 - 1) * kPhaseRange); };
        check(pm_abc_t{at(i), at(i / 3), at(i / 9)});
    }
    Random random;
    const auto any = [&random] { return q(random.within(-kPhaseRange, kPhaseRange)); };
    for (int i = 0; i < kCount; ++i) {
        const pm_q_t a = any(), b = any();
        check(pm_abc_t{a, b, any()});
    }
}

template <typename F> void for_vectors(double range, F check)
{
    for (const int32_t x : samples::corners()) {
        if (std::abs(real(x)) < range) {
            check(pm_ab_t{x, 0});
            check(pm_ab_t{0, x});
        }
    }
    Random random;
    for (int i = 0; i < kCount; ++i) {
        const double length = random.within(0, range), angle = random.within(-M_PI, M_PI);
        check(pm_ab_t{q(length * std::cos(angle)), q(length * std::sin(angle))});
    }
}

// A direction rounded to Q31 and its exact value.
pm_dir_t exact_dir(double angle)
{
    const auto unit = [](double x) { return static_cast<pm_unit_t>(std::lround(x * INT32_MAX)); };
    return {unit(std::cos(angle)), unit(std::sin(angle))};
}

TEST(MathFrames, ClarkeAgainstMatrix)
{
    double worst = 0;
    for_abc([&](pm_abc_t x) {
        worst = std::max(worst, (vector(pm_clarke(x)) - kClarke * vector(x)).lpNorm<Eigen::Infinity>());
    });
    EXPECT_LE(lsb(worst), kClarkeError);
}

TEST(MathFrames, ClarkeDropsCommonPart)
{
    for (const double common : {-2.5, -1.0, 0.3, 2.5}) {
        const pm_ab_t r = pm_clarke({q(common), q(common), q(common)});
        EXPECT_LE(std::abs(r.alpha), 1) << common;
        EXPECT_EQ(r.beta, 0) << common;
    }
}

TEST(MathFrames, ClarkeInverseAgainstMatrixAndSumsToZero)
{
    double worst = 0;
    for_vectors(kInverseRange, [&](pm_ab_t x) {
        const pm_abc_t r = pm_clarke_inverse(x);
        worst = std::max(worst, (vector(r) - kClarkeInverse * vector(x)).lpNorm<Eigen::Infinity>());
        ASSERT_EQ(r.a + r.b + r.c, 0);
    });
    EXPECT_LE(lsb(worst), kClarkeInverseError);
}

TEST(MathFrames, ClarkeRoundTrip)
{
    double worst = 0;
    for_vectors(kPhaseRange, [&](pm_ab_t x) {
        const pm_ab_t back = pm_clarke(pm_clarke_inverse(x));
        worst = std::max(worst, (vector(back) - vector(x)).lpNorm<Eigen::Infinity>());
    });
    EXPECT_LE(lsb(worst), kRoundTripError);
}

TEST(MathFrames, ParkAgainstRotation)
{
    double forward = 0, backward = 0;
    Random random;
    for_vectors(kVectorRange, [&](pm_ab_t x) {
        const double angle = random.within(-M_PI, M_PI);
        const Eigen::Rotation2Dd turn(angle);
        const pm_dir_t r = exact_dir(angle);
        // An even rounding error of the direction counts in proportion to the vector, so allow for it.
        const double slack = vector(x).norm() * 0x1p-31;
        const Eigen::Vector2d d = vector(pm_park(x, r)) - turn.inverse() * vector(x);
        forward = std::max(forward, d.lpNorm<Eigen::Infinity>() - slack);
        const Eigen::Vector2d e = vector(pm_park_inverse({x.alpha, x.beta}, r)) - turn * vector(x);
        backward = std::max(backward, e.lpNorm<Eigen::Infinity>() - slack);
    });
    EXPECT_LE(lsb(forward), kParkError);
    EXPECT_LE(lsb(backward), kParkError);
}

// The forms without their shifts: the factors that the headers state, to the rounding of the products.
TEST(MathFrames, ScaledFormsAreTheTransforms)
{
    double half = 0, quarter = 0;
    Random random;
    for_vectors(1.9, [&](pm_ab_t x) {
        const double a = random.within(-M_PI, M_PI), b = random.within(-M_PI, M_PI);
        const pm_dir_t dir = exact_dir(a);
        const Eigen::Vector2d d = vector(pm_park_half(x, dir)) - Eigen::Rotation2Dd(-a) * vector(x) / 2;
        half = std::max(half, d.lpNorm<Eigen::Infinity>());
        const pm_half_dir_t sum = pm_dir_sum(dir, exact_dir(b));
        const Eigen::Vector2d e = vector(pm_park_inverse_quarter({x.alpha, x.beta}, sum)) -
                                  Eigen::Rotation2Dd(a + b) * vector(x) / 4;
        quarter = std::max(quarter, e.lpNorm<Eigen::Infinity>());
    });
    EXPECT_LE(lsb(half), kParkError / 2);
    EXPECT_LE(lsb(quarter), kParkError / 2);
}

TEST(MathFrames, ParkAtTheAxes)
{
    const pm_ab_t x = {q(1.5), q(-0.5)};
    const double near = 4 * 0x1p-28;
    const pm_dq_t quarter = pm_park(x, pm_dir(PM_TURN(0.25)));
    EXPECT_NEAR(real(quarter.d), -0.5, near);
    EXPECT_NEAR(real(quarter.q), -1.5, near);
    const pm_dq_t half = pm_park(x, pm_dir(PM_TURN(0.5)));
    EXPECT_NEAR(real(half.d), -1.5, near);
    EXPECT_NEAR(real(half.q), 0.5, near);
}

TEST(MathFrames, ParkRoundTrip)
{
    double worst = 0;
    Random random;
    for_vectors(kVectorRange, [&](pm_ab_t x) {
        const pm_dir_t r = pm_dir(static_cast<pm_angle_t>(random.word()));
        const pm_ab_t back = pm_park_inverse(pm_park(x, r), r);
        const double length = std::max(vector(x).norm(), 0.1);
        worst = std::max(worst, (vector(back) - vector(x)).norm() / length);
    });
    EXPECT_LE(worst, kTurnRoundTripError);
}

TEST(MathFrames, TurnBetweenTwoDirections)
{
    const auto turn = [](double from, double by) {
        const auto dir = [](double rad) {
            return pm_dir_t{static_cast<pm_unit_t>(std::lround(std::cos(rad) * PM_UNIT_MAX)),
                            static_cast<pm_unit_t>(std::lround(std::sin(rad) * PM_UNIT_MAX))};
        };
        return real(pm_dir_turn(dir(from), dir(from + by)));
    };
    for (double from = -3; from < 3; from += 0.37) {
        for (double by = 0; by <= 0.2; by += 0.01) {
            ASSERT_NEAR(turn(from, by), by, kTurnError) << from;
            ASSERT_NEAR(turn(from, -by), -by, kTurnError) << from;
        }
        for (double by = 0.3; by < 1.5; by += 0.1) {
            ASSERT_GT(turn(from, by), turn(from, by - 0.1));
        }
    }
}

TEST(MathFrames, PairsAreTheirTwoWords)
{
    for (int32_t n = 1; n < 100; n += 7) {
        const pm_dq_t dq = {n, -3 * n};
        const pm_ab_t ab = {-5 * n, 7 * n};
        const pm_dir_t dir = {11 * n, -13 * n};
        EXPECT_EQ(pm_pair_dq(&dq).d, dq.d);
        EXPECT_EQ(pm_pair_dq(&dq).q, dq.q);
        EXPECT_EQ(pm_pair_ab(&ab).alpha, ab.alpha);
        EXPECT_EQ(pm_pair_ab(&ab).beta, ab.beta);
        EXPECT_EQ(pm_pair_dir(&dir).cos, dir.cos);
        EXPECT_EQ(pm_pair_dir(&dir).sin, dir.sin);
    }
}

} // namespace
