// The low-pass between a source and the position loop (injection.h).
#include "injection/injection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "firmware/params/parameters.h"
#include "tests/contract/bench.h"

namespace
{

using bench::real;

constexpr double kF_pwm = 1e4;

injection_config_t configured(int32_t id, double filter_Hz = 0, double loop_Hz = 10)
{
    drive_params_t p;
    drive_params_default(&p);
    p.start_method = 1;
    p.injection = id;
    p.f_injection =
        static_cast<int32_t>(std::lround(500 * std::pow(10, -drive_param_exp10[DRIVE_PARAM_f_injection])));
    p.injection_bandwidth = static_cast<int32_t>(std::lround(loop_Hz * 1e3));
    p.injection_filter = static_cast<int32_t>(std::lround(filter_Hz * 1e3));
    drive_config_t c = {};
    const drive_result_t result = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_TRUE(result.ok) << result.reason;
    return c.position.injection;
}

double corner_Hz(const injection_config_t &c)
{
    const double k = real(c.smooth, 32);
    return k / (1 - k) * kF_pwm / (2 * M_PI);
}

// An eighth of the carrier, or four times the loop where that is more; the parameter stands above both.
TEST(Injection, SinesHaveALowPass)
{
    for (const int32_t id : {INJECTION_pulsating_sine, INJECTION_rotating_sine, INJECTION_stationary_sine}) {
        EXPECT_NEAR(corner_Hz(configured(id)), 500.0 / 8, 0.01) << id;
        EXPECT_NEAR(corner_Hz(configured(id, 0, 25)), 4 * 25, 0.01) << id;
        EXPECT_NEAR(corner_Hz(configured(id, 30)), 30, 0.01) << id;
    }
}

TEST(Injection, SourcesOfEachPeriodHaveOneWhenAsked)
{
    for (const int32_t id : {INJECTION_pulsating_square, INJECTION_inform, INJECTION_stationary_square}) {
        EXPECT_EQ(configured(id).smooth, 0) << id;
        EXPECT_NEAR(corner_Hz(configured(id, 100)), 100, 0.01) << id;
    }
    EXPECT_TRUE(configured(INJECTION_pulsating_square).inlined);
    EXPECT_FALSE(configured(INJECTION_pulsating_square, 100).inlined);
}

// A current that oscillates at half of the carrier's frequency, as in a frame that does: the loop sees 1 / |1 + j f / f_c|
// of what the source says, and after a reset nothing of what it said before.
TEST(Injection, HalfOfTheCarriersFrequencyIsCutToAQuarter)
{
    const injection_config_t c = configured(INJECTION_pulsating_sine);
    injection_t self = {};
    obs_in_t start = {};
    injection_reset(&self, &c, &start);
    injection_slow(&self, &c, &start);
    injection_in_t in = {};
    in.dir.cos = INT32_MAX;
    in.ahead.cos = INT32_MAX / 2;
    injection_out_t out = {};
    std::complex<double> raw = 0, seen = 0; // at 250 Hz
    for (int k = 0; k < 2000; ++k) {
        const double phase = 2 * M_PI * 250 * k / kF_pwm;
        in.i.beta = bench::fixed(0.01 * std::sin(phase), PM_Q_BITS);
        injection_step(&self, &c, &in, &out);
        if (k >= 1000) {
            raw += std::polar(real(injection_last(&self, &c).eps), phase);
            seen += std::polar(real(out.eps), phase);
        }
    }
    ASSERT_GT(std::abs(raw), 1);
    EXPECT_NEAR(std::abs(seen / raw), 1 / std::hypot(1, 250 / 62.5), 0.01);
    injection_reset(&self, &c, &start);
    injection_step(&self, &c, &in, &out);
    EXPECT_EQ(out.eps, 0);
}

} // namespace
