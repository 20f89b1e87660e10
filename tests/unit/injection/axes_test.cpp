// The answer of a machine with resistance to test voltages along the axes of the stator, from its differential equation
// in the rotor frame: whole periods (inform) and halves of a period (pwm_excitation).
#include <gtest/gtest.h>

#include <cmath>
#include <string>

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
const Machine &kMachine = bench::kIpmLinear;

constexpr int kRound = 12;
// Resistance shortens the answer by R T_s / L, 1 %, alike in all directions but for the saliency: second order of
// that in the angle. Rounding of the gain 2^-20.
constexpr double kEps = 0.005;
constexpr double kTurning_deg = 0.1;

injection_config_t config(injection_id_t id)
{
    drive_params_t p = bench::parameters(kMachine, kBase);
    p.injection = id;
    p.start_method = 1;
    drive_config_t c = {};
    EXPECT_TRUE(drive_configure(&c, &p, PM_CHANNELS).ok);
    return c.position.injection;
}

struct Answer {
    double eps, misfit;
    Complex i_error_A; // of the fundamental current, the estimated frame
};

// Any of the two, on a rotor that turns, with a position that is wrong by error_rad.
class Rotor
{
  public:
    explicit Rotor(const injection_config_t &c, double omega_rad_s = 0, double error_rad = 0)
        : config_(c), omega_(omega_rad_s), error_(error_rad)
    {
        obs_in_t first = {};
        first.i = bench::ab(seen());
        first.dir = bench::direction(theta_ - error_);
        first.omega = bench::fixed(omega_ / kBase.omega_rad_s, 28);
        first.i_dq = bench::dq(i_ * std::polar(1.0, error_) / kBase.i_A);
        injection_reset(&self_, &config_, &first);
    }

    Complex i_A = 0;           // fundamental, kept by a steady voltage
    Complex disturbance_V = 0; // in the stator, that nobody knows of
    bool sampled = true;

    Answer after(int periods)
    {
        i_ = i_A;
        Answer a = {};
        for (int k = 0; k < periods; ++k) {
            a = step(k);
        }
        return a;
    }

    std::vector<excitation_t> given;

  private:
    Complex seen() const
    {
        return i_ * std::polar(1.0, theta_) / kBase.i_A;
    }

    Answer step(int k)
    {
        pm_measure_t codes = {};
        const bool asked = given.size() > 2 && given[given.size() - 2].sample_at[0] != 0;
        codes.sampled = sampled && asked ? 1 : 0;
        const obs_more_t more = {&codes, {bench::ab(between_ / kBase.i_A), {0, 0}}};
        injection_in_t in = {};
        in.i = bench::ab(seen());
        in.dir = bench::direction(theta_ - error_);
        in.omega = bench::fixed(omega_ / kBase.omega_rad_s, 28);
        in.more = &more;
        injection_out_t out;
        injection_step(&self_, &config_, &in, &out);
        if (k % 10 == 9) {
            obs_in_t slow = {};
            slow.i_dq = out.i;
            slow.omega = in.omega;
            injection_slow(&self_, &config_, &slow);
        }
        const Answer a = {real(out.eps), real(injection_last(&self_, &config_).misfit),
                          bench::complex(out.i) * kBase.i_A - i_A * std::polar(1.0, error_)};
        given.push_back(out.carrier);
        run(given.size() > 1 ? given[given.size() - 2] : excitation_t{});
        return a;
    }

    // A period with the excitation of the step before.
    void run(const excitation_t &e)
    {
        const Machine &m = kMachine;
        const Complex steady =
            m.R_ohm * i_A + kJ * omega_ * Complex(m.L_d0_H * i_A.real() + m.psi_m_Wb, m.L_q0_H * i_A.imag());
        const int n = 100;
        const double t = kBase.period_s / n;
        for (int k = 0; k < n; ++k) {
            if (2 * k == n) {
                between_ = i_ * std::polar(1.0, theta_);
            }
            const Complex added = bench::complex(e.v) + (2 * k < n ? 1.0 : -1.0) * bench::complex(e.split);
            const Complex v =
                steady + (added * kBase.v_V + disturbance_V) * std::polar(1.0, -theta_ - omega_ * t / 2);
            const Complex psi = {m.L_d0_H * i_.real() + m.psi_m_Wb, m.L_q0_H * i_.imag()};
            const Complex dpsi = v - m.R_ohm * i_ - kJ * omega_ * psi;
            i_ += t * Complex(dpsi.real() / m.L_d0_H, dpsi.imag() / m.L_q0_H);
            theta_ += omega_ * t;
        }
    }

