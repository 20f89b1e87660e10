#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/contract/bench.h"

namespace
{

using bench::Base;
using bench::Complex;
using bench::fixed;
using bench::kDegree;
using bench::kJ;
using bench::Machine;
using bench::real;

// The signal is small, h_d = 0.016 of the base: a rounding of 2^-27 is 3e-6 of the sine; the gain is Q20.
constexpr double kSignal = 1e-4;
// The carrier stands still in the estimated frame while the rotor turns by w T_s: second order, (w T_s)^2.
constexpr double kTurning_deg = 0.05;
// eps is exact for small errors; the slope is taken over +-1 degree.
constexpr double kSlope = 0.005;
constexpr double kZero_deg = 0.02;

constexpr double kCarrier_V = 70;
const Base kBase = bench::kIpmBase;

using L = Machine::Tangent;

constexpr L kUnloaded = {43e-3, 75e-3, 0};

// IPM-1000 at a current, from the energy form.
L at(Complex i_A)
{
    return bench::kIpm1000.tangent(bench::kIpm1000.flux_Wb(i_A));
}

// d(h_q + lambda h_d)/d angle, as a current: V_h T_s [(L_q - L_d) + 2 L_dq^2/L_q] / D.
double slope_A(const L &l)
{
    const double D = l.L_d_H * l.L_q_H - l.L_dq_H * l.L_dq_H;
    return kCarrier_V * kBase.period_s * (l.L_q_H - l.L_d_H + 2 * l.L_dq_H * l.L_dq_H / l.L_q_H) / D;
}

// For the machine as it is at i_q: lambda and gain are given exactly there.
pulsating_square_config_t config(const L &l, double i_q_A)
{
    const double i_q = i_q_A / kBase.i_A;
    const double gain_0 = kBase.i_A / slope_A(kUnloaded);
    const double h_d = kCarrier_V * kBase.period_s / kUnloaded.L_d_H / kBase.i_A;
    pulsating_square_config_t c = {};
    c.v_h = fixed(kCarrier_V / kBase.v_V, 28);
    c.saliency.gain_0 = fixed(gain_0, 20);
    if (i_q != 0) {
        c.saliency.gain_2 = fixed((kBase.i_A / slope_A(l) - gain_0) / (i_q * i_q), 16);
        c.saliency.lambda_1 = fixed(0.7 * l.L_dq_H / l.L_q_H / i_q, 28); // a share in each term
        c.saliency.lambda_2 = fixed(0.3 * l.L_dq_H / l.L_q_H / (i_q * std::abs(i_q)), 28);
    }
    c.half_step = fixed(kBase.period_s * kBase.omega_rad_s / 2, 32);
    c.h_d = fixed(h_d, 28);
    c.h_d_inverse = fixed(1 / h_d, 20);
    return c;
}

pulsating_square_config_t without_cross(pulsating_square_config_t c)
{
    c.saliency.lambda_1 = 0;
    c.saliency.lambda_2 = 0;
    return c;
}

// Carrier response of a machine that turns under a fundamental current: p i = L^-1 v in the rotor frame.
class Carrier
{
  public:
    Carrier(const pulsating_square_config_t &c, const L &l, double error_rad, double omega_pu = 0,
            double i_q_A = 0)
        : c_(c), l_(l), error_(error_rad), omega_(omega_pu * kBase.omega_rad_s), i_q_A_(i_q_A)
    {
        obs_in_t in = {};
        in.i = measured();
        pulsating_square_reset(&self, &c_, &in);
        pulsating_square_slow(&self, &c_, &in);
        pulsating_square_slow(&self, &c_, &in); // the whole amplitude
    }

