#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "firmware/params/parameters.h"
#include "tests/contract/bench.h"
#include "tests/contract/observers.h"
#include "tests/unit/injection/rig.h"
#include "tests/unit/math/samples.h"

namespace
{

using bench::Base;
using bench::Complex;
using bench::fixed;
using bench::kDegree;
using bench::kJ;
using bench::Machine;
using bench::real;

// Gains and the difference of a staircase against their series.
constexpr double kEps = 0.004;
constexpr double kSlope = 0.01;
// Of L_q / T_s times an LSB of the window.
constexpr double kZero_deg = 0.02;
constexpr int kSettled = 200; // windows of 20

const Base kBase = bench::kIpmBase;
const Machine &kMachine = bench::kIpmLinear;
constexpr double kI_h_A = 0.3;
const double kV_h_V =
    kMachine.L_d0_H * kI_h_A * 2 * std::sin(bench::kPi / 20) / kBase.period_s; // of 20 periods

drive_params_t parameters()
{
    drive_params_t p = bench::parameters(kMachine, kBase);
    p.injection = static_cast<int32_t>(INJECTION_current_sine);
    p.start_method = 1;
    p.regulator = static_cast<int32_t>(REGULATOR_finite_set);
    p.v_injection = static_cast<int32_t>(std::lround(1e3 * kV_h_V));
    return p;
}

injection_config_t config(const drive_params_t &p)
{
    drive_config_t c = {};
    const drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_TRUE(r.ok) << drive_param_table[r.param].name << ": " << r.reason;
    return c.position.injection;
}

struct Answer {
    double eps, misfit;
    Complex vector;
};

// A winding whose current goes exactly where it is asked to go, two periods later, in the frame that is estimated, and the mean
// voltage that takes it there, from its flux.
class Held
{
  public:
    double R_ohm = 0, L_d_H = kMachine.L_d0_H, L_q_H = kMachine.L_q0_H, L_dq_H = 0;
    double theta = 0.4, error = 0, omega = 0; // electrical; the position given is theta - error
    Complex i_dq_A = 0;                       // beside the carrier
    double ripple_A = 0;                      // of switch states, each axis
    double loop_Hz = 0;
    std::vector<excitation_t> given;

    explicit Held(const injection_config_t &c) : config_(c)
    {
    }

    Answer after(int periods)
    {
        Answer a = {};
        for (int k = 0; k < periods; ++k) {
            a = step();
        }
        return a;
    }

    Answer step()
    {
        const Complex frame = std::polar(1.0, theta - error);
        const Complex wanted =
            i_dq_A + (given.size() > 1 ? real(given[given.size() - 2].i_ref) * kBase.i_A : 0);
        const Complex ripple(random_.within(-ripple_A, ripple_A), random_.within(-ripple_A, ripple_A));
        const Complex i = (wanted + ripple) * frame;
        const Complex psi = flux(i);
        obs_in_t seen = {};
        seen.i = bench::ab(i / kBase.i_A);
        seen.dir = bench::direction(theta - error);
        seen.omega = fixed(omega / kBase.omega_rad_s, 28);
        seen.i_dq = bench::dq(wanted / kBase.i_A);
        if (given.empty()) {
            injection_reset(&self_, &config_, &seen);
            injection_slow(&self_, &config_, &seen);
            i_ = i;
            psi_ = psi;
        }
        const Complex v = (psi - psi_) / kBase.period_s + 0.5 * R_ohm * (i + i_);
        i_ = i;
        psi_ = psi;
        injection_in_t in = {};
        in.i = seen.i;
        in.dir = seen.dir;
        in.omega = seen.omega;
        in.ahead = {1 << 30, 0};
        in.v = bench::ab(v / kBase.v_V);
        injection_out_t out;
        injection_step(&self_, &config_, &in, &out);
        if (given.size() % 10 == 9) {
            injection_slow(&self_, &config_, &seen);
        }
        const obs_out_t last = injection_last(&self_, &config_);
        EXPECT_EQ(last.eps, out.eps);
        EXPECT_LT(std::abs(bench::complex(out.i) * kBase.i_A - wanted - ripple), 1e-5);
        given.push_back(out.carrier);
        theta += omega * kBase.period_s;
        error -= loop_.turn(loop_Hz, real(out.eps), kBase.period_s);
        return {real(out.eps), real(last.misfit), bench::complex(last.vector) * kBase.v_V};
    }

