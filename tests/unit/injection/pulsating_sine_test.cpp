#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/injection/rig.h"

namespace
{

using bench::Complex;
using bench::kDegree;
using bench::Machine;

// The gain is for h along a machine without resistance: (R / omega_h L)^2 and the staircase.
constexpr double kEps = 0.005;
constexpr double kSlope = 0.01;
constexpr double kZero_deg = 0.02;
// The settled answer: ten time constants of the stator.
constexpr int kSettled = 1200;

injection_config_t config(bool phase_measured = true)
{
    return rig::config(INJECTION_pulsating_sine, 6, phase_measured);
}

rig::Answer settled(const injection_config_t &c, double error_rad, double R_ohm = 6, Complex i_dq_A = 0)
{
    rig::Run run(c);
    run.error = error_rad;
    run.R_ohm = R_ohm;
    run.i_dq_A = i_dq_A;
    return run.after(kSettled);
}

TEST(PulsatingSine, ErrorSignalIsHalfTheSineOfTwiceTheError)
{
    const injection_config_t c = config();
    for (int a = -90; a <= 90; a += 10) {
        EXPECT_NEAR(settled(c, a * kDegree, 1e-3).eps, 0.5 * std::sin(2 * a * kDegree), kEps) << a;
    }
}

TEST(PulsatingSine, SlopeIsOne)
{
    const double e = kDegree;
    EXPECT_NEAR((settled(config(), e).eps - settled(config(), -e).eps) / (2 * e), 1, kSlope);
}

// What moves the rotating sine by 2 degrees (rotating_sine_test.cpp) and more moves nothing here.
TEST(PulsatingSine, ResistanceMovesNoAngle)
{
    for (const double R : {1e-3, 6.0, 30.0}) {
        EXPECT_NEAR(settled(config(), 0, R).eps / kDegree, 0, kZero_deg) << R;
        EXPECT_NEAR(settled(config(false), 0, R).eps / kDegree, 0, kZero_deg) << R;
    }
}

// With R the answer along d is L_d / |Z_d| times as large and leads by atan(R / omega_h L_d); its own phase shows all
// of it, a fixed one the cosine.
TEST(PulsatingSine, PhaseComesFromTheAnswerAlongD)
{
    const Machine &m = bench::kIpmLinear;
    const double R = 60, x = R / (2 * bench::kPi * 500 * m.L_d0_H);
    const double F = 35e-4 / (2 * std::sin(bench::kPi / 20));
    EXPECT_NEAR(settled(config(), 0, R).vector.real(), F / m.L_d0_H / std::hypot(1, x), 0.01 * F / m.L_d0_H);
    EXPECT_NEAR(settled(config(false), 0, R).vector.real(), F / m.L_d0_H / (1 + x * x), 0.01 * F / m.L_d0_H);
}

// h_q + lambda h_d with an L_dq that the machine has not: zero where tan 2e is that of the sum.
TEST(PulsatingSine, LambdaTurnsTheZero)
{
    const Machine &m = bench::kIpmLinear;
    injection_config_t c = config();
    c.pulsating_sine.saliency.lambda_1 = bench::fixed(-0.1 / 0.3, 28); // -0.1 at 3 A
    const double L_sa = (m.L_d0_H + m.L_q0_H) / 2, K = (m.L_q0_H - m.L_d0_H) / 2;
    double e = 0; // K sin 2e = 0.1 (L_sa + K cos 2e)
    for (int n = 0; n < 100; ++n) {
        e = std::asin(0.1 * (L_sa + K * std::cos(2 * e)) / K) / 2;
    }
    EXPECT_GT(e / kDegree, 10);
    rig::Run run(c);
    run.i_dq_A = {0, 3};
    run.error = e;
    // the machine's current is along its own q; in the estimated frame i_q is cos(e) of it
    const double lambda_off = 1 - std::cos(e);
    EXPECT_NEAR(run.after(kSettled).eps / kDegree, 0, e / kDegree * lambda_off * 1.5);
}

TEST(PulsatingSine, SpeedMovesNoAngle)
{
    for (const double omega : {50.0, -50.0}) { // 10 % of the base
        rig::Run run(config());
        run.omega = omega;
        run.i_dq_A = {0, 3};
        EXPECT_NEAR(run.after(kSettled).eps / kDegree, 0, 0.1) << omega;
    }
}

// METHODS.md 4.3.1 (e), addendum row 37: 40 and 80 degrees at standstill, below 5 within 60 ms, loop of 20 Hz.
TEST(PulsatingSine, LocksFromAnyErrorOfItsBasin)
{
    for (const int a : {-80, -40, 40, 80}) {
        rig::Run run(config());
        run.error = a * kDegree;
        run.loop_Hz = 20;
        EXPECT_LT(run.settling(2000, 5 * kDegree) * rig::kBase.period_s, 0.060) << a;
    }
}

TEST(PulsatingSine, FundamentalCurrentIsTheMean)
{
    const rig::Answer a = settled(config(), 0.1, 6, {0.5, 3});
    EXPECT_LT(std::abs(a.i_A - Complex(0.5, 3) * std::polar(1.0, 0.1)), 2e-3);
}

TEST(PulsatingSine, MisfitIsTheChangeOfTheAnswer)
{
    EXPECT_NEAR(settled(config(), 0).misfit, 0, 0.01);
    injection_config_t c = config();
    c.pulsating_sine.sine.v_h /= 2; // half of the answer
    EXPECT_NEAR(settled(c, 0).misfit, -0.5, 0.01);
    // at a right angle the carrier runs along q
    EXPECT_NEAR(settled(config(), 90 * kDegree).misfit, 43.0 / 75 - 1, 0.01);
}

TEST(PulsatingSine, VoltageSwingsAlongD)
{
    rig::Run run(config());
    run.error = -0.3;
    run.after(100);
    for (int k = 0; k < 100; ++k) {
        const Complex v = bench::complex(run.given[static_cast<size_t>(k)].v) * rig::kBase.v_V;
        const Complex expected = 35 * std::cos(2 * bench::kPi * k / 20) * std::polar(1.0, 0.4 + 0.3);
        EXPECT_LT(std::abs(v - expected), 1e-4) << k;
    }
}

// sine.h: a phase is followed up to 0.7 rad either way.
TEST(Sine, PhaseIsLimited)
{
    for (const double delta : {0.0, 0.3, -0.3, 0.65, -0.65, 0.75, -0.75, 1.5, -3.0}) {
        const pm_dir_t dir = sine_phase(bench::fixed(std::cos(delta), 28), bench::fixed(std::sin(delta), 28));
        const double expected = std::clamp(delta, -0.7, 0.7);
        EXPECT_NEAR(bench::real(dir.cos, 31), std::cos(expected), 1e-4) << delta;
        EXPECT_NEAR(bench::real(dir.sin, 31), std::sin(expected), 1e-4) << delta;
    }
}

} // namespace
