#include <gtest/gtest.h>

#include <cmath>

#include "tests/contract/bench.h"

namespace
{

using bench::fixed;
using bench::real;

// pm_hypot(): 1.1e-8 relative and half an LSB; inputs are rounded to an LSB.
constexpr double kRelative = 1.2e-8;
constexpr double kLsb = 2 * 0x1p-28;
// The same at the end of the range, 8 x 1.2e-8, in LSB.
constexpr int32_t kCorner = 26;
// Torque is flat at its maximum: a search in steps of 0.01 degree finds the angle no closer than that.
constexpr double kTorque = 1e-6;

struct Case {
    double psi_Wb, L_d_H, L_q_H;
};

constexpr Case kCases[] = {{0.236, 43e-3, 75e-3}, {0.0776, 3.0e-3, 3.3e-3}, {0.01, 0.2e-3, 0.6e-3}};

mtpa_config_t config(const Case &m, double i_base)
{
    return {fixed(m.psi_Wb / (2 * (m.L_q_H - m.L_d_H)) / i_base, 28)};
}

double base_of(const Case &m) // so that h is a per-unit number within the format
{
    return m.psi_Wb / (2 * (m.L_q_H - m.L_d_H)) < 40 ? 10 : 100;
}

TEST(Mtpa, IsTheFormula)
{
    for (const Case &m : kCases) {
        const double base = base_of(m);
        const mtpa_config_t c = config(m, base);
        const double h = real(c.h);
        for (double i_q = -2; i_q <= 2; i_q += 0.01) {
            const double expected = h - std::hypot(h, i_q);
            EXPECT_NEAR(real(mtpa_i_d(&c, fixed(i_q, 28))), expected, kRelative * std::hypot(h, i_q) + kLsb)
                << i_q;
        }
    }
}

TEST(Mtpa, GivesTheLargestTorqueOfItsCurrent)
{
    for (const Case &m : kCases) {
        const double base = base_of(m);
        const mtpa_config_t c = config(m, base);
        for (const double i_q : {0.05, 0.2, 0.5, 1.0, -0.4}) {
            const double i_d = real(mtpa_i_d(&c, fixed(i_q, 28)));
            const auto torque = [&m, base](double d, double q) {
                return (m.psi_Wb + (m.L_d_H - m.L_q_H) * d * base) * q * base;
            };
            const double size = std::hypot(i_d, i_q);
            double best = 0, best_angle = 0;
            for (int k = 0; k <= 18000; ++k) {
                const double angle = bench::kPi / 2 + k * 0.01 * bench::kDegree / 2;
                const double t = torque(size * std::cos(angle), size * std::sin(angle));
                if (t > best) {
                    best = t;
                    best_angle = angle;
                }
            }
            EXPECT_NEAR(torque(i_d, std::abs(i_q)), best, kTorque * best) << i_q;
            EXPECT_NEAR(std::atan2(std::abs(i_q), i_d), best_angle, 0.1 * bench::kDegree) << i_q;
        }
    }
}

TEST(Mtpa, NoneWithoutSaliency)
{
    const mtpa_config_t c = {0};
    for (const int32_t i_q : {0, PM_Q(1.0), -PM_Q(3.0), INT32_MAX, INT32_MIN}) {
        EXPECT_EQ(mtpa_i_d(&c, i_q), 0);
    }
}

TEST(Mtpa, CornersDoNotOverflow)
{
    for (const int32_t h : {1, PM_ONE, INT32_MAX}) {
        const mtpa_config_t c = {h};
        for (const int32_t i_q : {0, 1, -1, INT32_MAX, INT32_MIN}) {
            EXPECT_LE(mtpa_i_d(&c, i_q), kCorner);
        }
    }
}

} // namespace
