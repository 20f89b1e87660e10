#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/contract/bench.h"
#include "tests/unit/math/samples.h"

namespace
{

using bench::fixed;
using bench::real;

// Each call rounds by half an LSB; 2000 calls.
constexpr double kIntegral = 2000 * 0x1p-29;
// An integral ends when the error is below 2^-29/k: nothing beside this.
constexpr double kSettled = 1e-5;

constexpr double kGain = 0.2, kMost = 0.3;

field_weakening_config_t config(double i_max = kMost)
{
    return {fixed(kGain, 32), fixed(i_max, 28)};
}

// Without resistance and at rated speed, |v| along q.
pm_q_t along_q(field_weakening_t &self, const field_weakening_config_t &c, double v, double v_top)
{
    const field_weakening_in_t in = {{0, fixed(v, 28)}, fixed(v_top, 28), PM_ONE, 0, PM_ONE / 2};
    return field_weakening_step(&self, &c, &in);
}

TEST(FieldWeakening, IsTheIntegralOfTheHeader)
{
    const field_weakening_config_t c = config();
    field_weakening_t self = {0};
    samples::Random random;
    double i_d = 0;
    double v = 0.5;
    for (int k = 0; k < 2000; ++k) {
        v = k % 50 == 0 ? random.within(0, 0.8) : v;
        i_d = std::clamp(i_d + kGain * (0.4 - v), -kMost, 0.0);
        ASSERT_NEAR(real(along_q(self, c, v, 0.4)), i_d, kIntegral) << k;
    }
}

// |v| = omega |psi_m + L_d i_d, L_q i_q|: the loop settles where the voltage is what the link allows.
TEST(FieldWeakening, HoldsTheVoltageAtItsLimit)
{
    const double psi = 0.28, L_d = 0.52, L_q = 0.9, i_q = 0.15, v_top = 0.3;
    const double gain = 2 * bench::kPi * 20e-3 / L_d; // 20 Hz at base speed
    const field_weakening_config_t c = {fixed(gain, 32), fixed(kMost, 28)};
    for (const double omega : {0.6, 1.0, 1.2}) {
        field_weakening_t self = {0};
        double i_d = 0, v = 0;
        for (int ms = 0; ms < 500; ++ms) {
            v = omega * std::hypot(psi + L_d * i_d, L_q * i_q);
            i_d = real(along_q(self, c, v, v_top));
        }
        const double needed = (std::sqrt(std::pow(v_top / omega, 2) - std::pow(L_q * i_q, 2)) - psi) / L_d;
        EXPECT_NEAR(i_d, std::clamp(needed, -kMost, 0.0), kSettled) << omega;
    }
}

// Whatever R and omega L_d are, a voltage that cannot be reached leaves the loop at the current of least voltage, which a search
// over all currents finds.
TEST(FieldWeakening, NoFurtherThanItGivesVoltage)
{
    const double psi = 0.28, L = 0.09, i_q = 0.15;
    const field_weakening_config_t c = config();
    for (const double R : {0.0, 0.05, 0.5, 2.0}) {
        for (const double omega : {0.4, 1.0, -1.0}) {
            field_weakening_t self = {0};
            double i_d = 0, least_V = 1e9;
            const auto voltage = [&](double d) {
                const double q = omega > 0 ? i_q : -i_q;
                return std::complex<double>{R * d - omega * L * q, R * q + omega * (psi + L * d)};
            };
            for (double d = -kMost; d <= 0; d += 1e-4) {
                least_V = std::min(least_V, std::abs(voltage(d)));
            }
            for (int ms = 0; ms < 3000; ++ms) {
                const field_weakening_in_t in = {bench::dq(voltage(i_d)), fixed(0.95 * least_V, 28),
                                                 fixed(omega, 28), fixed(R, 28), fixed(L, 28)};
                i_d = real(field_weakening_step(&self, &c, &in));
            }
            EXPECT_NEAR(std::abs(voltage(i_d)), least_V, 0.01 * least_V) << R << ' ' << omega;
        }
    }
}

TEST(FieldWeakening, ReleasesWhenTheVoltageFalls)
{
    const field_weakening_config_t c = config();
    field_weakening_t self = {0};
    for (int k = 0; k < 100; ++k) {
        along_q(self, c, 0.5, 0.4);
    }
    EXPECT_EQ(self.i_d, -c.i_max); // and wound up no further
    // 0.3 at 0.2 x 0.1 per call
    int calls = 0;
    while (along_q(self, c, 0.3, 0.4) < 0 && calls < 1000) {
        ++calls;
    }
    EXPECT_NEAR(calls, kMost / (kGain * 0.1), 1.5);
    EXPECT_EQ(self.i_d, 0);
}

TEST(FieldWeakening, NoneWhenSwitchedOff)
{
    const field_weakening_config_t c = config(0);
    field_weakening_t self = {0};
    for (int k = 0; k < 10; ++k) {
        EXPECT_EQ(along_q(self, c, 1.0, 0), 0);
    }
}

} // namespace