    injection_config_t config_;
    injection_t self_ = {};
    double omega_, error_, theta_ = 0.4;
    Complex i_ = 0, between_ = 0;
};

class Axes : public ::testing::TestWithParam<injection_id_t>
{
};

TEST_P(Axes, ErrorSignalIsHalfTheSineOfTwiceTheError)
{
    const injection_config_t c = config(GetParam());
    for (int a = -90; a <= 90; a += 10) {
        Rotor run(c, 0, a * kDegree);
        EXPECT_NEAR(run.after(1000).eps, 0.5 * std::sin(2 * a * kDegree), kEps) << a;
    }
}

// What is left of the angle after a delay of six periods; untold it would be omega 6 T_s.
TEST_P(Axes, ARoundIsSixPeriodsOld)
{
    const injection_config_t c = config(GetParam());
    for (const double omega : {60.0, -60.0}) {
        Rotor run(c, omega);
        EXPECT_NEAR(run.after(1003).eps / kDegree, 0, kTurning_deg);
        injection_config_t untold = c;
        (GetParam() == INJECTION_inform ? untold.inform.axes : untold.pwm_excitation.axes).lag = 0;
        Rotor late(untold, omega);
        EXPECT_NEAR(late.after(1003).eps, -omega * 6 * kBase.period_s, 0.03 * std::abs(omega) * 6 * 1e-4);
    }
}

TEST_P(Axes, FundamentalCurrentIsFreeOfTheCarrier)
{
    Rotor run(config(GetParam()), 0, 0.1);
    run.i_A = {0.5, 3};
    for (int k = 0; k < kRound; ++k) {
        EXPECT_LT(std::abs(run.after(301 + k).i_error_A), 0.02) << k; // a resistance of 1 % of the excursion
    }
}

// A voltage that is the same for a test voltage and its opposite: what dead time does to a leg far from zero.
TEST_P(Axes, AnUnknownVoltageShowsNothing)
{
    Rotor run(config(GetParam()));
    run.disturbance_V = std::polar(6.0, 1.0); // settles at 1 A
    EXPECT_NEAR(run.after(1000).eps / kDegree, 0, 0.2);
}

TEST_P(Axes, MisfitIsTheChangeOfTheAnswer)
{
    injection_config_t c = config(GetParam());
    EXPECT_NEAR(Rotor(c).after(500).misfit, 0, 0.02);
    (GetParam() == INJECTION_inform ? c.inform.v_h : c.pwm_excitation.v_h) /= 2;
    EXPECT_NEAR(Rotor(c).after(500).misfit, -0.5, 0.02);
}

// Pairs of opposites, half of the rounds' pairs with either sign first, and the same again whatever the position.
TEST_P(Axes, CarrierIsBalanced)
{
    const injection_config_t c = config(GetParam());
    Rotor run(c), elsewhere(c, 100, 1.0);
    run.after(5 * kRound);
    elsewhere.after(5 * kRound);
    const double v_h = real((GetParam() == INJECTION_inform ? c.inform.v_h : c.pwm_excitation.v_h));
    Complex flux = 0, mean = 0; // of the carrier: its integral
    for (size_t k = 0; k < run.given.size(); ++k) {
        const excitation_t &e = run.given[k];
        const Complex u = GetParam() == INJECTION_inform ? bench::complex(e.v) : bench::complex(e.split);
        const Complex other = GetParam() == INJECTION_inform ? bench::complex(elsewhere.given[k].v)
                                                             : bench::complex(elsewhere.given[k].split);
        EXPECT_NEAR(std::abs(u), v_h, 1e-6);
        EXPECT_EQ(u, other) << k;
        EXPECT_EQ(e.sample_at[0], GetParam() == INJECTION_inform ? 0 : 8500) << k;
        flux += u;
        mean += flux / (5.0 * kRound);
        if (k % 2 == 1) {
            EXPECT_LT(std::abs(flux), 1e-6) << k;
        }
    }
    EXPECT_LT(std::abs(mean), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(All, Axes, ::testing::Values(INJECTION_inform, INJECTION_pwm_excitation),
                         [](const auto &p) {
                             return std::string(p.param == INJECTION_inform ? "inform" : "pwm_excitation");
                         });

// Without the sample there is no answer, and the position is not believed.
TEST(PwmExcitation, WithoutItsSampleItSaysSo)
{
    Rotor run(config(INJECTION_pwm_excitation), 0, 0.3);
    run.sampled = false;
    const Answer a = run.after(500);
    EXPECT_EQ(a.eps, 0);
    EXPECT_NEAR(a.misfit, -1, 0.01);
}

} // namespace
