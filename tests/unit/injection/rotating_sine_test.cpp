// The answer of a machine with resistance to a rotating voltage, from its differential equation in the rotor frame.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/injection/rig.h"

namespace
{

using bench::Complex;
using bench::kDegree;
using bench::Machine;
using bench::real;

// First order in R / (omega_h L): what is left is its square, 0.035^2 rad, and the staircase of the voltage.
constexpr double kFirstOrder_deg = 0.15;
constexpr double kSlope = 0.01;

injection_config_t config(double R_told_ohm, bool positive_sequence = true)
{
    return rig::config(INJECTION_rotating_sine, R_told_ohm, positive_sequence);
}

// Locked rotor, imposed position, ten time constants of the stator.
rig::Answer settled(const injection_config_t &c, double error_rad, double R_ohm, Complex i_dq_A = 0)
{
    rig::Run run(c);
    run.error = error_rad;
    run.R_ohm = R_ohm;
    run.i_dq_A = i_dq_A;
    return run.after(1200);
}

TEST(RotatingSine, ErrorSignalIsHalfTheSineOfTwiceTheError)
{
    const injection_config_t c = config(1e-3, false);
    for (int a = -90; a <= 90; a += 10) {
        const double expected = 0.5 * std::sin(2 * a * kDegree);
        EXPECT_NEAR(settled(c, a * kDegree, 1e-3).eps, expected, 0.005) << a;
    }
}

// From the reset on: what the 1 kHz step says without current is no other angle.
TEST(RotatingSine, TurnsByTheResistanceFromTheResetOn)
{
    const injection_config_t c = config(6, false);
    const double rho = real(c.rotating_sine.rho_0);
    ASSERT_GT(rho, 0.03);
    obs_in_t in = {};
    in.dir = bench::direction(0);
    rotating_sine_t self;
    rotating_sine_reset(&self, &c.rotating_sine, &in);
    EXPECT_NEAR(std::atan2(self.turn.sin, self.turn.cos), 2 * rho, 1e-5);
    rotating_sine_slow(&self, &c.rotating_sine, &in);
    EXPECT_NEAR(std::atan2(self.turn.sin, self.turn.cos), 2 * rho, 1e-5);
}

TEST(RotatingSine, SlopeIsOne)
{
    const injection_config_t c = config(1e-3, false);
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

// A saliency too small to be told from the load's share leaves the share of no load at any: 3/4 of what the positive sequence shows.
// 2 rho' by which the source turns the negative sequence, from its error signal.
double turned_by(const injection_config_t &c, const rig::Answer &a)
{
    const double gain = c.rotating_sine.saliency.gain_0 / std::pow(2.0, 20);
    const double size = std::abs(a.vector) / rig::kBase.i_A;
    return std::asin(a.eps / (gain * size)) - std::arg(a.vector);
}

double si(int32_t value, drive_param_id_t id)
{
    return value * std::pow(10, drive_param_exp10[id]);
}

// The limit is what dead time, devices and a hot winding take of the carrier. R ten times what is told, as the phase of a transient
// may look, asks for 0.24 rad, and gets a limit of 0.1; twin: not limited, more than twice that.
TEST(RotatingSine, CorrectionIsAtMostWhatTheInverterTakes)
{
    const drive_params_t p = bench::parameters(bench::kIpmLinear, rig::kBase);
    const double v_lost = si(p.dead_time, DRIVE_PARAM_dead_time) * si(p.f_pwm, DRIVE_PARAM_f_pwm) *
                              si(p.v_dc_nominal, DRIVE_PARAM_v_dc_nominal) +
                          si(p.device_drop, DRIVE_PARAM_device_drop);
    injection_config_t c = config(6);
    const double rho_0 = real(c.rotating_sine.rho_0);
    const double most = 5.0 / 4 * v_lost / 35 + rho_0 / 2;
    EXPECT_NEAR(real(c.rotating_sine.most), most, 1e-4);
    EXPECT_GT(turned_by(c, settled(c, 0, 60)), 2 * (rho_0 + 0.2));
    c.rotating_sine.most = PM_Q(0.1);
    EXPECT_NEAR(turned_by(c, settled(c, 0, 60)), 2 * (rho_0 + 0.1), 0.005);
}

TEST(RotatingSine, TheLoadCountsWhereTheSaliencyIsLarge)
{
    const Machine &m = bench::kIpmLinear;
    const double kappa = (m.L_q0_H - m.L_d0_H) / (m.L_q0_H + m.L_d0_H);
    const double R = 12, told = 6, omega_h = 2 * bench::kPi * 500;
    const double more_deg = (R - told) / (2 * omega_h) * (1 / m.L_d0_H + 1 / m.L_q0_H) / kDegree;
    injection_config_t c = config(told, true);
    ASSERT_TRUE(c.rotating_sine.with_load);
    const double without = -(1 - 0.75 * (1 + kappa * kappa)) * more_deg;
    EXPECT_GT(std::abs(settled(c, 0, R, {0, 3}).eps / kDegree - without), 2 * kFirstOrder_deg);
    c.rotating_sine.with_load = false;
    EXPECT_NEAR(settled(c, 0, R, {0, 3}).eps / kDegree, without, kFirstOrder_deg);
}

TEST(RotatingSine, FundamentalCurrentIsTheMean)
{
    const injection_config_t c = config(6);
    const rig::Answer r = settled(c, 0.1, 6, {0.5, 3});
    EXPECT_LT(std::abs(r.i_A - Complex(0.5, 3) * std::polar(1.0, 0.1)), 2e-3);
}

// Without resistance the current lags the voltage that acts by a quarter of a turn on each axis: in the middle of the period
// i_d = F sin(phi) / L_d, i_q = -F cos(phi) / L_q. The samples lie on the ellipse of F, the middle within 2 % of it.
TEST(RotatingSine, CurrentOfTheCarrierIsThatWhereTheVoltageActs)
{
    injection_config_t c = config(1e-3, false);
    c.rotating_sine.counted_in = true;
    const Machine &m = bench::kIpmLinear;
    rig::Run run(c);
    run.R_ohm = 1e-3;
    run.i_dq_A = {0.5, 3};
    run.after(300);
    const double F = 35 / (2 * bench::kPi * 500) * 1.004;
    for (int k = 0; k < 20; ++k) {
        run.step();
        const excitation_t &e = run.given.back();
        const Complex v = bench::complex(e.v) * rig::kBase.v_V / 35.0 * std::polar(1.0, -run.theta);
        const Complex i = bench::complex(e.i) * rig::kBase.i_A;
        EXPECT_NEAR(i.real(), F / m.L_d0_H * v.imag(), 0.02 * F / m.L_d0_H) << k;
        EXPECT_NEAR(i.imag(), -F / m.L_q0_H * v.real(), 0.02 * F / m.L_q0_H) << k;
    }
    EXPECT_EQ(config(6).rotating_sine.counted_in, false);
}

TEST(RotatingSine, ADelayThatIsToldIsTakenOffThePhase)
{
    drive_params_t p = bench::parameters(bench::kIpmLinear, rig::kBase);
    p.injection = INJECTION_rotating_sine;
    p.start_method = 1;
    p.v_injection = 35000;
    drive_config_t c = {};
    ASSERT_TRUE(drive_configure(&c, &p, PM_CHANNELS).ok);
    const uint32_t lag = c.position.injection.rotating_sine.sine.lag;
    for (const int us : {-100, 30, 100}) {
        p.injection_delay = us * 1000;
        ASSERT_TRUE(drive_configure(&c, &p, PM_CHANNELS).ok);
        const auto more = static_cast<int32_t>(c.position.injection.rotating_sine.sine.lag - lag);
        EXPECT_NEAR(more / 4294967296.0, us * 1e-6 * 500, 1e-6) << us;
    }
}

TEST(RotatingSine, MisfitIsTheChangeOfThePositiveSequence)
{
    EXPECT_NEAR(settled(config(6), 0, 6).misfit, 0, 0.01);
    injection_config_t c = config(6);
    c.rotating_sine.sine.v_h /= 2; // half of the answer
    EXPECT_NEAR(settled(c, 0, 6).misfit, -0.5, 0.01);
}

TEST(RotatingSine, TheSameCarrierAfterEveryTurn)
{
    const injection_config_t c = config(6);
    const rotating_sine_config_t &own = c.rotating_sine;
    const obs_in_t none = {};
    rotating_sine_t self;
    rotating_sine_reset(&self, &own, &none);
    std::vector<pm_ab_t> first;
    for (int k = 0; k < 5 * own.sine.n; ++k) {
        injection_in_t in = {};
        in.dir = bench::direction(0);
        in.ahead = {1 << 30, 0};
        injection_out_t out;
        rotating_sine_step(&self, &own, &in, &out);
        EXPECT_EQ(out.eps, 0);
        EXPECT_NEAR(std::abs(bench::complex(out.carrier.v)) * rig::kBase.v_V, 35, 1e-4);
        if (k < own.sine.n) {
            first.push_back(out.carrier.v);
            const double angle = 2 * bench::kPi * k / own.sine.n;
            EXPECT_LT(
                std::abs(bench::complex(out.carrier.v) * rig::kBase.v_V - 35.0 * std::polar(1.0, angle)),
                1e-4)
                << k;
        } else {
            EXPECT_EQ(out.carrier.v.alpha, first[static_cast<size_t>(k % own.sine.n)].alpha);
            EXPECT_EQ(out.carrier.v.beta, first[static_cast<size_t>(k % own.sine.n)].beta);
        }
    }
}

TEST(RotatingSine, AResetForgetsTheNegativeSequence)
{
    const injection_config_t c = config(6, false);
    obs_in_t in = {};
    in.dir = bench::direction(0);
    rotating_sine_t self = {};
    self.negative = {PM_ONE, PM_ONE};
    rotating_sine_reset(&self, &c.rotating_sine, &in);
    EXPECT_EQ(self.negative.d, 0);
    EXPECT_EQ(self.negative.q, 0);
}

} // namespace