    // Sample k: demodulation, and the voltage for [k+1, k+2), in the frame of its middle; 1 kHz every tenth.
    obs_out_t step()
    {
        const double theta_hat = theta_ - error_;
        const double ahead = theta_hat + 1.5 * omega_ * kBase.period_s;
        if (k_++ % 10 == 0) {
            obs_in_t slow = {};
            slow.omega = fixed(omega_ / kBase.omega_rad_s, 28);
            slow.i_dq = bench::dq(i_fundamental() / kBase.i_A * std::polar(1.0, -theta_hat));
            pulsating_square_slow(&self, &c_, &slow);
        }
        injection_in_t in = {};
        in.i = measured();
        in.dir = bench::direction(theta_hat);
        in.omega = fixed(omega_ / kBase.omega_rad_s, 28);
        in.ahead = {fixed(std::cos(ahead), 30), fixed(std::sin(ahead), 30)};
        injection_out_t out;
        pulsating_square_step(&self, &c_, &in, &out);
        const obs_out_t last = pulsating_square_last(&self, &c_);
        EXPECT_EQ(last.eps, out.eps);
        fundamental = bench::complex(out.i) * kBase.i_A * std::polar(1.0, theta_hat);
        run(applying_);
        applying_ = bench::complex(out.carrier.v) * kBase.v_V;
        return last;
    }

    obs_out_t settled()
    {
        obs_out_t out = {};
        for (int k = 0; k < 22; ++k) {
            out = step();
        }
        return out;
    }

    Complex i_fundamental() const
    {
        return kJ * i_q_A_ * std::polar(1.0, theta_);
    }

    pulsating_square_t self = {};
    Complex fundamental;

  private:
    pm_ab_t measured() const
    {
        return bench::ab((i_fundamental() + i_carrier_A_) / kBase.i_A);
    }

    void run(Complex v_V)
    {
        const int n = 20; // the inductances turn within the period
        for (int k = 0; k < n; ++k) {
            theta_ += omega_ * kBase.period_s / n / 2;
            const Complex v = v_V * std::polar(1.0, -theta_);
            const double D = l_.L_d_H * l_.L_q_H - l_.L_dq_H * l_.L_dq_H;
            const Complex slope = {(l_.L_q_H * v.real() - l_.L_dq_H * v.imag()) / D,
                                   (l_.L_d_H * v.imag() - l_.L_dq_H * v.real()) / D};
            i_carrier_A_ += slope * std::polar(1.0, theta_) * kBase.period_s / static_cast<double>(n);
            theta_ += omega_ * kBase.period_s / n / 2;
        }
    }

