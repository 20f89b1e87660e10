#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/contract/bench.h"
#include "tests/contract/winding.h"

namespace
{

using bench::Base;
using bench::Complex;
using bench::fixed;
using bench::kJ;
using bench::Machine;
using bench::real;
using bench::Winding;

const Machine kMachine = bench::kIpmLinear;
const Base kBase = bench::kIpmBase;

// Resistance and EMF of the prediction by Euler: their change within a period.
constexpr double kEuler = 0.01;

// The formulas of the header; `share` of the inductances is told.
deadbeat_config_t config(double share = 1)
{
    const double z = kBase.impedance_ohm(), t = kBase.period_s;
    const auto k = [&](double L_H) { return fixed(share * L_H / t / z, 25); };
    const auto per_L = [&](double L_H) { return fixed(t * z / (share * L_H), 28); };
    deadbeat_config_t c = {};
    c.model.R = fixed(kMachine.R_ohm / z, 28);
    c.model.L_d = fixed(share * kMachine.L_d0_H / kBase.inductance_H(), 28);
    c.model.L_q = fixed(share * kMachine.L_q0_H / kBase.inductance_H(), 28);
    c.model.psi_m = fixed(kMachine.psi_m_Wb / kBase.psi_Wb(), 28);
    c.model.per_L_d = per_L(kMachine.L_d0_H);
    c.model.per_L_q = per_L(kMachine.L_q0_H);
    c.k_d = k(kMachine.L_d0_H);
    c.k_q = k(kMachine.L_q0_H);
    return c;
}

// The currents from a step of the reference on; `unknown`: a voltage in the frame that the model does not know.
std::vector<Complex> respond(const deadbeat_config_t &c, double omega, Complex ref, int periods,
                             double v_max = 4, Complex unknown = 0)
{
    Winding winding(kMachine, kBase, omega);
    deadbeat_t self;
    deadbeat_reset(&self, &c, bench::dq(kJ * omega * kMachine.psi_m_Wb / kBase.psi_Wb()), bench::dq(0), 0);
    std::vector<Complex> i;
    for (int k = -50; k < periods; ++k) {
        if (k >= 0) {
            i.push_back(winding.i());
        }
        const regulator_in_t in = {bench::dq(winding.i()), bench::dq(k < 0 ? 0 : ref),
                                   fixed(omega, 28),       fixed(v_max, 28),
                                   {1 << 30, 0},           PM_ONE};
        regulator_out_t out = {};
        deadbeat_step(&self, &c, &in, &out);
        winding.run(Complex{real(out.v.d, 22), real(out.v.q, 22)} + unknown);
    }
    return i;
}

TEST(Deadbeat, ReachesTheReferenceTwoPeriodsAfterTheSample)
{
    for (const double omega : {0.0, 0.4, -0.4}) {
        for (const Complex ref : {Complex{0, 0.05}, Complex{-0.04, 0.03}}) {
            const std::vector<Complex> i = respond(config(), omega, ref, 10);
            EXPECT_LE(std::abs(i[1]), 0.02 * std::abs(ref)) << omega; // not yet
            for (size_t k = 2; k < i.size(); ++k) {
                EXPECT_LE(std::abs(i[k] - ref), 0.02 * std::abs(ref)) << omega << ' ' << k;
            }
        }
    }
}

// The voltage limits the slope: 90 % within 0.9 L_q di / (v_max - omega psi_m) + 2.5 periods.
TEST(Deadbeat, AtTheVoltageLimitTheSlopeIsThatOfTheVoltage)
{
    const double v_max = 0.3, di = 0.4;
    for (const double omega : {0.0, 0.3}) {
        const std::vector<Complex> i = respond(config(), omega, {0, di}, 400, v_max);
        const auto reached =
            std::find_if(i.begin(), i.end(), [di](Complex x) { return x.imag() >= 0.9 * di; }) - i.begin();
        const double psi = kMachine.psi_m_Wb / kBase.psi_Wb();
        const double volts = (v_max - omega * psi) * kBase.v_V - 0.5 * di * kBase.i_A * kMachine.R_ohm;
        const double t90 = 0.9 * kMachine.L_q0_H * di * kBase.i_A / volts;
        EXPECT_LE(static_cast<double>(reached), t90 / kBase.period_s + 2.5) << omega;
        const auto top =
            std::max_element(i.begin(), i.end(), [](Complex a, Complex b) { return a.imag() < b.imag(); });
        EXPECT_LE(top->imag(), 1.03 * di) << omega;
    }
}

// z^2 = 1 - a for an inductance told a times too large, in ten periods.
TEST(Deadbeat, WrongInductanceDiesOutByTheFormula)
{
    for (const double a : {0.5, 0.75, 1.5, 1.8}) {
        const Complex ref = {0, 0.05};
        const std::vector<Complex> i = respond(config(a), 0, ref, 16);
        const double early = std::hypot(std::abs(i[4] - ref), std::abs(i[5] - ref));
        const double late = std::hypot(std::abs(i[8] - ref), std::abs(i[9] - ref));
        EXPECT_NEAR(std::pow(late / early, 0.25), std::sqrt(std::fabs(1 - a)), 0.03) << a;
    }
}

TEST(Deadbeat, TwiceTheInductanceIsTheLimit)
{
    const Complex ref = {0, 0.01};
    const auto last = [&](double a) { return std::abs(respond(config(a), 0, ref, 80).back() - ref); };
    EXPECT_LE(last(1.9), 0.05 * std::abs(ref));
    EXPECT_GE(last(2.1), 10 * std::abs(ref));
}

// 2 V T_s / L on the axis of the voltage.
TEST(Deadbeat, UnknownVoltageLeavesTwiceItsChange)
{
    const double v = 0.01;
    const Complex ref = {0.02, 0.05};
    for (const Complex axis : {Complex{1, 0}, kJ}) {
        const Complex i = respond(config(), 0, ref, 100, 4, v * axis).back();
        const double L_H = axis == kJ ? kMachine.L_q0_H : kMachine.L_d0_H;
        const double expected = 2 * v * kBase.v_V * kBase.period_s / L_H / kBase.i_A;
        EXPECT_NEAR(std::abs(i - ref - expected * axis), 0, 0.05 * expected + kEuler * std::abs(ref));
    }
}

} // namespace
