// The choice of a switch state against the table, and the loop on the windings of two machines.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/control/switching.h"
#include "tests/unit/math/samples.h"

namespace
{

using bench::Complex;
using bench::fixed;
using bench::real;
using switching::Bench;

regulator_config_t config(const Bench &b)
{
    return switching::config(switching::parameters(b, REGULATOR_direct_torque));
}

double torque_Nm(const Bench &b, Complex i_A)
{
    const bench::Machine &m = b.machine;
    const double psi_d = m.psi_m_Wb + m.L_d0_H * i_A.real(), psi_q = m.L_q0_H * i_A.imag();
    return 1.5 * m.pole_pairs * (psi_d * i_A.imag() - psi_q * i_A.real());
}

double band_Nm(const Bench &b)
{
    return 0.05 * 1.5 * b.machine.pole_pairs * b.machine.psi_m_Wb * b.i_rated_A;
}

// What a period moves the torque by.
double slope_Nm(const Bench &b)
{
    const bench::Machine &m = b.machine;
    const double emf_V = std::abs(b.emf()) * b.base.v_V;
    return 1.5 * m.pole_pairs * m.psi_m_Wb * (2 * b.link_V / 3 + emf_V) * b.base.period_s / m.L_q0_H;
}

// Row 6, METHODS-ADDENDUM D(g): within the band and what two periods move the torque by.
TEST(DirectTorque, TorqueStaysWithinItsBandAndTwoPeriods)
{
    for (const double period_s : {100e-6, 50e-6, 25e-6}) {
        for (const Bench &b : {switching::ipm(period_s), switching::spm(period_s)}) {
            for (const double direction : {1.0, -1.0}) {
                switching::Loop loop(b, config(b), direction * b.omega());
                const Complex ref = {0, 2 * direction};
                double most = 0;
                for (int k = 0; k < 10000; ++k) {
                    const Complex i = loop.run(ref);
                    most = k < 2000 ? 0 : std::max(most, std::abs(torque_Nm(b, i) - torque_Nm(b, ref)));
                }
                RecordProperty(b.name + std::to_string(std::lround(1e-3 / period_s)) +
                                   (direction > 0 ? "" : "_reverse"),
                               std::to_string(most) + " of " + std::to_string(band_Nm(b) + 2 * slope_Nm(b)));
                EXPECT_LE(most, band_Nm(b) + 2 * slope_Nm(b)) << b.name << ' ' << period_s;
            }
        }
    }
}

// Row 6, twin: the states of flux up and flux down exchanged.
TEST(DirectTorque, WithFluxUpAndDownExchangedControlIsLost)
{
    const auto exchanged = [](regulator_t &self, regulator_out_t &out) {
        direct_torque_t &s = self.direct_torque;
        const double turn = s.torque == 0 ? bench::kPi : s.torque * s.flux * bench::kPi / 3;
        const Complex v = Complex{real(s.v.d, 28), real(s.v.q, 28)} * std::polar(1.0, turn);
        s.v = bench::dq(v);
        out.v = {pm_widen(s.v.d), pm_widen(s.v.q)};
    };
    for (const Bench &b : {switching::ipm(), switching::spm()}) {
        switching::Loop loop(b, config(b), b.omega());
        const Complex ref = {0, 2};
        double most = 0;
        for (int k = 0; k < 2000; ++k) {
            const Complex i = loop.run(ref, exchanged);
            most = k < 200 ? 0 : std::max(most, std::abs(torque_Nm(b, i) - torque_Nm(b, ref)));
        }
        EXPECT_GT(most, 2 * (band_Nm(b) + 2 * slope_Nm(b))) << b.name;
    }
}

// Row 6: within 10 % of a step after at most 2 ms.
TEST(DirectTorque, TorqueFollowsAStepWithinTwoMilliseconds)
{
    for (const Bench &b : {switching::ipm(), switching::spm()}) {
        for (const double direction : {1.0, -1.0}) {
            switching::Loop loop(b, config(b), direction * b.omega());
            for (int k = 0; k < 1000; ++k) {
                loop.run(0);
            }
            const Complex ref = {0, 2 * direction};
            int k = 0;
            while (k < 1000 && std::abs(torque_Nm(b, loop.i()) / torque_Nm(b, ref) - 1) > 0.1) {
                loop.run(ref);
                ++k;
            }
            RecordProperty(std::string("step_") + b.name, std::to_string(k * b.base.period_s));
            EXPECT_LE(k * b.base.period_s, 2e-3) << b.name;
        }
    }
}

// i_d and i_q are what torque and flux give: 2 % of psi_m and what a period moves.
TEST(DirectTorque, FluxIsThatOfTheReference)
{
    const Bench b = switching::ipm();
    switching::Loop loop(b, config(b), b.omega());
    const Complex ref = {-1, 2};
    Complex sum = 0;
    for (int k = 0; k < 8000; ++k) {
        const Complex i = loop.run(ref);
        sum += k < 2000 ? 0 : i;
    }
    EXPECT_NEAR(sum.real() / 6000, ref.real(), 0.02 * b.machine.psi_m_Wb / b.machine.L_d0_H);
    EXPECT_NEAR(sum.imag() / 6000, ref.imag(), 0.1);
}

// At no torque the flux is still held: a vector of current along d at standstill.
TEST(DirectTorque, MagnetisesAtStandstill)
{
    const Bench b = switching::ipm();
    switching::Loop loop(b, config(b), 0);
    for (int k = 0; k < 4000; ++k) {
        loop.run({2, 0});
    }
    EXPECT_NEAR(loop.i().real(), 2, 0.3);
    EXPECT_NEAR(loop.i().imag(), 0, 0.3);
}

// The table, from the levels and the flux that the step leaves.
TEST(DirectTorque, TakesTheStateOfTheTable)
{
    const Bench b = switching::spm();
    const regulator_config_t c = config(b);
    samples::Random random;
    int seen[3][2] = {};
    for (int n = 0; n < 20000; ++n) {
        const Complex i = {random.within(-0.3, 0.3), random.within(-0.3, 0.3)};
        const Complex ref = i + Complex{random.within(-0.1, 0.1), random.within(-0.1, 0.1)};
        const double angle = random.within(-4, 4);
        regulator_t self = {};
        regulator_reset(&self, &c, {0, 0}, bench::dq(i), 0);
        const regulator_in_t in = {
            bench::dq(i), bench::dq(ref), 0, PM_ONE, switching::half_direction(angle), fixed(b.link(), 28)};
        regulator_out_t out = {};
        regulator_step(&self, &c, &in, &out);
        const direct_torque_t &s = self.direct_torque;
        const double at = std::arg(Complex{real(s.psi.d, 28), real(s.psi.q, 28)} * std::polar(1.0, angle));
        const double sixths = at / (bench::kPi / 3);
        if (std::abs(sixths - std::floor(sixths) - 0.5) < 1e-3) {
            continue; // at the border either is right
        }
        const Complex v = switching::voltage_of(out.legs, b.link());
        ++seen[s.torque + 1][s.flux > 0 ? 1 : 0];
        if (s.torque == 0) {
            if (std::abs(v) > 0) {
                const double sector = std::round(sixths) + (s.flux > 0 ? 0 : 3);
                ASSERT_LT(std::abs(v - 2 * b.link() / 3 * std::polar(1.0, sector * bench::kPi / 3)), 1e-6)
                    << n;
            }
            continue;
        }
        const double on = s.torque * (s.flux > 0 ? 1 : 2);
        const double sector = std::round(sixths) + on;
        ASSERT_LT(std::abs(v - 2 * b.link() / 3 * std::polar(1.0, sector * bench::kPi / 3)), 1e-6) << n;
    }
    for (const auto &torque : seen) {
        for (const int n : torque) {
            EXPECT_GT(n, 100);
        }
    }
}

} // namespace