  private:
    Complex flux(Complex i_ab) const
    {
        const Complex i = i_ab * std::polar(1.0, -theta);
        const Complex psi = {kMachine.psi_m_Wb + L_d_H * i.real() + L_dq_H * i.imag(),
                             L_q_H * i.imag() + L_dq_H * i.real()};
        return psi * std::polar(1.0, theta);
    }

    injection_config_t config_;
    injection_t self_ = {};
    samples::Random random_;
    Complex i_ = 0, psi_ = 0;
    rig::Loop loop_;
};

Answer settled(double error_rad, const injection_config_t &c = config(parameters()))
{
    Held run(c);
    run.error = error_rad;
    return run.after(kSettled);
}

// y = (L_q - L_d) / 2 sin 2e and v_d = L_d cos^2 e + L_q sin^2 e, both times di_d / T_s.
TEST(CurrentSine, ErrorSignalIsTheVoltageAcross)
{
    const double L_d = kMachine.L_d0_H, L_q = kMachine.L_q0_H;
    for (int a = -90; a <= 90; a += 10) {
        const double s = std::sin(a * kDegree), c = std::cos(a * kDegree);
        EXPECT_NEAR(settled(a * kDegree).eps, L_d * s * c / (L_d * c * c + L_q * s * s), kEps) << a;
    }
}

TEST(CurrentSine, SlopeIsOne)
{
    EXPECT_NEAR((settled(kDegree).eps - settled(-kDegree).eps) / (2 * kDegree), 1, kSlope);
}

// What rotation induces across is a quarter of a period off the voltage along d but for the resistance in that:
// w / w_h R / (w_h L_d), 0.1 degrees at 20 % of the base.
TEST(CurrentSine, NeitherLoadNorSpeedNorResistanceMovesTheAngle)
{
    const double L_d = kMachine.L_d0_H, L_q = kMachine.L_q0_H, omega_h = 2 * bench::kPi * 500;
    for (const double omega : {0.0, 100.0, -100.0}) {
        const double expected = -omega / omega_h * 6 / (omega_h * L_d) * L_d / (L_q - L_d);
        for (const Complex i : {Complex{0, 0}, Complex{-1, 3}, Complex{0.5, -3}}) {
            Held run(config(parameters()));
            run.omega = omega;
            run.i_dq_A = i;
            run.R_ohm = 6;
            EXPECT_NEAR(run.after(kSettled).eps, expected, kZero_deg * kDegree) << omega << ' ' << i;
        }
    }
}

// The ripple is of the same voltage and current: at the right angle it leaves nothing, beside it what |V_d| of the last
// millisecond is off.
TEST(CurrentSine, RippleOfSwitchStatesMovesNoAngle)
{
    for (const double error : {0.0, 0.1}) {
        Held run(config(parameters()));
        run.ripple_A = 0.1;
        run.error = error;
        run.after(kSettled);
        double sum = 0;
        for (int k = 0; k < 10 * kSettled; ++k) {
            const double eps = run.step().eps;
            ASSERT_NEAR(eps, error, 0.7 * error + kZero_deg * kDegree) << k;
            sum += eps;
        }
        EXPECT_NEAR(sum / (10 * kSettled), error, 0.1 * error + kZero_deg * kDegree);
    }
}

// What is controlled does not show: the twin.
TEST(CurrentSine, TheCurrentAloneShowsNothing)
{
    drive_params_t p = parameters();
    p.injection_post_comp = 0;
    EXPECT_NEAR(settled(0.3, config(p)).eps, 0, 1e-3);
}

// L_dq, L_d and L_q of rated current, at that current: zero with row 51, without it where
// (L_q - L_d) / 2 sin 2e + L_dq cos 2e is zero.
TEST(CurrentSine, CrossCouplingIsCompensatedByLambda)
{
    drive_params_t p = parameters();
    const double L_d = 0.04, L_q = 0.06, L_dq = -0.005;
    p.L_dh_rated = static_cast<int32_t>(std::lround(L_d * 1e9));
    p.L_qh_rated = static_cast<int32_t>(std::lround(L_q * 1e9));
    p.L_dqh_rated = static_cast<int32_t>(std::lround(L_dq * 1e9));
    p.cross_half = static_cast<int32_t>(std::lround(L_dq / L_q / 2 * 1e6));
    for (const bool compensated : {true, false}) {
        p.cross_coupling_comp = compensated ? 1 : 0;
        for (const double sign : {1.0, -1.0}) {
            Held run(config(p));
            run.L_d_H = L_d;
            run.L_q_H = L_q;
            run.L_dq_H = sign * L_dq;
            run.i_dq_A = kJ * sign * (p.i_rated * 1e-3);
            run.error = compensated ? 0 : 0.5 * std::atan2(2 * run.L_dq_H, L_q - L_d);
            EXPECT_NEAR(run.after(5 * kSettled).eps / kDegree, 0, 0.1) << compensated << sign;
        }
    }
}

TEST(CurrentSine, MisfitIsTheChangeOfTheVoltage)
{
    EXPECT_NEAR(settled(0).misfit, 0, 0.01);
    injection_config_t c = config(parameters());
    c.current_sine.i_h /= 2;
    EXPECT_NEAR(settled(0, c).misfit, -0.5, 0.01);
    // at a right angle the carrier runs along q
    EXPECT_NEAR(settled(90 * kDegree).misfit, 75.0 / 43 - 1, 0.01);
}

TEST(CurrentSine, ReferenceSwingsAndTheModulatorIsToldWhatIsToCome)
{
    Held run(config(parameters()));
    run.after(100);
    const auto wanted = [](int k) { return kI_h_A * std::cos(2 * bench::kPi * k / 20); };
    for (int k = 0; k < 100; ++k) {
        const excitation_t &e = run.given[static_cast<size_t>(k)];
        ASSERT_NEAR(real(e.i_ref) * kBase.i_A, wanted(k), 1e-4) << k;
        const double to_come = 0.5 * (wanted(k) + wanted(k - 1)) - wanted(k - 2);
        ASSERT_NEAR(real(e.i.d) * kBase.i_A, to_come, 0.02 * kI_h_A) << k;
        ASSERT_EQ(std::abs(bench::complex(e.v)), 0) << k;
    }
}

TEST(CurrentSine, LocksFromAnyErrorOfItsBasin)
{
    for (const int a : {-80, -40, 40, 80}) {
        Held run(config(parameters()));
        run.error = a * kDegree;
        run.loop_Hz = 10;
        run.after(1500);
        EXPECT_NEAR(run.error / kDegree, 0, 0.5) << a;
    }
}

TEST(CurrentSine, WhatItCannotDoIsRefused)
{
    drive_params_t p = parameters();
    drive_config_t c = {};
    p.v_injection = 105000; // of 300 V / sqrt(3)
    drive_result_t r = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_EQ(r.param, DRIVE_PARAM_v_injection);
    EXPECT_STREQ(r.reason, "leaves too little of v_dc_nominal for control");
    p = parameters();
    p.cross_coupling_comp = 2;
    r = drive_configure(&c, &p, PM_CHANNELS);
    EXPECT_EQ(r.param, DRIVE_PARAM_cross_coupling_comp);
    p = parameters();
    p.f_injection = p.f_pwm / 100 * 1000;
    EXPECT_EQ(drive_configure(&c, &p, PM_CHANNELS).param, DRIVE_PARAM_f_injection);
}

// The regulator makes all of the voltage: none is kept from it.
TEST(CurrentSine, KeepsNoVoltageFromTheRegulator)
{
    EXPECT_EQ(config(parameters()).reserve, 0);
}

} // namespace
