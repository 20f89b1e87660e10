// The answer of a machine with resistance to test voltages along the axes of the stator, from its differential equation
// in the rotor frame: whole periods (inform) and halves of a period (pwm_excitation).
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/unit/injection/rig.h"

namespace
{

using bench::Complex;
using bench::kDegree;
using bench::real;

constexpr int kRound = 12;
// Resistance shortens the answer by R T_s / L, 1 %, alike in all directions but for the saliency: second order of
// that in the angle. Rounding of the gain 2^-20.
constexpr double kEps = 0.005;
constexpr double kTurning_deg = 0.1;

injection_config_t config(injection_id_t id)
{
    return rig::config(id, 6, true);
}

axes_config_t &axes_of(injection_config_t &c)
{
    return c.id == INJECTION_inform ? c.inform.axes : c.pwm_excitation.axes;
}

pm_q_t &amplitude_of(injection_config_t &c)
{
    return c.id == INJECTION_inform ? c.inform.v_h : c.pwm_excitation.v_h;
}

class Axes : public ::testing::TestWithParam<injection_id_t>
{
};

TEST_P(Axes, ErrorSignalIsHalfTheSineOfTwiceTheError)
{
    const injection_config_t c = config(GetParam());
    for (int a = -90; a <= 90; a += 10) {
        rig::Run run(c);
        run.error = a * kDegree;
        EXPECT_NEAR(run.after(1000).eps, 0.5 * std::sin(2 * a * kDegree), kEps) << a;
    }
}

// What is left of the angle after a delay of six periods; untold it would be omega 6 T_s.
TEST_P(Axes, ARoundIsSixPeriodsOld)
{
    const injection_config_t c = config(GetParam());
    for (const double omega : {60.0, -60.0}) {
        rig::Run run(c);
        run.omega = omega;
        EXPECT_NEAR(run.after(1003).eps / kDegree, 0, kTurning_deg);
        injection_config_t untold = c;
        axes_of(untold).lag = 0;
        rig::Run late(untold);
        late.omega = omega;
        EXPECT_NEAR(late.after(1003).eps, -omega * 6 * rig::kBase.period_s,
                    0.03 * std::abs(omega) * 6 * 1e-4);
    }
}

TEST_P(Axes, FundamentalCurrentIsFreeOfTheCarrier)
{
    rig::Run run(config(GetParam()));
    run.error = 0.1;
    run.i_dq_A = {0.5, 3};
    run.after(300);
    for (int k = 0; k < kRound; ++k) {
        const Complex i_A = run.step().i_A; // a resistance of 1 % of the excursion
        EXPECT_LT(std::abs(i_A - run.i_dq_A * std::polar(1.0, run.error)), 0.02) << k;
    }
}

// A voltage that is the same for a test voltage and its opposite: what dead time does to a leg far from zero.
TEST_P(Axes, AnUnknownVoltageShowsNothing)
{
    rig::Run run(config(GetParam()));
    run.disturbance_V = std::polar(6.0, 1.0); // settles at 1 A
    EXPECT_NEAR(run.after(1000).eps / kDegree, 0, 0.2);
}

TEST_P(Axes, MisfitIsTheChangeOfTheAnswer)
{
    injection_config_t c = config(GetParam());
    EXPECT_NEAR(rig::Run(c).after(500).misfit, 0, 0.02);
    amplitude_of(c) /= 2;
    EXPECT_NEAR(rig::Run(c).after(500).misfit, -0.5, 0.02);
}

// Pairs of opposites, half of the rounds' pairs with either sign first, and the same again whatever the position.
TEST_P(Axes, CarrierIsBalanced)
{
    injection_config_t c = config(GetParam());
    rig::Run run(c), elsewhere(c);
    elsewhere.omega = 100;
    elsewhere.error = 1;
    run.after(5 * kRound);
    elsewhere.after(5 * kRound);
    const double v_h = real(amplitude_of(c));
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
    rig::Run run(config(INJECTION_pwm_excitation));
    run.error = 0.3;
    run.sampled = false;
    const rig::Answer a = run.after(500);
    EXPECT_EQ(a.eps, 0);
    EXPECT_NEAR(a.misfit, -1, 0.01);
}

} // namespace
