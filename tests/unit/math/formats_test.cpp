// Accuracy of one control kernel in five number formats against double; docs/decisions/001-signal-format.md.
#include "tests/target/math/formats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace
{

constexpr int kSteps = 200000; // 10 s at 20 kHz
constexpr double kFlux_pu = 0.8;

// What the firmware's format must keep. Measured: 8.1e-5 degree, 2.9e-7 pu and 4.4e-7 pu; the rest is margin.
constexpr double kAngle_deg = 1.6e-4;
constexpr double kDrift_pu = 6e-7;
constexpr double kPark_pu = 7e-7; // the error of pm_dir() alone

struct Flux {
    double alpha = 0, beta = 0;

    void step(const format_in_t &in, double leak)
    {
        const double i_alpha = (2 * in.i_a - in.i_b - in.i_c) / 3,
                     i_beta = (in.i_b - in.i_c) / std::sqrt(3.0);
        alpha += FORMAT_K_FLUX * (in.v_alpha - FORMAT_R * i_alpha) - leak * alpha;
        beta += FORMAT_K_FLUX * (in.v_beta - FORMAT_R * i_beta) - leak * beta;
    }
};

struct Errors {
    double flux_pu = 0, park_pu = 0;
};

Errors run(const format_t &format, double omega_pu, bool leak)
{
    format_signal_t signal = {};
    format.reset(leak);
    Flux flux;
    Errors worst;
    for (int k = 0; k < kSteps; ++k) {
        const format_in_t in = format_signal_next(&signal, omega_pu);
        const format_out_t out = format.step(&in);
        flux.step(in, leak ? FORMAT_LEAK : 0.0);
        const double i_alpha = (2 * in.i_a - in.i_b - in.i_c) / 3,
                     i_beta = (in.i_b - in.i_c) / std::sqrt(3.0);
        const double theta = in.theta * (2 * M_PI * 0x1p-32);
        const double d = i_alpha * std::cos(theta) + i_beta * std::sin(theta);
        const double q = i_beta * std::cos(theta) - i_alpha * std::sin(theta);
        worst.flux_pu =
            std::max(worst.flux_pu, std::hypot(out.psi_alpha - flux.alpha, out.psi_beta - flux.beta));
        worst.park_pu = std::max(worst.park_pu, std::hypot(out.i_d - d, out.i_q - q));
    }
    return worst;
}

class Format : public testing::TestWithParam<const format_t *>
{
};

TEST_P(Format, AccuracyOverTenSeconds)
{
    const format_t &format = *GetParam();
    for (const double omega_pu : {0.01, 1.0}) {
        const Errors corrected = run(format, omega_pu, true), bare = run(format, omega_pu, false);
        const double angle_deg = std::asin(std::min(1.0, corrected.flux_pu / kFlux_pu)) * 180 / M_PI;
        std::printf(
            "%-24s %5.0f %% speed: flux angle %.1e deg, bare integrator %.1e pu, dq current %.1e pu\n",
            format.name, 100 * omega_pu, angle_deg, bare.flux_pu, bare.park_pu);
        if (&format == &format_q28) {
            EXPECT_LE(angle_deg, kAngle_deg);
            EXPECT_LE(bare.flux_pu, kDrift_pu);
            EXPECT_LE(bare.park_pu, kPark_pu);
        } else {
            EXPECT_LE(bare.park_pu, 0.01); // it is the same kernel
        }
    }
}

INSTANTIATE_TEST_SUITE_P(, Format,
                         testing::Values(&format_q28, &format_q31, &format_q24, &format_q15, &format_float));

} // namespace