    pulsating_square_config_t c_;
    L l_;
    double error_, omega_, i_q_A_;
    double theta_ = 0.3;
    int k_ = 0;
    Complex i_carrier_A_ = 0, applying_ = 0;
};

double eps(const pulsating_square_config_t &c, const L &l, double error_rad, double omega = 0,
           double i_q_A = 0)
{
    return real(Carrier(c, l, error_rad, omega, i_q_A).settled().eps);
}

// The position that the loop would settle at: where eps crosses zero upwards, as an error theta - theta_hat.
double zero_deg(const pulsating_square_config_t &c, const L &l, double omega, double i_q_A)
{
    double lo = -30 * kDegree, hi = 30 * kDegree;
    for (int n = 0; n < 40; ++n) {
        const double mid = (lo + hi) / 2;
        (eps(c, l, mid, omega, i_q_A) < 0 ? lo : hi) = mid;
    }
    return (lo + hi) / 2 / kDegree;
}

TEST(PulsatingSquare, ErrorSignalIsHalfTheSineOfTwiceTheError)
{
    const pulsating_square_config_t c = config(kUnloaded, 0);
    for (int a = -90; a <= 90; a += 3) {
        EXPECT_NEAR(eps(c, kUnloaded, a * kDegree), 0.5 * std::sin(2 * a * kDegree), kSignal) << a;
    }
}

TEST(PulsatingSquare, SlopeIsOne)
{
    for (const double i_q : {0.0, 2.0, 4.0, -4.0}) {
        const L l = at({-0.4 * std::abs(i_q), i_q});
        const pulsating_square_config_t c = i_q == 0 ? config(kUnloaded, 0) : config(l, i_q);
        const L machine = i_q == 0 ? kUnloaded : l;
        const double e = kDegree;
        const double slope = (eps(c, machine, e, 0, i_q) - eps(c, machine, -e, 0, i_q)) / (2 * e);
        EXPECT_NEAR(slope, 1, kSlope) << i_q;
    }
}

TEST(PulsatingSquare, CompensatedZeroIsTheRotor)
{
    for (const double i_q : {1.0, 3.0, 4.0, -4.0}) {
        const L l = at({-0.4 * std::abs(i_q), i_q});
        EXPECT_NEAR(zero_deg(config(l, i_q), l, 0, i_q), 0, kZero_deg) << i_q;
    }
}

TEST(PulsatingSquare, UncompensatedZeroIsWhereCrossCouplingPutsIt)
{
    for (const double i_q : {2.0, 4.0, -4.0}) {
        const L l = at({-0.4 * std::abs(i_q), i_q});
        const double theta_m = std::atan2(-l.L_dq_H, (l.L_q_H - l.L_d_H) / 2); // METHODS.md 0.1
        const double expected = -theta_m / 2 / kDegree;
        EXPECT_GT(std::abs(expected), 3); // the effect is there
        EXPECT_EQ(expected<0, i_q> 0);    // motoring: the estimate leads
        EXPECT_NEAR(zero_deg(without_cross(config(l, i_q)), l, 0, i_q), expected, kZero_deg) << i_q;
    }
}

TEST(PulsatingSquare, SpeedMovesNoAngle)
{
    pulsating_square_config_t c = config(kUnloaded, 0);
    for (const double omega : {0.05, 0.2, -0.2}) {
        EXPECT_NEAR(zero_deg(c, kUnloaded, omega, 0), 0, kTurning_deg) << omega;
    }
    // without the term the position lags by L_q/(L_q - L_d) half steps
    c.half_step = 0;
    for (const double omega : {0.2, -0.2}) {
        const double half = omega * kBase.omega_rad_s * kBase.period_s / 2;
        const double expected = half * kUnloaded.L_q_H / (kUnloaded.L_q_H - kUnloaded.L_d_H) / kDegree;
        EXPECT_NEAR(zero_deg(c, kUnloaded, omega, 0), expected, 0.05 * std::abs(expected)) << omega;
    }
}

// A fundamental that turns changes from sample to sample, but by the same step: the second difference drops
// it.
TEST(PulsatingSquare, FundamentalCurrentDropsOut)
{
    const pulsating_square_config_t c = config(kUnloaded, 0);
    for (const double omega : {0.1, -0.2}) {
        const double bare = eps(c, kUnloaded, 0.1, omega, 0);
        EXPECT_NEAR(eps(c, kUnloaded, 0.1, omega, 4), bare, kSignal) << omega;
    }
}

// Commanded at k, applied over [k+1, k+2), seen at k+2; the second difference is whole one period later.
TEST(PulsatingSquare, EverySampleHasTheRightSignFromTheFirst)
{
    const pulsating_square_config_t c = config(kUnloaded, 0);
    for (const double error : {0.2, -0.2}) {
        Carrier carrier(c, kUnloaded, error);
        for (int k = 0; k < 40; ++k) {
            const obs_out_t out = carrier.step();
            if (k < 3) {
                ASSERT_NEAR(real(out.eps), k < 2 ? 0 : 0.25 * std::sin(2 * error), kSignal) << k;
                continue;
            }
            ASSERT_NEAR(real(out.eps), 0.5 * std::sin(2 * error), kSignal) << k;
            ASSERT_NEAR(real(out.vector.d) * kBase.i_A,
                        0.5 * kCarrier_V * kBase.period_s *
                            ((1 / 43e-3 + 1 / 75e-3) + (1 / 43e-3 - 1 / 75e-3) * std::cos(2 * error)),
                        1e-5)
                << k;
        }
    }
}

// Quality is judged right after a reset too.
TEST(PulsatingSquare, ResetIsAsIfSettled)
{
    const pulsating_square_config_t c = config(kUnloaded, 0);
    const obs_in_t none = {};
    pulsating_square_t self;
    pulsating_square_reset(&self, &c, &none);
    const obs_out_t out = pulsating_square_last(&self, &c);
    EXPECT_EQ(out.eps, 0);
    EXPECT_EQ(out.misfit, 0);
    EXPECT_EQ(out.vector.d, c.h_d);
}

TEST(PulsatingSquare, VoltageAlternatesAlongD)
{
    const pulsating_square_config_t c = config(kUnloaded, 0);
    const double ahead = 0.7;
    const obs_in_t none = {};
    injection_in_t in = {};
    in.ahead = {fixed(std::cos(ahead), 30), fixed(std::sin(ahead), 30)};
    pulsating_square_t self;
    pulsating_square_reset(&self, &c, &none);
    // half of the amplitude in the first millisecond, three quarters in the second
    const double share[] = {0.5, 0.75, 1, 1};
    for (int k = 0; k < 40; ++k) {
        if (k > 0 && k % 10 == 0) {
            pulsating_square_slow(&self, &c, &none);
        }
        injection_out_t out;
        pulsating_square_step(&self, &c, &in, &out);
        const Complex v = bench::complex(out.carrier.v) * kBase.v_V * std::polar(1.0, -ahead);
        const double expected = share[k / 10] * kCarrier_V;
        EXPECT_NEAR(v.real(), k % 2 == 0 ? expected : -expected, 1e-5) << k;
        EXPECT_NEAR(v.imag(), 0, 1e-5) << k;
    }
}

TEST(PulsatingSquare, FundamentalIsTheMeanWithoutCarrier)
{
    const pulsating_square_config_t c = config(kUnloaded, 0);
    Carrier carrier(c, kUnloaded, 0, 0, 3.0);
    for (int k = 0; k < 20; ++k) {
        carrier.step();
        if (k > 4) {
            // the ripple runs from 0 to one step, so its mean is a constant half
            const double half = 0.5 * kCarrier_V * kBase.period_s / kUnloaded.L_d_H;
            EXPECT_NEAR(std::abs(carrier.fundamental - carrier.i_fundamental()), half, 1e-4) << k;
        }
    }
}

TEST(PulsatingSquare, MisfitIsTheChangeOfTheCarrier)
{
    const pulsating_square_config_t c = config(kUnloaded, 0);
    EXPECT_NEAR(real(Carrier(c, kUnloaded, 0).settled().misfit), 0, kSignal);
    EXPECT_NEAR(real(Carrier(c, {86e-3, 150e-3, 0}, 0).settled().misfit), -0.5, kSignal);
    EXPECT_NEAR(real(Carrier(c, {30e-3, 75e-3, 0}, 0).settled().misfit), 43.0 / 30 - 1, kSignal);
    // at a right angle the carrier runs along q
    EXPECT_NEAR(real(Carrier(c, kUnloaded, 90 * kDegree).settled().misfit), 43.0 / 75 - 1, kSignal);
    // no current at all
    EXPECT_NEAR(real(Carrier(c, {1e3, 1e3, 0}, 0).settled().misfit), -1, kSignal);
}

TEST(PulsatingSquare, OutputsAreLimited)
{
    const pulsating_square_config_t c = config(kUnloaded, 0);
    for (const double l : {43e-5, 43e-4}) { // ten, a hundred times the carrier expected
        for (const double error : {0.7, -0.7}) {
            const obs_out_t out = Carrier(c, {l, 1.7 * l, 0}, error).settled();
            EXPECT_LE(std::abs(real(out.eps)), 1);
            EXPECT_GT(real(out.eps) * error, 0.69);
            EXPECT_LE(std::abs(real(out.misfit)), 1);
            EXPECT_GT(real(out.misfit), 0.99);
        }
    }
}

} // namespace
