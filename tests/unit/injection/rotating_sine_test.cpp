// The answer of a machine with resistance to a rotating voltage, from its differential equation in the rotor frame.
#include <gtest/gtest.h>

#include <cmath>

#include "firmware/params/parameters.h"
#include "tests/contract/bench.h"
#include "tests/contract/observers.h"

namespace
{

using bench::Base;
using bench::Complex;
using bench::kDegree;
using bench::kJ;
using bench::Machine;
using bench::real;

const Base kBase = bench::kIpmBase;

// First order in R / (omega_h L): what is left is its square, 0.035^2 rad, and the staircase of the voltage.
constexpr double kFirstOrder_deg = 0.15;
constexpr double kSlope = 0.01;

rotating_sine_config_t config(double R_told_ohm, bool positive_sequence = true)
{
    drive_params_t p = bench::parameters(bench::kIpmLinear, kBase);
    p.injection = INJECTION_rotating_sine;
    p.start_method = 1;
    p.v_injection = 35000;
    p.R_s = static_cast<int32_t>(std::lround(R_told_ohm * 1e6));
    p.injection_post_comp = positive_sequence ? 1 : 0;
    drive_config_t c = {};
    EXPECT_TRUE(drive_configure(&c, &p, PM_CHANNELS).ok);
    return c.position.injection.rotating_sine;
}

// Locked rotor, imposed position: settled error signal and fundamental current in the estimated frame.
struct Settled {
    double eps, misfit;
    Complex i_A;
};

Settled settled(const rotating_sine_config_t &c, double error_rad, double R_ohm, Complex i_dq_A = 0)
{
    const Machine &m = bench::kIpmLinear;
    const double theta = 0.4, hat = theta - error_rad;
    Complex i = i_dq_A; // in the rotor frame, beside a steady voltage that keeps it
    const Complex v_steady = R_ohm * i_dq_A;
    obs_in_t first = {};
    first.i = bench::ab(i * std::polar(1.0, theta) / kBase.i_A);
    first.dir = bench::direction(hat);
    first.i_dq = bench::dq(i * std::polar(1.0, error_rad) / kBase.i_A);
    rotating_sine_t self;
    rotating_sine_reset(&self, &c, &first);
    Complex applying = 0, commanded = 0;
    Settled r = {};
    for (int k = 0; k < 1200; ++k) { // ten time constants of the stator
        injection_in_t in = {};
        in.i = bench::ab(i * std::polar(1.0, theta) / kBase.i_A);
        in.dir = bench::direction(hat);
        in.ahead = {bench::fixed(std::cos(hat), 30), bench::fixed(std::sin(hat), 30)};
        injection_out_t out;
        rotating_sine_step(&self, &c, &in, &out);
        if (k % 10 == 9) {
            obs_in_t slow = {};
            slow.i_dq = out.i;
            rotating_sine_slow(&self, &c, &slow);
        }
        commanded = bench::complex(out.carrier.v) * kBase.v_V;
        const Complex v = v_steady + applying * std::polar(1.0, -theta);
        for (int n = 0; n < 50; ++n) {
            const double t = kBase.period_s / 50;
            i += Complex((v.real() - R_ohm * i.real()) / m.L_d0_H, (v.imag() - R_ohm * i.imag()) / m.L_q0_H) *
                 t;
        }
        applying = commanded;
        r = {real(out.eps), real(rotating_sine_last(&self, &c).misfit), bench::complex(out.i) * kBase.i_A};
    }
    return r;
}

TEST(RotatingSine, ErrorSignalIsHalfTheSineOfTwiceTheError)
{
    const rotating_sine_config_t c = config(1e-3, false);
    for (int a = -90; a <= 90; a += 10) {
        const double expected = 0.5 * std::sin(2 * a * kDegree);
        EXPECT_NEAR(settled(c, a * kDegree, 1e-3).eps, expected, 0.005) << a;
    }
}

TEST(RotatingSine, SlopeIsOne)
{
    const rotating_sine_config_t c = config(1e-3, false);
    const double e = kDegree;
    EXPECT_NEAR((settled(c, e, 1e-3).eps - settled(c, -e, 1e-3).eps) / (2 * e), 1, kSlope);
}

// METHODS-ADDENDUM E1: rho = R (1 / (omega_h L_d) + 1 / (omega_h L_q)) / 2, the estimate lags by it.
TEST(RotatingSine, ResistanceThatIsNotKnownMovesTheAngleByItsFormula)
{
    const Machine &m = bench::kIpmLinear;
    const double R = 6, omega_h = 2 * bench::kPi * 500;
    const double rho_deg = R / (2 * omega_h) * (1 / m.L_d0_H + 1 / m.L_q0_H) / kDegree;
    EXPECT_NEAR(rho_deg, 2.0, 0.1);
    EXPECT_NEAR(settled(config(1e-3, false), 0, R).eps / kDegree, -rho_deg, kFirstOrder_deg);
    EXPECT_NEAR(settled(config(R, false), 0, R).eps / kDegree, 0, kFirstOrder_deg);
}

// Of a resistance in all phases the positive sequence shows 1 + kappa^2; without load three quarters are used.
TEST(RotatingSine, PositiveSequenceShowsTheResistance)
{
    const Machine &m = bench::kIpmLinear;
    const double kappa = (m.L_q0_H - m.L_d0_H) / (m.L_q0_H + m.L_d0_H);
    const double R = 12, told = 6, omega_h = 2 * bench::kPi * 500;
    const double more_deg = (R - told) / (2 * omega_h) * (1 / m.L_d0_H + 1 / m.L_q0_H) / kDegree;
    EXPECT_NEAR(settled(config(told, false), 0, R).eps / kDegree, -more_deg, kFirstOrder_deg);
    EXPECT_NEAR(settled(config(told, true), 0, R).eps / kDegree, -(1 - 0.75 * (1 + kappa * kappa)) * more_deg,
                kFirstOrder_deg);
}

TEST(RotatingSine, FundamentalCurrentIsTheMean)
{
    const rotating_sine_config_t c = config(6);
    const Settled r = settled(c, 0.1, 6, {0.5, 3});
    EXPECT_LT(std::abs(r.i_A - Complex(0.5, 3) * std::polar(1.0, 0.1)), 2e-3);
}

TEST(RotatingSine, MisfitIsTheChangeOfThePositiveSequence)
{
    EXPECT_NEAR(settled(config(6), 0, 6).misfit, 0, 0.01);
    rotating_sine_config_t c = config(6);
    c.v_h /= 2; // half of the answer
    EXPECT_NEAR(settled(c, 0, 6).misfit, -0.5, 0.01);
}

TEST(RotatingSine, TheSameCarrierAfterEveryTurn)
{
    const rotating_sine_config_t c = config(6);
    const obs_in_t none = {};
    rotating_sine_t self;
    rotating_sine_reset(&self, &c, &none);
    std::vector<pm_ab_t> first;
    for (int k = 0; k < 5 * c.n; ++k) {
        injection_in_t in = {};
        in.dir = bench::direction(0);
        in.ahead = {1 << 30, 0};
        injection_out_t out;
        rotating_sine_step(&self, &c, &in, &out);
        EXPECT_EQ(out.eps, 0);
        EXPECT_NEAR(std::abs(bench::complex(out.carrier.v)) * kBase.v_V, 35, 1e-4);
        if (k < c.n) {
            first.push_back(out.carrier.v);
            const double angle = 2 * bench::kPi * k / c.n;
            EXPECT_LT(std::abs(bench::complex(out.carrier.v) * kBase.v_V - 35.0 * std::polar(1.0, angle)),
                      1e-4)
                << k;
        } else {
            EXPECT_EQ(out.carrier.v.alpha, first[static_cast<size_t>(k % c.n)].alpha);
            EXPECT_EQ(out.carrier.v.beta, first[static_cast<size_t>(k % c.n)].beta);
        }
    }
}

} // namespace
