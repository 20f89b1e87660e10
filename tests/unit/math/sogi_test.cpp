#include "firmware/math/sogi.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>

#include "firmware/math/trig.h"
#include "samples.h"

namespace
{

using samples::q;
using samples::Random;
using samples::real;
using Complex = std::complex<double>;

// sogi.h: 2e-6 / c, from 7e-7 in length and angle of the direction against a damping of c / 2.
constexpr double kResonanceError = 2e-6;
// Rounding in a resonator that forgets at rate c / 2: a few LSB / c.
constexpr double kRounding = 10 * 0x1p-28;
// Off resonance the same, less the damping that is there.
constexpr double kTransferError = 2e-6;

pm_frac_t frac(double x)
{
    return static_cast<pm_frac_t>(std::lround(x * 0x1p32));
}

pm_angle_t angle(double rad)
{
    return static_cast<pm_angle_t>(std::llround(rad / (2 * M_PI) * 0x1p32));
}

// Damping c of the header.
double damping(double w, double k)
{
    return k * (1 + std::cos(w)) / 2;
}

// Complex amplitude of y for cos(w_in k), of a filter tuned to w, through a Hann window.
Complex response(double w, double w_in, double k_damp)
{
    pm_sogi_t sogi = {};
    Complex sum = 0;
    const int settle = static_cast<int>(40 / damping(w, k_damp)), n = 20000;
    for (int k = 0; k < settle + n; ++k) {
        pm_sogi_step(&sogi, pm_dir(angle(w)), frac(k_damp), q(std::cos(w_in * k)));
        if (k >= settle) {
            const double hann = 1 - std::cos(2 * M_PI * (k - settle) / n);
            sum += real(sogi.y) * std::polar(hann * 2 / n, -w_in * k);
        }
    }
    return sum;
}

TEST(MathSogi, UnityAtResonanceAndQuadratureLagging)
{
    for (const double w : {0.01, 0.1, 0.5, 2 * M_PI / 5, 2.5}) {
        for (const double k : {0.002, 0.02, 0.2}) {
            if (k > 2 * w) {
                continue; // overdamped, settles slowly
            }
            const double limit = 1.5 * (kResonanceError + kRounding) / damping(w, k); // errors add as vectors
            pm_sogi_t sogi = {};
            double in_phase = 0, lagging = 0;
            for (int n = 0; n < 60 / damping(w, k) + 1000; ++n) {
                const double phase =
                    std::remainder(static_cast<double>(angle(w)) * n * 0x1p-32, 1.0) * 2 * M_PI;
                pm_sogi_step(&sogi, pm_dir(angle(w)), frac(k), q(std::cos(phase)));
                if (n > 60 / damping(w, k)) {
                    in_phase = std::max(in_phase, std::abs(real(sogi.y) - std::cos(phase)));
                    lagging = std::max(lagging, std::abs(real(sogi.q) - std::sin(phase)));
                }
            }
            EXPECT_LE(in_phase, limit) << w << " " << k;
            EXPECT_LE(lagging, limit) << w << " " << k;
        }
    }
}

TEST(MathSogi, TransferFunction)
{
    for (const double w : {0.05, 0.4, 1.2}) {
        for (const double k : {0.01, 0.1}) {
            const double c = damping(w, k);
            for (const double ratio : {0.2, 0.8, 1.05, 2.0}) {
                const Complex z = std::polar(1.0, w * ratio);
                const Complex expected = c * (z - 1.0) / (z * z - (2 * std::cos(w) - c) * z + 1.0 - c);
                EXPECT_LE(std::abs(response(w, w * ratio, k) - expected), kTransferError / c)
                    << w << " " << k << " " << ratio;
            }
        }
    }
}

TEST(MathSogi, PhaseCrossesZeroAtTheFrequencyAskedFor)
{
    for (const double w : {0.05, 0.6, 2 * M_PI / 5}) {
        const double k = 0.02;
        EXPECT_NEAR(std::arg(response(w, w, k)), 0, kResonanceError / damping(w, k)) << w;
        EXPECT_GT(std::arg(response(w, w * 0.999, k)), 100 * kResonanceError) << w;
        EXPECT_LT(std::arg(response(w, w * 1.001, k)), -100 * kResonanceError) << w;
    }
}

TEST(MathSogi, DcDoesNotReachTheInPhaseOutput)
{
    for (const double w : {0.02, 0.3}) {
        pm_sogi_t sogi = {};
        const double k_damp = 0.02;
        for (int k = 0; k < 60 / k_damp; ++k) {
            pm_sogi_step(&sogi, pm_dir(angle(w)), frac(k_damp), PM_ONE);
        }
        EXPECT_NEAR(real(sogi.y), 0, kRounding / w) << w;
        EXPECT_NEAR(real(sogi.q), k_damp / 2 / std::tan(w / 2), 1e-4 * k_damp / w) << w;
    }
}

TEST(MathSogi, StaysFiniteAtTheEndsOfTheRange)
{
    Random random;
    for (const double w : {0.001, 0.7, 3.1}) {
        pm_sogi_t sogi = {};
        for (int k = 0; k < 20000; ++k) {
            pm_sogi_step(&sogi, pm_dir(angle(w)), frac(0.1), q(random.word() < 0 ? -2.5 : 2.5));
            ASSERT_LT(std::hypot(real(sogi.y), real(sogi.q)), 5.5) << w;
        }
    }
}

} // namespace
