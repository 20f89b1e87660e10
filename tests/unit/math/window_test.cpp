#include "firmware/math/window.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <vector>

#include "firmware/math/trig.h"
#include "samples.h"

namespace
{

using Complex = std::complex<double>;

// Samples are rounded to 2^-24, the mean and the amplitudes to 2^-24 and 2^-23 before they become signals.
constexpr double kRounding = 4e-7;
// The directions of the table: 7e-7 of a fundamental of one.
constexpr double kDirection = 1e-6;

constexpr double kPi = 3.14159265358979323846;

class Window
{
  public:
    explicit Window(uint16_t n, Complex first = 0) : n_(n), past_(n, first)
    {
        window_reset(&self_, n, signal(first));
    }

    void add(Complex x)
    {
        const auto at = static_cast<uint16_t>(count_ % n_);
        window_step(&self_, at, pm_dir(static_cast<pm_angle_t>(at) * (UINT32_MAX / n_)), signal(x));
        past_[at] = x;
        ++count_;
    }

    Complex mean() const
    {
        return complex(window_mean(&self_, per_n()));
    }
    Complex negative() const
    {
        return complex(window_negative(&self_, per_n()));
    }
    Complex positive() const
    {
        return complex(window_positive(&self_, per_n()));
    }

    Complex cosine() const
    {
        return complex(window_cosine(&self_, per_n()));
    }
    Complex sine() const
    {
        return complex(window_sine(&self_, per_n()));
    }

    // 1/N sum x e^{j sign phi} in double precision.
    Complex reference(int sign) const
    {
        Complex sum = 0;
        for (int k = 0; k < n_; ++k) {
            sum += past_[static_cast<size_t>(k)] * std::polar(1.0, sign * 2 * kPi * k / n_);
        }
        return sum / static_cast<double>(n_);
    }

    uint16_t n() const
    {
        return n_;
    }

  private:
    static pm_dq_t signal(Complex x)
    {
        return {samples::q(x.real()), samples::q(x.imag())};
    }
    static Complex complex(pm_dq_t x)
    {
        return {samples::real(x.d), samples::real(x.q)};
    }
    pm_frac_t per_n() const
    {
        return static_cast<pm_frac_t>(std::llround(0x1p32 / n_));
    }

    uint16_t n_;
    std::vector<Complex> past_;
    long count_ = 0;
    window_t self_;
};

TEST(Window, AmplitudesAreThoseOfTheLastSamples)
{
    samples::Random random;
    for (const uint16_t n : std::vector<uint16_t>{8, 20, 33, 40}) {
        Window w(n);
        for (int k = 0; k < 5 * n; ++k) {
            w.add({random.within(-1, 1), random.within(-1, 1)});
            EXPECT_LT(std::abs(w.mean() - w.reference(0)), kRounding) << n << ' ' << k;
            EXPECT_LT(std::abs(w.negative() - w.reference(1)), kRounding + kDirection) << n << ' ' << k;
            EXPECT_LT(std::abs(w.positive() - w.reference(-1)), kRounding + kDirection) << n << ' ' << k;
            const Complex cosine = (w.reference(1) + w.reference(-1)) / 2.0;
            const Complex sine = (w.reference(1) - w.reference(-1)) / Complex(0, 2);
            EXPECT_LT(std::abs(w.cosine() - cosine), kRounding + kDirection) << n << ' ' << k;
            EXPECT_LT(std::abs(w.sine() - sine), kRounding + kDirection) << n << ' ' << k;
        }
    }
}

TEST(Window, EachAmplitudeIsFreeOfTheOthers)
{
    const Complex mean{0.6, -0.3}, positive{0.02, 0.01}, negative{-0.004, 0.005};
    for (const uint16_t n : std::vector<uint16_t>{8, 20, 40}) {
        Window w(n);
        for (int k = 0; k < 3 * n; ++k) {
            const Complex turn = std::polar(1.0, 2 * kPi * k / n);
            w.add(mean + positive * turn + negative * std::conj(turn));
        }
        EXPECT_LT(std::abs(w.mean() - mean), kRounding) << n;
        EXPECT_LT(std::abs(w.positive() - positive), kRounding + kDirection) << n;
        EXPECT_LT(std::abs(w.negative() - negative), kRounding + kDirection) << n;
    }
}

TEST(Window, AConstantIsNoAnswerFromTheFirstSample)
{
    const Complex constant{0.8, 0.5};
    Window w(20, constant);
    for (int k = 0; k < 20; ++k) {
        EXPECT_LT(std::abs(w.mean() - constant), kRounding) << k;
        EXPECT_LT(std::abs(w.negative()), kRounding) << k;
        w.add(constant);
    }
}

TEST(Window, NothingDriftsInAMillionSamples)
{
    samples::Random random;
    Window w(33);
    for (int k = 0; k < 1000000; ++k) {
        w.add({random.within(-2.9, 2.9), random.within(-2.9, 2.9)});
    }
    for (int k = 0; k < 33; ++k) {
        w.add(0);
    }
    EXPECT_EQ(w.mean(), Complex(0, 0));
    EXPECT_EQ(w.negative(), Complex(0, 0));
    EXPECT_EQ(w.positive(), Complex(0, 0));
}

} // namespace
