// The second harmonic of a rotating carrier at the neutral, against sums in double precision.
#include "injection/zero_second.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "firmware/drive/config.h"
#include "firmware/params/parameters.h"
#include "tests/contract/bench.h"

namespace
{

using Complex = std::complex<double>;
using bench::kPi;

// Two products of 2^-30 and the table of the sine.
constexpr double kTurn = 4e-8;
// x is taken in Q24, N of them.
constexpr double kSum = 2e-7;

Complex value(pm_ab_t x)
{
    return {std::ldexp(x.alpha, -28), std::ldexp(x.beta, -28)};
}

Complex value(pm_dq_t x)
{
    return {std::ldexp(x.d, -28), std::ldexp(x.q, -28)};
}

pm_dq_t fixed(Complex x)
{
    return {static_cast<pm_q_t>(std::lround(std::ldexp(x.real(), 28))),
            static_cast<pm_q_t>(std::lround(std::ldexp(x.imag(), 28)))};
}

TEST(ZeroSecond, EachPartTurnsAsItsOrderSays)
{
    const Complex z_1(-0.012, 0.021), z_5(0.005, -0.0064), z_2(-0.0066, -0.004);
    const zero_second_config_t c = {fixed(z_1), fixed(z_5), fixed(z_2)};
    for (int k = 0; k < 48; ++k) {
        const double theta = k * kPi / 24;
        const pm_angle_t at = static_cast<pm_angle_t>(k) * (UINT32_C(0x80000000) / 24U);
        const Complex odd = z_1 * std::polar(1.0, theta) + z_5 * std::polar(1.0, -5 * theta);
        const Complex even = z_2 * std::polar(1.0, -2 * theta);
        EXPECT_LE(std::abs(value(zero_second_of_pole(&c, at)) - odd), kTurn) << k;
        EXPECT_LE(std::abs(value(zero_second_of_either(&c, at)) - even), kTurn) << k;
    }
}

// Of the period before, whose samples come two periods after their voltage: whatever else is in it.
TEST(ZeroSecond, OtherHarmonicsOfTheCarrierAreNotSeen)
{
    for (const uint32_t half : {4U, 10U, 20U}) {
        zero_rotating_config_t c = {};
        c.half = half;
        c.step = UINT32_C(0x80000000) / half;
        zero_rotating_t self = {};
        const Complex harmonics[] = {
            0.03, {0.1, -0.05}, {0.002, -0.003}, {0.001, 0.002}}; // of order 0, 1, 2, 3
        for (uint32_t k = 0; k < 2 * half; ++k) {
            double x = 0;
            for (int n = 0; n < 4; ++n) {
                x += (harmonics[n] * std::polar(1.0, n * kPi / half * (k - 2.0))).real();
            }
            self.x[k] = static_cast<pm_q_t>(std::lround(std::ldexp(x, 28)));
        }
        EXPECT_LE(std::abs(value(zero_rotating_second(&self, &c)) - harmonics[2]), kSum) << half;
    }
}

drive_params_t parameters()
{
    drive_params_t p;
    drive_params_default(&p);
    p.start_method = 1;
    p.injection = INJECTION_zero_rotating;
    p.polarity = 4;
    p.v_injection = 70000;
    p.f_injection = 250000;
    p.dL_0 = 2000000;
    p.neutral_full_scale = 10000;
    p.neutral_filter = 100000;
    p.injection_bandwidth = 15000;
    p.speed_bandwidth = 3000;
    p.zero_second = 33000;
    p.zero_second_phase = 500000;
    p.zero_second_even = 6000;
    return p;
}

// In the unit of the source's x, which has the sign of dL_0.
TEST(ZeroSecond, ConstantsAreInTheUnitOfTheSource)
{
    for (const int sign : {1, -1}) {
        drive_params_t p = parameters();
        p.dL_0 *= sign;
        drive_config_t c = {};
        const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
        ASSERT_TRUE(r.ok) << drive_param_table[r.param].name << ' ' << r.reason;
        const double L_d = 1e-9 * p.L_d, L_q = 1e-9 * p.L_q;
        const double A_V = 2e-3 * 70 * (L_d + L_q) / 2 / (2 * L_d * L_q); // an eighth of the unit
        const double F = 70 / (2 * kPi * 250), Z_1_V = 2e-3 * F * F * 2 * kPi * 250 / 8 * 33;
        const Complex phase = std::polar(1.0, kPi / 2 + 0.5);
        EXPECT_LE(std::abs(value(c.zero_second.z_1) - Z_1_V / (8 * A_V) * phase), 1e-7);
        EXPECT_LE(std::abs(value(c.zero_second.z_5) - Z_1_V / (24 * A_V) * phase), 1e-7);
        EXPECT_LE(std::abs(value(c.zero_second.z_2) - 0.006 / 8 * Complex(0, 1) * phase), 1e-7);
        EXPECT_FALSE(c.polarity.reversed);
    }
}

drive_param_id_t refused(void (*change)(drive_params_t &))
{
    drive_params_t p = parameters();
    change(p);
    drive_config_t c = {};
    const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_FALSE(r.ok);
    return r.param;
}

TEST(ZeroSecond, AWeakCarrierIsRefusedByName)
{
    EXPECT_EQ(refused([](drive_params_t &p) { p.zero_second = 0; }), DRIVE_PARAM_polarity);
    EXPECT_EQ(refused([](drive_params_t &p) { p.zero_second_even = 15000; }), DRIVE_PARAM_v_injection);
    EXPECT_EQ(refused([](drive_params_t &p) { p.zero_second_even = -15000; }), DRIVE_PARAM_v_injection);
    EXPECT_EQ(refused([](drive_params_t &p) {
                  p.v_injection = 35000;
                  p.f_injection = 500000;
              }),
              DRIVE_PARAM_v_injection);
    EXPECT_EQ(refused([](drive_params_t &p) { // 2 us at 10 kHz of 300 V are 6 V
                  p.v_injection = 23000;
                  p.dL_0 = 4000000;
              }),
              DRIVE_PARAM_v_injection);
}

// What a fall in the current does is of another step.
TEST(ZeroSecond, TheSignIsInTheConstants)
{
    drive_params_t p = parameters();
    p.zero_falls = 1;
    drive_config_t c = {};
    ASSERT_TRUE(drive_configure(&c, &p, PM_CHANNELS).ok);
    EXPECT_FALSE(c.polarity.reversed);
}

} // namespace
